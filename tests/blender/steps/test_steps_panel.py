"""Single steps of a bake on the ground: chosen, muted, changed and reset by operators, and listed in the panel."""

import inspect
import itertools
import time
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from softground_addon.blender import jobs, session
from softground_addon.blender.baking import bake_report, step_edits, step_soles
from softground_addon.blender.ground import baked_ground, baked_steps, ground_mesh
from softground_addon.blender.panels import steps_panel
from softground_addon.blender.playback.display_key import DISPLAY_KEY
from softground_addon.blender.state import state
from softground_addon.blender.viewport import step_dragging, step_editing
from softground_addon.blender.viewport.step_preview import StepPreview
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit
from tests.blender import fingerprints, shots
from tests.blender.grounds import heights, rest
from tests.blender.steps.test_edited_steps import plate


def bake_again(scene):
    """A walk, baked once more on the ground that the first bake has made."""
    shots.walker(scene, frames=60)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    for _ in range(2):
        bpy.ops.softground.bake()


@pytest.fixture
def baked(opened_as):
    return opened_as(bake_again)


def stored(scene):
    return bytes(baked_ground.stored_record(scene.softground.ground))


def under(scene, place):
    """How far the finished ground is pressed around a place, at most [m]."""
    ground = scene.softground.ground
    near = np.linalg.norm(rest(ground)[:, :2] - np.asarray(place)[:2], axis=1) < 0.06
    return float((rest(ground)[near, 2] - heights(ground, DISPLAY_KEY)[near, 2]).max())


def test_a_step_is_chosen_muted_changed_and_reset(baked):
    before, shown = stored(baked), heights(baked.softground.ground, DISPLAY_KEY)
    step = baked_steps.of(baked.softground.ground)[2]
    assert bpy.ops.softground.choose_step(step=step.name) == {"FINISHED"}
    assert baked.frame_current == step.there_from >= step.baked.end_frame  # where its print is there
    assert session.current().step == step.name
    depth = under(baked, step.baked.position)
    assert depth > 0.01
    bpy.ops.softground.mute_step()
    assert baked_steps.chosen(baked.softground.ground)[0].footprint is None
    assert under(baked, step.baked.position) < 2e-3
    bpy.ops.softground.mute_step()
    assert stored(baked) == before
    bpy.ops.softground.change_step(strength=0.5, move=(0.0, 0.4), turn=0.5)
    target = step.baked.position + np.array([0.0, 0.4, 0.0])
    assert under(baked, step.baked.position) < 2e-3
    assert under(baked, target) == pytest.approx(depth / 2, rel=0.3)
    assert not bake_report.stale_reasons(baked)
    assert baked_ground.edits_of(baked.softground.ground)[step.name].move_m == (0.0, 0.4)
    bpy.ops.softground.reset_step()
    assert stored(baked) == before
    np.testing.assert_array_equal(heights(baked.softground.ground, DISPLAY_KEY), shown)
    assert not bake_report.stale_reasons(baked)


def test_a_step_is_copied_changed_kept_by_a_bake_and_deleted(baked):
    before, shown = stored(baked), heights(baked.softground.ground, DISPLAY_KEY)
    step = baked_steps.of(baked.softground.ground)[2]
    bpy.ops.softground.choose_step(step=step.name)
    bpy.ops.softground.duplicate_step()
    copy = baked_steps.chosen(baked.softground.ground)[0]
    assert (copy.name, copy.is_copy, copy.number) == (
        f"{step.name}+1",
        True,
        len(baked_steps.of(baked.softground.ground)),
    )
    ahead = copy.footprint.position - step.baked.position
    assert 0.2 < np.linalg.norm(ahead[:2]) < 0.5
    assert ahead[1] == pytest.approx(-np.linalg.norm(ahead[:2]), abs=0.1)  # they walk along -y
    assert under(baked, copy.footprint.position) == pytest.approx(under(baked, step.baked.position), rel=0.3)
    bpy.ops.softground.change_step(move=(0.5, 0.0), scale=1.4, shift=5)
    changed = baked_steps.chosen(baked.softground.ground)[0]
    assert changed.frames == (step.frames[0] + 5, step.frames[1] + 5)
    assert changed.footprint.area_m2 == pytest.approx(1.4**2 * step.baked.area_m2, rel=0.05)
    edited, ground = stored(baked), baked.softground.ground
    bpy.ops.softground.bake()
    assert record.dump(record.load(stored(baked))) == record.dump(record.load(edited))
    assert changed.name in {row["step"] for row in baked_ground.events_of(ground)}
    bpy.ops.softground.reset_step(step=changed.name)  # which deletes it
    assert stored(baked) == before
    np.testing.assert_array_equal(heights(ground, DISPLAY_KEY), shown)


