"""Edited steps are pressed again, as a simulation of the whole edited motion would press them."""

import json
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.composers.edited_steps import EditedSteps, with_edits
from softground_addon.core.errors import InputError
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.record import record
from softground_addon.core.record.contact_steps import LENGTH, width_of
from softground_addon.core.record.edits import StepEdit, from_json, step_id, to_json, without_sole
from softground_addon.core.record.footprints import recompose
from softground_addon.core.record.mesh_sole import MeshSole
from softground_addon.core.record.record import BakeRecord
from softground_addon.core.soles.soles import sole_from_underside
from tests.core.walkers import FOOT_LENGTH, box_sole, foot_sole, pose, pressed, standing, walk
from tests.pace import at_pace

SOIL = GroundMaterial(0.3e6, 0.35, 0.15)
MATERIALS = {
    "soil": SOIL,
    "hardening": replace(SOIL, hardening=3.0, rim_bias=0.5, firm_depth=0.03),
    "crust": replace(SOIL, crust_stress=5e3, shortest_time=0.02),
    "sand": replace(SOIL, repose_angle=0.6),
}
CELL = 0.01


class Hill:
    """A slope that begins at x = 1 m."""

    RISE = 0.2

    def heights(self, x, y):
        return self.RISE * np.maximum(np.asarray(x, float) - 1.0, 0.0) + 0 * np.asarray(y)


@cache
def baked(material="soil", steps=5):
    """A bake of a walk, and the loads it is of."""
    loads = walk(steps=steps)
    return loads, BakeRecord(tuple(pressed(loads, MATERIALS[material], CELL)[1]), {})


def ground_of(material="soil", terrain=None):
    return SoftGround(terrain or FlatTerrain(), MATERIALS[material])


