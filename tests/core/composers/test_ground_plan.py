"""The ground that fits a walk: its height, its slope, and where the feet come down."""

from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.composers.ground_plan import _slope, plan_ground
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.loads.contacts import detect_contacts
from softground_addon.core.loads.estimate import estimate_loads
from tests.core.character import character, flat_sole
from tests.core.walkers import pressed, through_scene_frames, walk


def walked(**options):
    """A walk as it is read from a scene."""
    loads = through_scene_frames(walk(steps=8, **options))
    per_frame = round(len(loads.motion.frames) / (loads.motion.frames[-1] - loads.motion.frames[0] + 1))
    return replace(
        loads.motion,
        frames=loads.motion.frames[::per_frame],
        soles=tuple(replace(sole, transforms=sole.transforms[::per_frame]) for sole in loads.motion.soles),
    )


def moved(motion, matrix):
    return replace(motion, soles=tuple(replace(sole, transforms=matrix @ sole.transforms) for sole in motion.soles))


def moved_up(transforms, height):
    raised = transforms.copy()
    raised[..., 2, 3] += height
    return raised


def climbing(angle):
    """From walking along x to walking up a slope along x."""
    matrix = np.eye(4)
    matrix[0, 0] = matrix[2, 2] = np.cos(angle)
    matrix[0, 2], matrix[2, 0] = -np.sin(angle), np.sin(angle)
    return matrix


@pytest.mark.parametrize("height", [0.0, -3.25])
def test_level_walks_get_level_ground_at_the_height_of_the_soles(height):
    motion = walked(origin=(1.0, 2.0, height))
    plan = plan_ground([motion])
    assert isinstance(plan.terrain, FlatTerrain)
    assert plan.terrain.height == pytest.approx(height, abs=0.02)  # its toes bend a little below the ground
    paths = np.concatenate([sole.landmark_positions()[..., :2].reshape(-1, 2) for sole in motion.soles])
    assert (plan.lower < paths.min(axis=0) - 0.5).all()
    assert (plan.upper > paths.max(axis=0) + 0.5).all()


@pytest.mark.parametrize("degrees", [-12.0, 6.0, 20.0])
@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_a_climb_gets_a_ground_that_climbs_with_it_and_no_step_is_lost(degrees, heading):
    angle = np.radians(degrees)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]]
    level = walked()
    motion = moved(level, turn @ climbing(angle))
    plan = plan_ground([motion])
    along = np.array([np.cos(heading), np.sin(heading)])
    assert plan.terrain.slope == pytest.approx(np.tan(angle) * along, abs=0.01)

    def steps(motion, terrain):
        return (np.diff(detect_contacts(motion, terrain).touching.astype(int), axis=0) > 0).sum(axis=0)

    np.testing.assert_array_equal(steps(motion, plan.terrain), steps(level, FlatTerrain()))


def test_feet_that_float_unevenly_do_not_tilt_the_ground():
    motion = walked()
    raised = [sole.transforms.copy() for sole in motion.soles]
    raised[0][..., 2, 3] += 0.02
    motion = replace(
        motion, soles=tuple(replace(sole, transforms=poses) for sole, poses in zip(motion.soles, raised, strict=True))
    )
    assert isinstance(plan_ground([motion]).terrain, FlatTerrain)


@pytest.mark.parametrize("floats", [-0.02, 0.02])
def test_where_the_skin_shows_the_ground_it_lies_there_not_where_soles_that_are_off_the_skin_stand(floats):
    motion = walked()
    soles = [
        replace(
            sole,
            transforms=moved_up(sole.transforms, floats),
            bears=sole.landmark_positions()[..., 2].min(axis=1) < 0.03,
        )
        for sole in motion.soles
    ]
    middle = np.mean([sole.transforms[:, 0, :3, 3] for sole in motion.soles], axis=0)
    hips = middle + np.array([0.0, 0.0, 0.9])
    plan = plan_ground([replace(motion, soles=tuple(soles), joints={"hips": hips}, ground_level=0.0)])
    assert plan.terrain.height == pytest.approx(0.0, abs=1e-9)


def test_a_run_on_the_spot_whose_feet_pause_in_the_air_gets_level_ground():
    """Each foot is slowest where it turns, far in front and less high behind."""
    turn = 3.0 * np.arange(120) / 30.0
    soles = []
    for side in (1, -1):
        phase = (turn + np.pi / 2 * (1 - side)) % (2 * np.pi)
        ahead, wave = np.cos(phase), np.sin(phase)
        height = 0.1125 + 0.075 * ahead - 0.05 * wave + 0.0625 * np.cos(2 * phase)
        sole = flat_sole(np.stack([0.5 * ahead, 0 * turn + 0.1 * side, height], axis=1))
        soles.append(replace(sole, bears=wave > 0.9))
    motion = character(soles, hips=(0.0, 0.0, 0.9), rate=30.0)
    assert not _slope([motion]).any()
    assert _slope([replace(motion, soles=tuple(replace(sole, bears=None) for sole in soles))]).any()  # as they rest


@pytest.mark.parametrize(("cell_size", "rate"), [(0.005, 24.0), (0.01, 30.0), (0.03, 60.0)])
def test_all_that_a_bake_presses_lies_within_reach_of_the_footfalls(cell_size, rate):
    motion = walked(frame_rate=rate, heading=0.7)
    plan = plan_ground([motion])
    material = GroundMaterial(0.4e6, 0.3, 0.1, 0.3, 0.04, 0.005)
    ground, _ = pressed(
        estimate_loads(motion, plan.terrain, force_model="IMPULSE", material=material),
        material,
        cell_size,
        plan.terrain,
    )
    blocks, level = plan.fine_blocks(cell_size, material.rim_reach)
    changed = np.concatenate(
        [np.argwhere(tile.any(axis=0))[:, ::-1] + np.array(place) * 32 for place, tile in ground.tiles.items()]
    )
    inside = {tuple(block) for block in blocks.tolist()}
    covered = np.array([tuple(cell) in inside for cell in (changed >> level).tolist()])
    assert len(changed) > 100
    assert covered.mean() > 0.995
    assert len(blocks) * 4**level < 4 * len(changed)