def test_a_step_is_added_at_the_cursor_from_the_current_frame_on(baked):
    before = stored(baked)
    step = baked_steps.of(baked.softground.ground)[1]
    bpy.ops.softground.choose_step(step=step.name)
    baked.cursor.location = (0.35, -0.8, 0.3)
    baked.frame_set(33)
    bpy.ops.softground.add_step()
    added = baked_steps.chosen(baked.softground.ground)[0]
    assert added.frames[0] == 33
    np.testing.assert_allclose(added.footprint.position[:2], (0.35, -0.8), atol=0.02)
    assert under(baked, (0.35, -0.8)) > 0.01
    baked.cursor.location = (300.0, 0.0, 0.0)
    with pytest.raises(RuntimeError, match="more than 100 m from step"):
        bpy.ops.softground.add_step()
    bpy.ops.softground.reset_steps()
    assert stored(baked) == before


def test_several_steps_are_chosen_and_changed_together_in_what_was_changed(baked):
    before = stored(baked)
    first, two, three = baked_steps.of(baked.softground.ground)[:3]
    bpy.ops.softground.change_step(step=first.name, strength=0.5)
    bpy.ops.softground.choose_step(step=first.name)
    for step in (two, three, two):  # the last one no more
        bpy.ops.softground.choose_step(step=step.name, extend=True)
    assert [step.name for step in baked_steps.chosen(baked.softground.ground)] == [three.name, first.name]
    bpy.ops.softground.change_step(scale=1.2)
    edits = baked_ground.edits_of(baked.softground.ground)
    assert edits == {first.name: StepEdit(strength=0.5, scale=1.2), three.name: StepEdit(scale=1.2)}
    bpy.ops.softground.mute_step()
    assert [step.footprint is None for step in baked_steps.of(baked.softground.ground)[:3]] == [True, False, True]
    bpy.ops.softground.reset_step()
    assert stored(baked) == before


def choose(*steps):
    """Select steps one after the other, as clicks in the list with Shift held do."""
    session.choose_steps("")
    for step in steps:
        assert bpy.ops.softground.choose_step(step=step.name, extend=True) == {"FINISHED"}


@pytest.mark.parametrize("copy_is_last", [True, False])
def test_a_copy_that_is_deleted_leaves_the_others_selected(baked, copy_is_last):
    step = baked_steps.of(baked.softground.ground)[2]
    bpy.ops.softground.duplicate_step(step=step.name)
    copy = baked_steps.chosen(baked.softground.ground)[0]
    choose(*((step, copy) if copy_is_last else (copy, step)))
    bpy.ops.softground.reset_step()
    assert (
        [each.name for each in baked_steps.chosen(baked.softground.ground)]
        == [baked_steps.chosen(baked.softground.ground)[0].name]
        == [step.name]
    )
    bpy.ops.softground.mute_step()
    assert baked_ground.edits_of(baked.softground.ground) == {step.name: StepEdit(mute=True)}


def test_nothing_selected_is_said_plainly(baked):
    session.choose_steps("")
    for operator in ("mute_step", "reset_step", "duplicate_step", "add_step"):
        with pytest.raises(RuntimeError, match="Select a step first"):
            getattr(bpy.ops.softground, operator)()


def test_the_timeline_stays_while_a_step_is_taken_out_of_the_selection(baked):
    first, two = baked_steps.of(baked.softground.ground)[:2]
    choose(first, two)
    baked.frame_set(22)
    for step, remaining in ((two, [first.name]), (first, [])):
        assert bpy.ops.softground.choose_step(step=step.name, extend=True) == {"FINISHED"}
        assert ([step.name for step in baked_steps.chosen(baked.softground.ground)], baked.frame_current) == (
            remaining,
            22,
        )
    choose(first)
    assert baked.frame_current == first.there_from
    assert bpy.ops.softground.choose_step(step="gone", extend=True) == {"CANCELLED"}
    assert session.chosen_steps() == (first.name,)


