"""What the overlay draws, as far as it can be known without a window."""

import gc
import weakref

import bpy
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from softground_addon.blender import session
from softground_addon.blender.ground import baked_ground, baked_steps, ground_mesh
from softground_addon.blender.live import live
from softground_addon.blender.reading import analysis
from softground_addon.blender.settings import snapshot
from softground_addon.blender.viewport import overlay, overlay_shapes
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.record import record
from tests.blender.shots import walker
from tests.core.walkers import pressed, walk

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)


def pairs(cells):
    return {tuple(cell) for cell in cells.tolist()}


@pytest.mark.parametrize("reach", [0.3, 1.0, 2.0, 3.7])
def test_the_rim_is_all_that_is_within_its_reach_of_the_contact(reach):
    free = np.ones((30, 40), dtype=bool)
    free[10:14, 8:20] = free[12:25, 25:29] = False
    soles = [np.argwhere(~free)[:, ::-1] - 7, np.empty((0, 2), np.int64)]
    contact, rim = overlay_shapes.contact_and_rim(soles, reach)
    assert pairs(contact) == pairs(soles[0])
    around = free & (distance_transform_edt(free) <= max(reach, 1.0))
    assert pairs(rim) == pairs(np.argwhere(around)[:, ::-1] - 7)


def test_no_cell_is_in_contact_with_one_sole_and_in_the_rim_of_another():
    left, right = np.array([[0, 0]]), np.array([[1, 0]])
    contact, rim = overlay_shapes.contact_and_rim([left, right], 1.0)
    assert pairs(contact) == {(0, 0), (1, 0)}
    assert pairs(rim) == {(-1, 0), (2, 0), (0, 1), (0, -1), (1, 1), (1, -1)}


@pytest.mark.slow
def test_live_mode_shows_the_cells_of_each_sole_that_touches_as_the_bake_does(scene):
    walker(scene, frames=60)
    bpy.ops.softground.add_character()
    bpy.ops.softground.live()
    touching = analysis.known(snapshot(scene)).loads[0].contacts.touching
    frames = analysis.known(snapshot(scene)).loads[0].motion.frames
    shown = {}
    for frame in range(10, 50):
        scene.frame_set(frame)
        shown[frame] = overlay._cells(scene)
        soles = [
            cells
            for window, mask in live.in_contact(scene.session_uid)[0]
            if len(cells := overlay_shapes.marked(window, mask))
        ]
        since = (frames > frame - 1 + 1e-6) & (frames < frame + 1e-6)
        assert len(soles) == touching[since].any(axis=0).sum()  # those that rest or have just left, too
    bpy.ops.softground.live(keep=True)
    for frame, (contact, rim, size) in shown.items():
        scene.frame_set(frame)
        baked, baked_rim, baked_size = overlay._cells(scene)
        assert size == baked_size
        assert pairs(contact) <= pairs(baked)
        assert len(contact) > 0.8 * len(baked)
        assert len(rim)
        assert len(baked_rim)


@pytest.mark.slow
def test_the_cells_of_another_bake_are_shown_once_there_is_one(scene):
    walker(scene, frames=40)
    bpy.ops.softground.add_character()
    bpy.ops.softground.bake()
    ground = scene.softground.ground
    before = baked_steps.bake_on(ground)
    assert baked_steps.bake_on(ground).footprints is before.footprints
    scene.softground.material.rim_reach *= 2
    bpy.ops.softground.bake()
    assert baked_steps.bake_on(ground).rim_reach == pytest.approx(2 * before.rim_reach)
    ground_mesh.mesh_of(ground)[ground_mesh.RECORD] = "nonsense"
    assert baked_steps.bake_on(ground) is baked_steps.NOTHING


def test_the_directory_of_a_record_lies_in_its_tail(scene):
    walker(scene, frames=40)
    bpy.ops.softground.add_character()
    bpy.ops.softground.bake()
    stored = bytes(baked_ground.stored_record(scene.softground.ground))
    assert stored.find(b"PK\x01\x02") > len(stored) - record.TAIL  # the first entry of the directory


def test_early_prints_cover_their_cells_without_gaps_and_lie_above_the_ground():
    _, (step, *_) = pressed(walk(steps=3), SNOW, 0.01)
    corners = overlay.corners_of(step, session.Pressing(0, FlatTerrain(0.5), None), bpy.context.scene)
    first, second, third = corners.reshape(-1, 3, 3).transpose(1, 0, 2)
    areas = np.linalg.norm(np.cross(second - first, third - first), axis=1) / 2
    assert areas.sum() == pytest.approx(len(step.contact_cells) * step.cell_size**2)
    assert corners[:, 2].min() >= 0.5 + step.cell_size


@pytest.mark.slow
def test_a_shot_that_is_forgotten_is_not_kept_by_what_was_drawn_of_it(short_walk):
    analysis.read(short_walk)
    shown = overlay._footfalls(analysis.known(snapshot(short_walk)))
    assert overlay._footfalls(analysis.known(snapshot(short_walk))) is shown, "it is worked out once"
    known = weakref.ref(analysis.known(snapshot(short_walk)))
    analysis.forget()
    gc.collect()
    assert known() is None