def edited(bake, edits, material="soil"):
    """The record with edits of steps by their number."""
    count = len(bake.footprints)
    named = {step_id(bake.footprints[n % count], n // count): edit for n, edit in edits.items()}
    return with_edits(bake, named, ground_of(material), CELL)


def elsewhere(loads, footprint, edit):
    """The loads with the motion of one contact moved and turned about its print."""
    index = [sole.sole.name for sole in loads.motion.soles].index(footprint.sole)
    first = footprint.pressed_by.first - footprint.pressed_by.approach
    during = slice(first, footprint.pressed_by.first + len(footprint.load_frames))
    turned = np.radians(edit.turn_deg)
    carry = pose((*(footprint.position[:2] + edit.move_m), 0.0), turned) @ pose((*(-footprint.position[:2]), 0.0))
    transforms = loads.motion.soles[index].transforms.copy()
    transforms[during] = carry @ transforms[during]
    soles = list(loads.motion.soles)
    soles[index] = replace(soles[index], transforms=transforms)
    return replace(loads, motion=replace(loads.motion, soles=tuple(soles)))


def difference(first, other):
    """Largest difference of two grounds [m]."""
    windows = {*first.tile_windows(), *other.tile_windows()}
    return max(float(np.abs(first.read(window) - other.read(window)).max()) for window in windows)


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize(
    "edit", [StepEdit(move_m=(0.0537, 0.0313), turn_deg=3.0), StepEdit(move_m=(-0.6, 0.02), turn_deg=20.0)]
)
def test_a_moved_step_is_pressed_as_a_simulation_of_the_moved_motion_presses_it(material, edit):
    loads, bake = baked(material)
    step = bake.footprints[3]
    whole, _ = pressed(elsewhere(loads, step, edit), MATERIALS[material], CELL)
    ours = recompose(edited(bake, {3: edit}, material).edited, cell_size=CELL)
    # What slides comes to rest a little otherwise where the feet in contact are not pressed in turn within a frame.
    assert difference(whole, ours) < (2e-3 if material == "sand" else 6e-5)
    assert difference(whole, recompose(bake.footprints)) > 5e-3


def test_a_step_on_top_of_another_presses_what_that_one_left():
    _, bake = baked()
    first, other = bake.footprints[2], bake.footprints[4]  # of the same foot
    onto = StepEdit(move_m=tuple(first.position[:2] - other.position[:2]))
    after = edited(bake, {4: onto})
    assert after.pressed_again[4].compressed_m3 < 0.3 * other.compressed_m3
    back = edited(bake, {2: StepEdit(move_m=tuple(other.position[:2] - first.position[:2]))})
    assert sorted(back.pressed_again) == [2, 4]  # what comes later is pressed again too
    assert back.pressed_again[4].compressed_m3 < 0.3 * other.compressed_m3
    muted = edited(after, {4: onto, 2: StepEdit(mute=True)})
    assert muted.pressed_again[2] is None
    assert muted.pressed_again[4].compressed_m3 == pytest.approx(other.compressed_m3, rel=0.02)


@pytest.mark.parametrize("strength", [0.0, 0.5, 1.5])
def test_strength_is_a_factor_on_the_depth_and_the_volumes(strength):
    _, bake = baked()
    before, after = bake.footprints[1], edited(bake, {1: StepEdit(strength=strength)}).pressed_again[1]
    assert after.max_depth_m == pytest.approx(strength * before.max_depth_m, abs=5e-6)
    assert after.compressed_m3 == pytest.approx(strength * before.compressed_m3, rel=1e-3, abs=1e-12)
    assert after.rim_m3 == pytest.approx(2 * SOIL.poisson_ratio * after.compressed_m3, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("material", ["soil", "hardening"])
def test_a_copy_prints_as_the_moved_step_itself_and_leaves_that_one_alone(material):
    _, bake = baked(material)
    away = StepEdit(move_m=(0.0, 1.5), turn_deg=30.0)
    moved, copied = edited(bake, {1: away}, material), edited(bake, {1 + len(bake.footprints): away}, material)
    print_of = next(step.footprint for step in copied.steps if step.is_copy)
    assert record.dump(BakeRecord((print_of,), {})) == record.dump(BakeRecord((moved.pressed_again[1],), {}))
    assert len(copied.edited) == len(bake.footprints) + 1
    assert copied.steps[1].footprint is bake.footprints[1]


def test_a_copy_in_the_place_of_its_step_presses_little_further():
    _, bake = baked()
    copied = edited(bake, {1 + len(bake.footprints): StepEdit(shift_frames=60)})
    again = next(step.footprint for step in copied.steps if step.is_copy)
    assert again.compressed_m3 < 0.05 * bake.footprints[1].compressed_m3


def test_a_later_step_leaves_the_same_print_later():
    _, bake = baked()
    before, after = bake.footprints[2], edited(bake, {2: StepEdit(shift_frames=7)}).pressed_again[2]
    np.testing.assert_array_equal(after.load_frames, before.load_frames + 7)
    for frame in (*range(int(before.start_frame) + 3, int(before.end_frame), 3), np.inf):
        assert difference(recompose([before], frame), recompose([after], frame + 7)) < 1e-5


def test_a_step_that_comes_earlier_than_another_is_pressed_by_it():
    _, bake = baked()
    earlier, other = bake.footprints[2], bake.footprints[4]  # of the same foot
    onto = StepEdit(move_m=tuple(earlier.position[:2] - other.position[:2]))
    first = replace(onto, shift_frames=int(earlier.start_frame - other.end_frame) - 2)
    after = edited(bake, {4: first})
    assert sorted(after.pressed_again) == [2, 4]
    assert after.pressed_again[2].compressed_m3 < 0.3 * earlier.compressed_m3
    assert after.pressed_again[4].compressed_m3 == pytest.approx(other.compressed_m3, rel=0.02)
    frames = [footprint.start_frame for footprint in after.edited]
    assert frames == sorted(frames)


@pytest.mark.parametrize("scale", [0.7, 1.6])
def test_a_larger_step_covers_more_at_the_same_pressure(scale):
    loads = standing(box_sole(0.3, 0.1), (0.5, 0.2, 0.0), 600.0)
    bake = BakeRecord(tuple(pressed(loads, SOIL, CELL)[1]), {})
    before, after = bake.footprints[0], edited(bake, {0: StepEdit(scale=scale)}).pressed_again[0]
    assert after.area_m2 == pytest.approx(scale**2 * before.area_m2, rel=0.03)
    assert after.peak_force_n / after.area_m2 == pytest.approx(before.peak_force_n / before.area_m2, rel=0.03)
    assert after.max_depth_m == pytest.approx(before.max_depth_m, rel=0.03)
    np.testing.assert_allclose(after.position, before.position, atol=2e-3)


def test_a_step_in_another_sole_is_pressed_as_a_simulation_of_that_sole():
    place, heading, plate = np.array([0.5, 0.2, 0.0]), 0.4, box_sole(0.4, 0.15)
    foot = standing(foot_sole("foot.L", "L"), place, 600.0, heading=heading)
    other = standing(plate, (3.0, 0.0, 0.0), 600.0, name="giant")
    bake = BakeRecord(tuple(pressed([foot, other], SOIL, CELL)[1]), {})
    middles = [(each.outline.min(axis=0) + each.outline.max(axis=0)) / 2 for each in (foot.motion.soles[0].sole, plate)]
    target = pose(place, heading)[:3, :3] @ [*(middles[0] - middles[1]), 0.0] + place
    _, (expected,) = pressed(standing(plate, target, 600.0, heading=heading), SOIL, CELL)
    after = edited(bake, {0: StepEdit(sole=f"giant/{plate.name}")}).pressed_again[0]
    assert difference(recompose([expected]), recompose([after])) < 1e-6
    assert after.area_m2 > 1.5 * bake.footprints[0].area_m2


def mesh_sole(name="Shoe", length=0.4, width=0.15):
    """The sole of a box that stands level, with its mesh."""
    corners = np.array([(x, y, z) for x in (0, length) for y in (0, width) for z in (0, 0.1)], float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([[face[k] for k in half] for face in faces for half in ((0, 1, 2), (0, 2, 3))])
    placed = sole_from_underside(corners - [length / 2, width / 2, 0.0], triangles, name=name, side="")
    return MeshSole.of(placed.sole, placed.placements)


def test_a_step_in_the_sole_of_a_mesh_is_pressed_as_a_simulation_of_that_sole():
    place, heading, mesh = np.array([0.5, 0.2, 0.0]), 0.4, mesh_sole()
    foot = standing(foot_sole("foot.L", "L"), place, 600.0, heading=heading)
    bake = BakeRecord(tuple(pressed(foot, SOIL, CELL)[1]), {})
    outlines = foot.motion.soles[0].sole.outline, mesh.pressing.sole.outline
    middles = [(outline.min(axis=0) + outline.max(axis=0)) / 2 for outline in outlines]
    target = pose(place, heading)[:3, :3] @ [*(middles[0] - middles[1]), 0.0] + place
    _, (expected,) = pressed(standing(mesh.pressing.sole, target, 600.0, heading=heading), SOIL, CELL)
    after = edited(bake, {0: StepEdit(sole="Shoe", mesh=mesh)}).pressed_again[0]
    assert difference(recompose([expected]), recompose([after])) < 1e-6
    assert after.area_m2 == pytest.approx(0.4 * 0.15, rel=0.05)


def test_the_sole_of_a_mesh_is_kept_with_the_edits():
    _, bake = baked()
    mesh = mesh_sole()
    after = edited(bake, {1: StepEdit(sole="Shoe", mesh=mesh), 2: StepEdit(sole="Shoe", mesh=mesh, mute=True)})
    assert without_sole(bake.footprints, after.edits) == []
    assert from_json(json.loads(json.dumps(to_json(after.edits))), "It") == after.edits
    stored = record.load(record.dump(after))
    assert stored.edits == after.edits
    again = with_edits(BakeRecord(bake.footprints, {}), stored.edits, ground_of(), CELL)
    assert record.dump(again) == record.dump(after)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda sole: sole.pop("coded"), "'numbers' and 'coded'"),
        (lambda sole: sole["coded"].pop(), "cut short"),
        (lambda sole: sole["numbers"].append(1.0), "more than"),
        (lambda sole: sole["numbers"].__setitem__(3, float("nan")), "no number of its kind"),
        (lambda sole: sole["numbers"].__setitem__(3, "1"), "what is no number"),
        (lambda sole: sole["coded"].__setitem__(0, 0.5), "no whole number"),
        (lambda sole: sole.update(numbers=[1e3 * value for value in sole["numbers"]]), "this is no sole of a mesh"),
    ],
)
def test_a_kept_sole_that_is_none_is_named(change, said):
    edits = {"Walker/foot.L@7.0": StepEdit(sole="Shoe", mesh=mesh_sole())}
    content = json.loads(json.dumps(to_json(edits)))
    change(content["soles"]["Shoe"])
    with pytest.raises(InputError, match="Leave it out: a bake cuts it from the object") as caught:
        from_json(content, "The edits")
    assert str(caught.value).startswith("The edits, sole 'Shoe': ")
    assert said in str(caught.value)


def test_a_foot_of_the_same_shape_leaves_the_same_print():
    twin = walk(steps=3, origin=(0.0, 2.0, 0.0), heading=0.7, name="twin")
    first = walk(steps=3, origin=(0.0037, 0.0021, 0.0))  # nothing lies on the border of a cell
    bake = BakeRecord(tuple(pressed([first, twin], SOIL, CELL)[1]), {})
    number = next(n for n, step in enumerate(bake.footprints) if (step.character, step.sole) == ("walker", "foot.R"))
    after = edited(bake, {number: StepEdit(sole="twin/foot.R")}).pressed_again[number]
    assert difference(recompose([after]), recompose([bake.footprints[number]])) < 1e-5


@pytest.mark.parametrize(("whole", "size"), [(True, 1.2), (False, 0.8)])
def test_a_sole_in_one_piece_and_one_in_two_take_each_others_steps(whole, size):
    plate = box_sole(size * FOOT_LENGTH, 0.08)
    walker, other = walk(steps=2), standing(plate, (0.0, 3.0, 0.0), 600.0, name="plate")
    bake = BakeRecord(tuple(pressed([walker, other], SOIL, CELL)[1]), {})
    number = next(n for n, step in enumerate(bake.footprints) if (step.character == "walker") == whole)
    before = bake.footprints[number]
    after = edited(bake, {number: StepEdit(sole=f"plate/{plate.name}" if whole else "walker/foot.L")}).pressed_again[
        number
    ]
    np.testing.assert_allclose(after.position[:2], before.position[:2], atol=0.03)
    assert after.max_depth_m == pytest.approx(before.max_depth_m, rel=0.6)
    assert after.area_m2 / before.area_m2 == pytest.approx(size**2 if whole else 1 / size**2, rel=0.5)


def test_a_sole_that_is_not_in_the_bake_is_named_and_the_own_one_presses():
    _, bake = baked()
    plain, away = (edited(bake, {1: StepEdit(turn_deg=20.0, sole=sole)}) for sole in ("", "fox/paw.L"))
    assert difference(recompose(away.edited), recompose(plain.edited)) == 0.0
    assert without_sole(bake.footprints, away.edits) == list(away.edits)
    assert without_sole(bake.footprints, plain.edits) == []


def test_a_moved_step_follows_the_ground():
    terrain = Hill()
    loads = walk(steps=2)
    bake = BakeRecord(tuple(pressed(loads, SOIL, CELL, terrain)[1]), {})
    step = bake.footprints[0]
    up = with_edits(bake, {step_id(step): StepEdit(move_m=(2.0, 0.0))}, SoftGround(terrain, SOIL), CELL)
    moved = up.pressed_again[0]
    assert moved.position[0] == pytest.approx(step.position[0] + 2.0, abs=0.02)
    assert moved.position[2] == pytest.approx(terrain.heights(moved.position[0], 0.0), abs=2e-3)
    assert moved.compressed_m3 == pytest.approx(step.compressed_m3, rel=0.1)


def test_a_step_off_the_ground_leaves_nothing():
    class Plate:
        def heights(self, x, y):
            return np.where(np.asarray(x) < 3.0, 0.0, np.nan) + 0 * np.asarray(y)

    _, bake = baked()
    name = step_id(bake.footprints[0])
    gone = with_edits(bake, {name: StepEdit(move_m=(50.0, 0.0))}, SoftGround(Plate(), SOIL), CELL)
    assert gone.pressed_again[0] is None
    assert len(gone.edited) == len(bake.footprints) - 1
    assert record.dump(record.load(record.dump(gone))) == record.dump(gone)


SOLES = [StepEdit(sole=name) for name in ("", "walker/foot.L", "walker/foot.R", "fox/paw.L")] + [
    StepEdit(sole="Shoe", mesh=mesh_sole()),
    StepEdit(sole="Cane", mesh=mesh_sole("Cane", 0.05, 0.05)),
]
CHANGES = st.builds(
    replace,
    st.sampled_from(SOLES),
    mute=st.booleans(),
    strength=st.floats(0.0, 3.0),
    move_m=st.tuples(st.floats(-1.5, 1.5), st.floats(-0.3, 0.3)),
    turn_deg=st.floats(-180.0, 180.0),
    scale=st.floats(0.5, 1.5),
    shift_frames=st.integers(-30, 30),
)


@settings(max_examples=12, deadline=None)
@given(
    edits=st.dictionaries(st.integers(0, 9), CHANGES, max_size=4),  # of five steps, and a copy of each
    order=st.randoms(use_true_random=False),
    material=st.sampled_from(["soil", "hardening"]),
)
def test_edits_one_by_one_give_the_bytes_of_all_at_once_and_reset_those_of_the_bake(edits, order, material):
    _, bake = baked(material)
    first = record.dump(bake)
    at_once = edited(bake, edits, material)
    stored = record.load(record.dump(at_once))  # as it is met again in the file
    assert record.dump(edited(record.load(first), edits, material)) == record.dump(at_once) == record.dump(stored)
    steps, so_far = EditedSteps(bake.footprints, ground_of(material), CELL), {}
    names = list(edits)
    order.shuffle(names)
    for number in names:
        so_far[number] = edits[number]
        again = steps.pressed_again(so_far)
    if edits:
        one_by_one = replace(at_once, pressed_again=again)
        assert record.dump(one_by_one) == record.dump(at_once)
    assert record.dump(edited(stored, {}, material)) == first


def test_a_print_of_which_too_little_is_kept_can_only_be_muted():
    _, bake = baked()
    old = replace(bake, footprints=[replace(footprint, pressed_by=None) for footprint in bake.footprints])
    assert edited(old, {1: StepEdit(mute=True)}).pressed_again == {1: None}
    with pytest.raises(InputError, match=r"foot.R, at frame 21 .*can only be muted: give it fewer"):
        edited(old, {1: StepEdit(strength=0.5)})


@pytest.mark.parametrize("row", [3, -3])
def test_a_forged_print_whose_sole_is_thrown_far_away_is_refused_in_no_time(row):
    """Steps are kept as second differences: a single forged number moves all that come later, some metres in each."""
    _, bake = baked()
    steps = bake.footprints[1].pressed_by
    coded = steps.coded.reshape(-1, width_of(steps.pressing)).copy()
    coded[row, :2] += round(30.0 / LENGTH / (len(coded) - row % len(coded)))
    forged = replace(bake.footprints[1], pressed_by=replace(steps, coded=coded.reshape(-1)))
    started = time.process_time()
    with pytest.raises(InputError, match=r"foot.R, at frame 21 is larger than it can be: clear"):
        edited(replace(bake, footprints=[bake.footprints[0], forged]), {1: StepEdit(move_m=(0.1, 0.0))})
    assert time.process_time() - started < 2.0  # 20 s is a hang


@pytest.mark.alone
@pytest.mark.slow
def test_one_step_of_a_thousand_is_edited_in_50_ms():
    _, bake = baked(steps=1000)
    steps = EditedSteps(bake.footprints, ground_of(), CELL)
    took = []
    for number in range(480, 500):
        start = time.thread_time()  # whatever else the machine does
        steps.pressed_again({number: StepEdit(move_m=(0.1, 0.0), turn_deg=5.0)})
        took.append(time.thread_time() - start)
    print(f"one step of {len(bake.footprints)}: {1e3 * np.median(took):.1f} ms, at most {1e3 * max(took):.1f} ms")
    assert np.median(took) < at_pace(0.05)