def test_an_edit_gives_the_bytes_of_a_bake_with_the_same_edits(baked):
    step = baked_steps.of(baked.softground.ground)[1]
    bpy.ops.softground.change_step(step=step.name, strength=1.3, move=(0.05, 0.07), turn=0.2)
    edited, ground = stored(baked), baked.softground.ground
    shown = heights(ground, DISPLAY_KEY)
    bpy.ops.softground.bake()  # which keeps the edits
    again, once = record.load(stored(baked)), record.load(edited)
    assert record.dump(again) == record.dump(once)
    np.testing.assert_array_equal(heights(baked.softground.ground, DISPLAY_KEY), shown)
    bpy.ops.softground.reset_steps()
    assert not record.load(stored(baked)).edits


@pytest.mark.slow
def test_an_edit_keeps_the_look_that_the_bake_was_made_with(baked):
    options = baked.softground
    options.relief, options.cell_size = "FINE", 0.01
    bpy.ops.softground.bake()
    step = baked_steps.of(baked.softground.ground)[2]
    bpy.ops.softground.mute_step(step=step.name)
    muted = heights(options.ground, DISPLAY_KEY)
    bpy.ops.softground.mute_step(step=step.name)
    options.relief_strength, options.tread = 2.0, 0.0
    bpy.ops.softground.mute_step(step=step.name)
    np.testing.assert_array_equal(heights(options.ground, DISPLAY_KEY), muted)
    assert bake_report.stale_reasons(baked)


def test_a_preview_shows_the_edited_ground_and_leaves_no_trace(baked):
    ground = baked.softground.ground
    bpy.context.view_layer.update()
    before = fingerprints.of_file()
    step = baked_steps.of(baked.softground.ground)[2]
    edits = {step.name: StepEdit(move_m=(0.0, 0.3))}
    preview = StepPreview(ground, jobs.run(step_edits.reading(baked)))
    preview.show({step.name: StepEdit(move_m=(0.1, 0.2))})
    preview.show(edits)
    shown = heights(ground, DISPLAY_KEY)
    preview.end()
    assert fingerprints.of_file() == before
    jobs.run(step_edits.editing(jobs.run(step_edits.reading(baked)), edits))
    np.testing.assert_allclose(heights(ground, DISPLAY_KEY), shown, atol=1e-5)


def test_a_step_takes_the_sole_of_another_foot(baked):
    step = baked_steps.of(baked.softground.ground)[2]
    ours = step.name.partition("@")[0]
    other = ours[:-1] + "LR"[step.side == "L"]
    before = step.outline()
    with pytest.raises(RuntimeError, match=f"no sole 'Fox/paw.L': choose one of .*{ours}"):
        bpy.ops.softground.change_step(step=step.name, sole="Fox/paw.L")
    bpy.ops.softground.change_step(step=step.name, sole=other)
    changed = baked_steps.of(baked.softground.ground)[2]
    assert baked_ground.edits_of(baked.softground.ground) == {step.name: StepEdit(sole=other)}
    np.testing.assert_allclose(changed.outline().mean(axis=0), before.mean(axis=0), atol=0.02)
    assert np.abs(changed.outline()[:, None] - before).sum(axis=-1).min(axis=1).max() > 2e-3
    bpy.ops.softground.reset_step(step=step.name)
    np.testing.assert_array_equal(baked_steps.of(baked.softground.ground)[2].outline(), before)


@pytest.mark.slow
def test_a_step_takes_the_sole_of_a_mesh(baked):
    before, shoe = stored(baked), plate(baked)
    first, two = baked_steps.of(baked.softground.ground)[1:3]
    bpy.ops.softground.change_step(step=first.name, sole="Shoe")
    shod = baked_steps.of(baked.softground.ground)[1]
    assert np.ptp(shod.outline()[:, :2], axis=0) == pytest.approx((0.1, 0.4), abs=0.05)  # it walks along -y
    assert shod.footprint.area_m2 == pytest.approx(0.1 * 0.4, rel=0.15)
    assert not bake_report.stale_reasons(baked)
    shoe.location.x += 1.0
    bpy.context.view_layer.update()
    assert not bake_report.stale_reasons(baked)
    shoe.scale = (1.0, 0.5, 1.0)
    bpy.context.view_layer.update()
    assert bake_report.stale_reasons(baked) == ("The mesh of 'Shoe', whose sole presses steps, has changed",)
    bpy.ops.softground.mute_step(step=two.name)
    assert baked_steps.of(baked.softground.ground)[1].footprint.area_m2 == shod.footprint.area_m2
    assert bake_report.stale_reasons(baked)
    bpy.ops.softground.change_step(step=two.name, sole="Shoe")  # as it is now, also for the other step
    assert baked_steps.of(baked.softground.ground)[1].footprint.area_m2 == pytest.approx(0.1 * 0.2, rel=0.25)
    assert not bake_report.stale_reasons(baked)
    shoe.hide_set(True)
    shoe.hide_viewport = True
    edited = stored(baked)
    bpy.ops.softground.bake()
    assert record.dump(record.load(stored(baked))) == record.dump(record.load(edited))
    bpy.ops.softground.reset_steps()
    assert stored(baked) == before
    assert not bake_report.stale_reasons(baked)


