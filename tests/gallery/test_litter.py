"""Litter on a ground: it lies still where no foot was, and is bent, buried and soiled in a print."""

import numpy as np
import pytest

SPACING, DEEP = 0.05, 0.03  # m
VALUES = {"smallest": 0.02, "largest": 0.02, "lean": 0.1, "bend": 1.4, "bury": 0.5, "seed": 7}


@pytest.fixture
def litter(scene):
    from gallery import litter

    return litter


def strewn(litter, compression):
    """Matrices (N, 4, 4) of pieces on a square metre that is pressed by so much beyond x = 0."""
    import bpy

    from sample_scenes import terrain
    from softground_addon.blender.playback.own_data import COMPRESSION, REST

    bpy.ops.wm.read_factory_settings(use_empty=True)
    places = terrain.spaced(-0.5, 0.5, SPACING)
    painted = {COMPRESSION: lambda x, _y: compression * (x > 0), "pieces": lambda x, _y: 2000.0 * (np.abs(x) < 0.3)}
    ground = terrain.add_terrain("Ground", places, places, terrain.flat, "soil", bpy.context.scene.collection, painted)
    positions = np.empty(3 * len(ground.data.vertices), np.float32)
    ground.data.attributes["position"].data.foreach_get("vector", positions)
    ground.data.attributes.new(REST, "FLOAT_VECTOR", "POINT").data.foreach_set("vector", positions)
    pressed = positions.reshape(-1, 3)
    pressed[:, 2] -= compression * (pressed[:, 0] > 0)
    ground.data.attributes["position"].data.foreach_set("vector", pressed.ravel())
    litter.strew(ground, litter.twigs((0.1, 0.1, 0.1), (0.2, 0.2, 0.2)), "pieces", **VALUES)
    graph = bpy.context.evaluated_depsgraph_get()
    matrices = [np.array(instance.matrix_world) for instance in graph.object_instances if instance.is_instance]
    return np.array(matrices)


def leans(matrices):
    """Angles from upright (N,) [rad]."""
    up = matrices[:, 2, 2] / np.linalg.norm(matrices[:, :3, 2], axis=1)
    return np.arccos(up.clip(-1, 1))


def test_pieces_keep_their_places_and_follow_the_ground(litter):
    before, after = strewn(litter, 0.0), strewn(litter, DEEP)
    assert 900 < len(before) < 1500  # 2000 on the 0.6 m² where they are painted, which fades over a cell
    assert np.abs(before[:, 0, 3]).max() < 0.3 + SPACING
    np.testing.assert_allclose(after[:, :2, 3], before[:, :2, 3], atol=1e-6)
    beside = before[:, 0, 3] < -SPACING
    np.testing.assert_allclose(after[beside], before[beside], atol=1e-6)


def test_a_foot_buries_and_bends_them(litter):
    before, after = strewn(litter, 0.0), strewn(litter, DEEP)
    inside = before[:, 0, 3] > SPACING
    sunk = before[inside, 2, 3] - after[inside, 2, 3] - DEEP
    assert sunk.min() >= -1e-6
    assert sunk.max() <= VALUES["bury"] * VALUES["largest"] + 1e-6
    assert sunk.max() > 0.3 * VALUES["largest"]
    assert leans(before).max() <= VALUES["lean"] + 1e-5
    np.testing.assert_allclose(leans(after[inside]), VALUES["bend"], atol=1e-5)


def test_its_material_reads_how_far_a_foot_has_pressed_a_piece(litter):
    look = litter.material("piece", (0.1, 0.1, 0.1), (0.2, 0.2, 0.2), 0.5)
    (node,) = (node for node in look.node_tree.nodes if node.type == "ATTRIBUTE")
    assert (node.attribute_type, node.attribute_name) == ("INSTANCER", litter.PRESSED)


def test_sizes_keep_within_their_bounds_and_small_ones_are_more(litter):
    import bpy

    from sample_scenes import terrain

    places = terrain.spaced(-0.5, 0.5, SPACING)
    ground = terrain.add_terrain("Ground", places, places, terrain.flat, "soil", bpy.context.scene.collection)
    pieces = litter.stones((0.1, 0.1, 0.1), (0.2, 0.2, 0.2))
    litter.strew(ground, pieces, 4000.0, smallest=0.01, largest=0.08, law=2.0)
    graph = bpy.context.evaluated_depsgraph_get()
    sizes = np.array(
        [instance.matrix_world.to_scale().x for instance in graph.object_instances if instance.is_instance]
    )
    assert sizes.min() >= 0.01 - 1e-6
    assert sizes.max() <= 0.08 + 1e-6
    share = (sizes > 0.02).mean()
    assert share == pytest.approx((0.25 - 1 / 64) / (1 - 1 / 64), abs=0.03)  # N(>s) ~ s^-2 between the bounds
