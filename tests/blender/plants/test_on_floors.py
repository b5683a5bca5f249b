"""Give Way on hard floors, which take no prints: pebbles roll aside there, and plants bend."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import ground_slots
from softground_addon.blender.ground import baked_ground
from softground_addon.core.record import record
from tests.blender import shots
from tests.blender.ground.test_hard_ground import box
from tests.blender.grounds import plane
from tests.blender.plants.test_give_way import angles, blades, give_way, hair, scattered

EDGE = -0.9
"""Beyond which the floor begins along the walk, which goes toward -y [m]."""


def toward_a_floor(scene):
    shots.walker(scene, frames=72)
    bpy.ops.softground.add_character()
    options = scene.softground
    ground = options.ground = plane(scene, size=9.0, vertices=200)
    options.cell_size, options.detail = 0.02, "NEVER"
    return ground


def with_a_region(scene):
    ground = toward_a_floor(scene)
    for name, preset in (("Soft", ""), ("Stone", ground_slots.HARD)):
        material = bpy.data.materials.new(name)
        material.softground_preset = preset
        ground.data.materials.append(material)
    for face in ground.data.polygons:
        face.material_index = int(face.center.y < EDGE)
    bpy.context.view_layer.update()


def with_a_slab(scene):
    toward_a_floor(scene)
    slab = box(scene, "Slab", 0.002, y=(-4.0, EDGE), bottom=-0.1)
    scene.softground.hard_grounds.add().object = slab
    bpy.context.view_layer.update()


def on_the_floor(count=1500):
    chance = np.random.default_rng(1)
    return np.column_stack([chance.uniform(-0.3, 0.3, count), chance.uniform(-2.2, EDGE - 0.2, count), np.zeros(count)])


def under_soles(place):
    """Places (N, 3) within 2 cm of a cell that a sole has trodden on, of those on the floor."""
    near = np.zeros(len(place), bool)
    for step in baked_ground.record_of(bpy.context.scene.softground.ground).on_floors:
        x, y = (values.ravel()[step.contact_cells] for values in np.meshgrid(*step.window.centres(step.cell_size)))
        near |= np.hypot(*(place[:, None, :2] - np.stack([x, y], axis=1)).transpose(2, 0, 1)).min(axis=1) < 0.01
    return near


@pytest.mark.slow
@pytest.mark.parametrize("floor", [with_a_region, with_a_slab])
def test_pebbles_on_a_hard_floor_roll_aside_and_blades_bend_under_the_soles(opened_as, floor):
    scene = opened_as(floor)
    place = on_the_floor()
    pebbles, moss = scattered(place), hair(place)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    give_way(pebbles, kind="PEBBLES")
    give_way(moss)
    scene.frame_set(1)
    assert np.ptp(blades(pebbles)[0] - place, axis=0).max() < 1e-6
    scene.frame_set(72)
    trodden = under_soles(place)
    moved = blades(pebbles)[0] - place
    assert trodden.sum() > 30
    assert (np.linalg.norm(moved[trodden], axis=1) > 1e-3).mean() > 0.9
    assert np.linalg.norm(moved, axis=1).max() < 0.13
    np.testing.assert_allclose(moved[:, 2], 0.0, atol=1e-6)
    assert np.median(angles(moss)[trodden]) > 40.0
    assert bpy.ops.softground.bake() == {"FINISHED"}  # which writes the table
    scene.frame_set(72)
    np.testing.assert_allclose(blades(pebbles)[0] - place, moved, atol=1e-6)


@pytest.mark.slow
def test_the_record_has_steps_on_floors_without_heights_and_stores_them(opened_as):
    scene = opened_as(with_a_region)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    baked = baked_ground.record_of(scene.softground.ground)
    assert len(baked.on_floors) > 2
    assert all(step.max_depth_m == 0.0 and step.tile(step.rim).any() == 0 for step in baked.on_floors)
    assert all(step.position[1] < EDGE + 0.2 for step in baked.on_floors)
    again = record.load(record.dump(baked))
    assert record.dump(again) == record.dump(baked)
    assert [step.start_frame for step in again.on_floors] == [step.start_frame for step in baked.on_floors]


def over_a_deck(scene):
    toward_a_floor(scene)
    valley = plane(scene, 9.0, 200, lambda x, y: np.where(y < EDGE, -0.8, 0.0))
    scene.softground.ground = valley
    deck = box(scene, "Deck", 0.0, y=(-4.0, EDGE), bottom=-0.05)
    scene.softground.hard_grounds.add().object = deck
    bpy.context.view_layer.update()


@pytest.mark.slow
def test_who_walks_over_a_deck_bends_nothing_in_the_valley_below_it(opened_as):
    scene = opened_as(over_a_deck)
    grass = hair(on_the_floor(300) - (0.0, 0.0, 0.8))
    assert bpy.ops.softground.bake() == {"FINISHED"}
    give_way(grass)
    scene.frame_set(60)
    assert angles(grass).max() < 1e-3
    assert not baked_ground.record_of(scene.softground.ground).on_floors


@pytest.mark.slow
def test_what_live_mode_keeps_has_the_steps_on_floors_as_well(opened_as):
    scene = opened_as(with_a_slab)
    place = on_the_floor(300)
    pebbles = scattered(place)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    give_way(pebbles, kind="PEBBLES")
    scene.frame_set(72)
    baked = blades(pebbles)[0]
    assert np.linalg.norm(baked - place, axis=1).max() > 0.01
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    scene.frame_set(1)
    assert bpy.ops.softground.live() == {"FINISHED"}
    scene.frame_set(72)
    assert bpy.ops.softground.live(keep=True) == {"FINISHED"}
    scene.frame_set(72)
    np.testing.assert_allclose(blades(pebbles)[0], baked, atol=1e-5)