def test_a_step_is_added_in_the_sole_of_a_mesh(baked):
    plate(baked)
    step = baked_steps.of(baked.softground.ground)[1]
    bpy.ops.softground.choose_step(step=step.name)
    baked.cursor.location = (0.35, -0.8, 0.3)
    bpy.ops.softground.add_step(sole="Shoe")
    added = baked_steps.chosen(baked.softground.ground)[0]
    assert (added.is_copy, added.edit.sole) == (True, "Shoe")
    assert added.footprint.area_m2 == pytest.approx(0.1 * 0.4, rel=0.15)
    np.testing.assert_allclose(added.footprint.position[:2], (0.35, -0.8), atol=0.03)


def test_a_mesh_points_its_toes_along_y_and_its_left_along_x(baked):
    shoe = plate(baked)
    shoe.data.clear_geometry()
    corners = [(-0.05, 0.2), (0.05, 0.2), (0.05, -0.2)]  # a heel 10 cm wide, and the tip of the toes at the left
    shoe.data.from_pydata([(x, y, z) for z in (0.0, 0.1) for x, y in corners], [], [(0, 1, 2), (3, 4, 5)])
    outline = step_soles.read(shoe, baked.softground.ground, 1.0).pressing.sole.outline
    toes = outline[outline[:, 0] > outline[:, 0].max() - 0.02]
    heel = outline[outline[:, 0] < outline[:, 0].min() + 0.02]
    assert np.ptp(toes[:, 1]) < 0.03
    assert np.ptp(heel[:, 1]) > 0.08
    assert toes[:, 1].mean() > heel[:, 1].mean() + 0.03


def test_soles_are_offered_by_name(baked):
    plate(baked)
    offered = step_editing._soles(None, bpy.context, "")
    assert offered[-2:] == ["Shoe", "Walker Figure"]
    assert baked.softground.ground.name not in offered
    assert set(baked_steps.of(baked.softground.ground)[0].feet) < set(offered)
    assert step_editing._soles(None, bpy.context, "shO") == ["Shoe"]
    with pytest.raises(RuntimeError, match="is the ground and cannot print on itself"):
        bpy.ops.softground.change_step(
            step=baked_steps.of(baked.softground.ground)[1].name, sole=baked.softground.ground.name
        )


def test_the_panel_lists_the_steps_around_the_chosen_one(baked):
    steps = baked_steps.of(baked.softground.ground)
    assert [step.number for step in steps] == list(range(1, len(steps) + 1))
    assert {step.side for step in steps} == {"L", "R"}
    bpy.ops.softground.choose_step(step=steps[-1].name)
    bpy.ops.softground.mute_step()
    layout = MagicMock()
    panel = MagicMock(fields=lambda: layout)
    steps_panel.SOFTGROUND_PT_steps.draw(panel, bpy.context)
    rows = layout.box().column().row().operator.call_args_list
    assert len(rows) == min(len(steps), steps_panel.SHOWN)
    assert "muted" in rows[-1].kwargs["text"]
    assert f"{steps[-1].baked.peak_force_n:,.0f} N" in rows[-1].kwargs["text"]


def reset_button(scene):
    """True if the panel's button that resets the selected steps is enabled, and its icon."""
    rows, layout = [], MagicMock()
    layout.row.side_effect = lambda **_: rows.append(MagicMock()) or rows[-1]
    steps_panel.SOFTGROUND_PT_steps.draw(MagicMock(fields=lambda: layout), SimpleNamespace(scene=scene))
    part = rows[1].row()  # below Previous and Next
    return part.enabled, part.operator.call_args.kwargs["icon"]


def test_reset_is_enabled_while_any_selected_step_is_edited(baked):
    first, two = baked_steps.of(baked.softground.ground)[:2]
    choose(first, two)
    assert not reset_button(baked)[0]
    bpy.ops.softground.mute_step(step=first.name)
    assert reset_button(baked) == (True, "LOOP_BACK")
    bpy.ops.softground.duplicate_step(step=two.name)
    copy = baked_steps.chosen(baked.softground.ground)[0]
    choose(copy, two)
    assert reset_button(baked) == (True, "TRASH")


