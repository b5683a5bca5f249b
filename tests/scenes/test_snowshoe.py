"""Snowshoes: closed plates that stand flat through every step and press the snow in place of the shoes."""

import numpy as np
import pytest

from sample_scenes.body import SIDES, Body
from sample_scenes.gait import walk
from tests.scenes.kinematics import knee_flexion


@pytest.fixture
def walker(scene):
    from sample_scenes.character import create_character
    from sample_scenes.keys import write_action
    from sample_scenes.snowshoe import ON_SNOWSHOES, put_on_snowshoes

    body = Body()
    armature = create_character("Walker", body, scene.collection)
    shoes = put_on_snowshoes(armature, body, scene.collection)
    motion = walk(body, ON_SNOWSHOES, 60)
    write_action(armature, motion, "Walk", first_frame=0)
    return shoes, motion


@pytest.mark.slow
def test_a_planted_snowshoe_lies_still_and_flat_and_a_swinging_one_is_lifted(walker, scene):
    import bpy

    shoes, motion = walker
    for side, shoe in shoes.items():
        lowest, planted = [], []
        for frame in range(60):
            scene.frame_set(frame)
            world = np.array(shoe.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)
            points = np.array([vertex.co for vertex in shoe.data.vertices]) @ world[:3, :3].T + world[:3, 3]
            lowest.append(points[:, 2].min())
            stance = [f for f in motion.footfalls if f.side == side and f.strike < frame / 24 < f.leave]
            planted.append((stance[0].strike, world) if stance else None)
        times = {entry[0] for entry in planted if entry}
        for strike in times:
            poses = np.array([entry[1] for entry in planted if entry and entry[0] == strike])
            assert np.ptp(poses, axis=0).max() < 1e-3
            assert poses[:, 2, 2].min() > 0.9999
        lowest = np.array(lowest)
        on_ground = np.array([entry is not None for entry in planted])
        assert np.abs(lowest[on_ground]).max() < 1e-3
        assert lowest[~on_ground].min() > -5e-3
        assert lowest[~on_ground].max() > 0.05


def test_a_plate_is_closed_and_several_times_as_large_as_a_shoe(scene):
    from sample_scenes.snowshoe import SNOWSHOE_LENGTH, SNOWSHOE_WIDTH, snowshoe_mesh

    vertices, faces = snowshoe_mesh(SNOWSHOE_LENGTH, SNOWSHOE_WIDTH)
    edges = np.concatenate([np.stack([faces[:, i], faces[:, (i + 1) % 4]], axis=1) for i in range(4)])
    directed = {tuple(edge) for edge in edges.tolist()}
    assert len(directed) == len(edges)
    assert directed == {(b, a) for a, b in directed}
    corners = vertices[faces]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]) / 2
    assert normals[:, 2][normals[:, 2] > 0].sum() == pytest.approx(5 * 200e-4, rel=0.15)
    assert np.einsum("ij,ij->", corners.mean(axis=1), normals) > 0  # outward


@pytest.mark.slow
def test_the_knees_bend_to_lift_them(walker):
    _, motion = walker
    for side in SIDES:
        assert 0 < knee_flexion(motion, side).min() < knee_flexion(motion, side).max() < 100