class Drag:
    """Drag in Viewport, but for what Blender makes of it, in a view from above where a pixel is a centimetre."""

    HALF = 1000
    """Half of the viewport's width and height [px]."""
    vars().update(filter(lambda item: inspect.isfunction(item[1]), vars(step_dragging.SOFTGROUND_OT_drag_step).items()))

    def __init__(self, scene):
        self._drag, self.report, side = None, MagicMock(), 2 * self.HALF
        state.picking = True
        view = SimpleNamespace(
            is_perspective=False,
            view_perspective="ORTHO",
            perspective_matrix=Matrix.Diagonal((100.0 / self.HALF, 100.0 / self.HALF, -0.1, 1.0)),
            view_matrix=Matrix.Translation((0.0, 0.0, -5.0)),
        )
        regions = [
            SimpleNamespace(type=kind, x=x, y=0, width=width, height=side)
            for kind, x, width in (("WINDOW", 0, side), ("UI", side - 200, 200))
        ]
        area = SimpleNamespace(regions=regions, spaces=SimpleNamespace(active=SimpleNamespace(region_3d=view)))
        self.context = SimpleNamespace(scene=scene, area=area, workspace=MagicMock())

    def mouse(self, place, kind="MOUSEMOVE", value="NOTHING", shift=False):
        """The mouse at a place on the ground, (2,) [m]."""
        x, y = (np.asarray(place)[:2] * 100 + self.HALF).astype(int).tolist()
        return self.modal(self.context, SimpleNamespace(type=kind, value=value, mouse_x=x, mouse_y=y, shift=shift))

    def press(self, place, **keys):
        self.mouse(place, "LEFTMOUSE", "PRESS", **keys)

    def release(self, place, **keys):
        return self.mouse(place, "LEFTMOUSE", "RELEASE", **keys)


@pytest.fixture
def drag(baked):
    yield (hand := Drag(baked))
    hand._leave(hand.context, set())
    assert not hand.report.called


@pytest.mark.parametrize(("seconds", "shown"), [(0.01, 5), (1.0, 1)])
@pytest.mark.parametrize("count", [1, 3])
def test_many_steps_are_pressed_again_when_they_are_dropped(baked, drag, monkeypatch, seconds, shown, count):
    monkeypatch.setattr(time, "thread_time", itertools.count(0.0, seconds).__next__)
    presses, show = [], StepPreview.show
    monkeypatch.setattr(StepPreview, "show", lambda *arguments: presses.append(show(*arguments)))
    steps = baked_steps.of(baked.softground.ground)[:count]
    choose(*steps)
    place = steps[0].outline().mean(axis=0)
    drag.press(place)
    for along in (1, 2, 3, 4, 5):
        drag.mouse(place + np.array([0.1 * along, 0.0, 0.0]))
    outlined = dict(state.edits)
    assert [edit.move_m for edit in outlined.values()] == [pytest.approx((0.5, 0.0), abs=1e-6)] * count
    assert len(presses) == (shown if count > 1 else 5)
    assert drag.release(place) == {"FINISHED"}
    assert baked_ground.edits_of(baked.softground.ground) == outlined


def test_a_box_may_end_over_the_sidebar(baked, drag):
    steps = baked_steps.of(baked.softground.ground)
    choose(steps[0])
    drag.press((-9.0, -9.0))
    for place in ((0.0, 0.0), (9.5, 9.9)):
        drag.mouse(place)
    drag.release((9.5, 9.9))
    assert set(session.chosen_steps()) == {step.name for step in steps}


def test_a_box_ends_at_the_edge_of_the_viewport(baked, drag):
    drag.press((-9.0, -9.0))
    drag.mouse((30.0, -30.0))
    assert [tuple(corner) for corner in state.box] == [(100, 100), (2 * Drag.HALF, 0)]
    drag.release((30.0, -30.0))
    assert not session.chosen_steps()


def test_a_step_that_is_none_is_named(baked):
    with pytest.raises(RuntimeError, match=r"no step 'Walker/foot.L@999.0': select one in the list"):
        bpy.ops.softground.mute_step(step="Walker/foot.L@999.0")


@pytest.mark.slow
def test_without_a_bake_there_is_no_step_to_change(scene):
    shots.walker(scene, frames=30)
    assert not baked_steps.of(scene.softground.ground)
    for name in ("choose_step", "mute_step", "change_step", "reset_step", "reset_steps", "drag_step"):
        assert not getattr(bpy.ops.softground, name).poll()
    assert ground_mesh.RECORD
