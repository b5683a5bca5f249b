"""What a bake says of itself, on cases that are right or wrong by construction."""

import re
from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.checks.self_check import WALK_RATIO, bottomed_out, self_check
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.findings import Finding, worst_first
from softground_addon.core.ground import presets
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.motion.motion import LowSkin
from tests.core.character import Slope
from tests.core.walkers import GRAVITY, MASS, box_sole, pose, pressed, standing, walk

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
STATURE = 1.78
PLACES = np.array([[0.0, 0.2, 0.0], [0.0, -0.2, 0.0]])


def skin_at(frames, places):
    """Calm skin at places (P, 3) that do not move."""
    position = np.broadcast_to(np.asarray(places, dtype=float), (len(frames), len(places), 3)).copy()
    return LowSkin(frames, position, np.zeros(position.shape[:2]), 0.3, STATURE)


def stands(skin=PLACES, soles=PLACES):
    """A body on feet at some places, its skin calm at others."""
    loads = standing(box_sole(0.27, 0.1), soles, MASS * GRAVITY / len(soles))
    frames = loads.motion.frames[loads.motion.on_frames]
    motion = loads.motion
    seen = tuple(replace(sole, bears=np.ones(len(motion.frames), dtype=bool)) for sole in motion.soles)
    seen = tuple(
        replace(sole, sole=replace(sole.sole, name=name)) for sole, name in zip(seen, ("left", "right"), strict=False)
    )
    moves = {"hips": np.linspace((0, 0, 0.9), (0, 0, 0.92), len(motion.frames))}
    return replace(loads, motion=replace(motion, skin=skin_at(frames, skin), soles=seen, joints=moves))


def findings_of(loads, terrain=None, cell_size=0.01):
    """Findings by their codes."""
    terrain = terrain or FlatTerrain()
    _, footprints = pressed(loads, SNOW, cell_size, terrain)
    findings = self_check([loads], footprints, terrain, cell_size, "Field")
    assert len({finding.code for finding in findings}) == len(findings)
    return {finding.code: finding for finding in findings}


def test_a_sound_bake_has_nothing_to_say():
    assert not findings_of(stands())


@pytest.mark.parametrize("over", [0.06, -0.06, 0.015])
def test_a_ground_off_the_resting_skin_is_told_by_how_much(over):
    findings = findings_of(stands(skin=np.add(PLACES, (0, 0, over))))
    if abs(over) < 0.012 * STATURE:
        assert not findings
        return
    assert findings.keys() == {"ground_off_skin"}  # the steps are where the skin is
    side, way = ("above", "up") if over > 0 else ("below", "down")
    assert f"6.0 cm {side} 'Field'" in findings["ground_off_skin"].message
    assert f"ground {way}" in findings["ground_off_skin"].remedy


@pytest.mark.parametrize(("turned", "code"), [(0.0, "level_on_slope"), (1.0, "ground_off_skin")])
def test_feet_that_stand_level_on_a_slope_want_stairs_and_not_a_ground_of_another_height(turned, code):
    slope, ends = np.arctan(0.4), np.array([(-0.13, 0.0, 0.0), (0.13, 0.0, 0.0)])
    loads = stands(skin=np.add(PLACES, (0, 0, 0.04)))
    soles = tuple(
        replace(foot, sole=replace(foot.sole, landmarks=ends, landmark_patch=np.zeros(2, int)))
        for foot in loads.motion.soles
    )
    for foot, place in zip(soles, PLACES, strict=True):
        foot.transforms[:] = pose(place, 0.0, turned * slope)
    loads = replace(loads, motion=replace(loads.motion, soles=soles))
    normal = np.broadcast_to((-np.sin(slope), 0.0, np.cos(slope)), loads.contacts.normal.shape)
    loads = replace(loads, contacts=replace(loads.contacts, normal=normal))
    findings = findings_of(loads, Slope(slope=0.4))
    assert findings.keys() == {code}
    assert ("slopes by 22°" in findings[code].message) == ("mesh of them" in findings[code].remedy) == (not turned)
    skeleton = replace(loads, motion=replace(loads.motion, skin=None, stature=STATURE))
    assert findings_of(skeleton, Slope(slope=0.4)).keys() == ({"level_on_slope"} if not turned else set())


def test_a_step_where_no_skin_rests_and_skin_that_rests_without_a_step_are_told_apart():
    away = np.add(PLACES, (1.0, 0, 0))
    assert findings_of(stands(skin=np.concatenate([PLACES[:1], away]))).keys() == {"step_without_skin"}
    assert findings_of(stands(skin=away)).keys() == {"step_without_skin", "skin_without_step"}
    loads = stands()
    frames = loads.motion.skin.frames
    alone = skin_at(frames, np.concatenate([PLACES, away[:1]]))
    alone.rise[len(frames) // 2 :, :2] = 1.0  # from there on it stands on the other, which does not print
    other = replace(loads, motion=replace(loads.motion, skin=alone))
    assert findings_of(other)["skin_without_step"].message.endswith(f"from frame {frames[len(frames) // 2]:.0f} on")


def named(loads, bones, soles):
    skin = replace(loads.motion.skin, bones=bones, soles=soles)
    return replace(loads, motion=replace(loads.motion, skin=skin))


def test_each_contact_is_judged_by_its_own_skin_and_named():
    """A foot without a print is not covered by the other one beside it, and a tail wants one, too."""
    apart = np.array([[0.0, 0.1, 0.0], [0.0, -0.1, 0.0], [-0.4, 0.0, 0.0]])
    loads = named(stands(apart, apart[:2]), ("foot.L", "foot.R", "tail"), ("left", "right", ""))
    said = findings_of(loads)
    assert said.keys() == {"skin_without_step"}
    assert said["skin_without_step"].severity == "warning"
    assert "'tail' of" in said["skin_without_step"].message
    near = np.add(apart, [[0, 0, 0], [0, 0, 0], [0.35, 0.1, 0]])  # a heel of the left foot
    assert not findings_of(named(stands(near, apart[:2]), ("foot.L", "foot.R", "heel"), ("left", "right", "")))
    touching = loads.contacts.touching.copy()
    touching[:, 1] = False
    missing = replace(loads, contacts=replace(loads.contacts, touching=touching))
    said = findings_of(missing)
    assert "'tail' of" in said["skin_without_step"].message
    assert "The contact 'right' of 'walker'" in said["contact_without_step"].message
    assert "add" not in said["contact_without_step"].text.lower()  # it is in the list already
    aloft = np.add(apart[:2], [[0, 0, 0.1], [0, 0, 0]])
    over = named(stands(aloft, apart[:2]), ("foot.L", "foot.R"), ("left", "right"))
    assert "'left' of" in findings_of(over)["step_without_skin"].message


@pytest.mark.parametrize(("late", "named_ones"), [(0.05, ""), (0.15, "'right' of 'walker' prints while its skin is")])
def test_a_contact_that_outlasts_its_skin_is_named(late, named_ones):
    loads = named(stands(), ("foot.L", "foot.R"), ("left", "right"))
    left, right = loads.motion.soles
    bears = np.arange(len(loads.motion.frames)) * loads.motion.time_step > late
    late_ones = replace(loads, motion=replace(loads.motion, soles=(left, replace(right, bears=bears))))
    said = findings_of(late_ones)
    assert said.keys() == ({"step_without_skin"} if named_ones else set())
    assert named_ones in "".join(finding.message for finding in said.values())


def test_feet_that_slide_or_swing_low_want_no_print_of_their_own():
    loads = named(stands(), ("foot.L", "foot.R"), ("left", "right"))
    touching = loads.contacts.touching.copy()
    touching[:, 1] = False
    skin = loads.motion.skin
    skin.position[:, 1, 0] += np.linspace(0, 0.5 * STATURE, len(skin.frames)) * 4
    assert "skin_without_step" not in findings_of(replace(loads, contacts=replace(loads.contacts, touching=touching)))


@pytest.mark.parametrize(("share", "is_named"), [(0.12, False), (0.18, True)])
def test_skin_that_rests_without_a_step_for_more_than_15_percent_of_the_time_is_told(share, is_named):
    loads = stands()
    frames = loads.motion.skin.frames
    skin = skin_at(frames, np.concatenate([PLACES, np.add(PLACES[:1], (1.0, 0, 0))]))
    skin.rise[round(len(frames) * (1 - share)) :, :2] = 1.0
    findings = findings_of(replace(loads, motion=replace(loads.motion, skin=skin)))
    assert ("skin_without_step" in findings) == is_named


@pytest.mark.parametrize("side", [1, -1])
def test_feet_that_rest_apart_on_both_sides_of_the_ground_each_have_skin(side):
    heights = np.array([(0, 0, -0.011), (0, 0, 0.008)]) * side * STATURE  # within 1.2 %, but apart by more than 1.5 %
    assert not findings_of(stands(skin=PLACES + heights))


@pytest.mark.parametrize(("depth", "agrees"), [(0.05, True), (0.3, False)])
def test_a_step_whose_skin_has_sunk_into_the_ground_is_that_skins(depth, agrees):
    loads = stands()
    sunk = skin_at(loads.motion.skin.frames, PLACES)
    middle = len(sunk.frames) // 2
    sunk.position[middle - 3 : middle + 4, 0, 2] -= depth
    findings = findings_of(replace(loads, motion=replace(loads.motion, skin=sunk)))
    assert ("step_without_skin" not in findings) == agrees


@pytest.mark.parametrize("at_end", [True, False])
@pytest.mark.parametrize(("lasts", "rests", "agrees"), [(2, 0, True), (8, 3, True), (8, 0, False)])
def test_a_step_that_an_end_of_the_shot_cuts_wants_skin_at_some_time_and_none_where_it_is_a_moment(
    lasts, rests, agrees, at_end
):
    """What lands in the last frames, or leaves in the first, shows nothing of its middle."""
    loads = stands()
    frames, skin = loads.motion.frames, loads.motion.skin
    from_end = frames[-1] - frames if at_end else frames - frames[0]
    touching = loads.contacts.touching.copy()
    touching[:, 1] = from_end <= lasts
    skin.rise[:, 1] = np.where(from_end[loads.motion.on_frames] <= rests - 1, 0.0, 1.0)
    cut = replace(loads, contacts=replace(loads.contacts, touching=touching))
    assert ("step_without_skin" not in findings_of(cut)) == agrees


def test_a_foot_that_bears_on_the_edge_of_its_sole_leaves_no_print_and_says_so():
    loads = stands()
    loads.motion.soles[0].transforms[:] = pose(PLACES[0], 0.0, np.pi / 2)
    finding = findings_of(loads)["sole_without_print"]
    assert finding.message == "'left' of 'walker' bears load and leaves no print"


def test_skin_off_the_ground_and_bodies_without_skin_say_nothing():
    loads = stands()
    assert not findings_of(replace(loads, motion=replace(loads.motion, skin=None)))
    skin = loads.motion.skin
    beside = LowSkin(skin.frames, np.add(skin.position, (9.0, 0, 0)), skin.rise, skin.calm, skin.height)
    codes = findings_of(replace(loads, motion=replace(loads.motion, skin=beside)), Slope(edge=5.0)).keys()
    assert "ground_off_skin" not in codes


@pytest.mark.parametrize(("apart", "is_named"), [(0.015, False), (0.03, True)])
def test_feet_of_one_body_that_float_by_more_than_two_centimetres_apart(apart, is_named):
    loads = stands()
    loads = replace(loads, contacts=replace(loads.contacts, offset=np.array([0.0, apart])))
    findings = findings_of(loads)
    assert ("feet_apart" in findings) == is_named
    if is_named:
        assert f"'right' of 'walker' is planted {apart * 100:.1f} cm higher" in findings["feet_apart"].message


@pytest.mark.parametrize(
    ("size", "remedy", "unit"),
    [
        (178.0, "by 0.01", "centimetres"),
        (20.0, "by 0.08", "MMD's units of 8 cm"),
        (70.0, "by 0.0254", "inches"),
        (1780.0, "by 0.001", "millimetres"),
        (0.0178, "by 100", "metres, and was read as centimetres"),
        (12.0, "", ""),
        (0.1, "", ""),
    ],
)
def test_a_body_of_another_unit_is_told_its_scale(size, remedy, unit):
    loads = stands()
    findings = findings_of(replace(loads, motion=replace(loads.motion, stature=size)))
    assert ("unit_scale" in findings) == bool(remedy)
    if remedy:
        assert remedy in findings["unit_scale"].remedy
        assert findings["unit_scale"].message.endswith(f"its file is in {unit}.")


LEGS = {f"{joint}_{side}": np.zeros((1, 3)) for joint in ("hip", "knee", "ankle") for side in "lr"}


@pytest.mark.parametrize(
    ("size", "remedy"),
    [(0.42, "by 4,"), (0.66, "by 2.54,"), (1.1, ""), (2.0, ""), (5.6, "by 0.3,"), (0.017, "by 100,")],
)
def test_a_skeleton_of_a_person_that_is_no_size_of_people_is_told_its_factor(size, remedy):
    loads = stands()
    bare = tuple(replace(sole, sole=replace(sole.sole, underside=None)) for sole in loads.motion.soles)
    joints = {name: np.repeat(path, len(loads.motion.frames), axis=0) for name, path in LEGS.items()}
    motion = replace(loads.motion, stature=size, soles=bare, joints={**loads.motion.joints, **joints})
    findings = findings_of(replace(loads, motion=motion))
    assert ("unit_scale" in findings) == bool(remedy)
    if remedy:
        assert remedy in findings["unit_scale"].remedy
        assert findings["unit_scale"].severity == ("warning" if size > 0.05 else "error")
    has_skin = tuple(replace(sole, sole=replace(sole.sole, underside=np.zeros((1, 3)))) for sole in bare)
    assert "unit_scale" not in {*findings_of(replace(loads, motion=replace(motion, soles=has_skin)))} or size == 0.017


@pytest.mark.parametrize("legs", [True, False])
def test_a_figure_on_two_legs_with_the_volume_of_a_horse_is_told_what_people_of_its_height_weigh(legs):
    loads = stands()
    joints = {name: np.repeat(path, len(loads.motion.frames), axis=0) for name, path in LEGS.items()} if legs else {}
    heavy = replace(loads.motion.skin, mass=950.0)
    motion = replace(loads.motion, skin=heavy, size=1.77, joints={**loads.motion.joints, **joints})
    findings = findings_of(replace(loads, motion=replace(motion, mass=950.0)))
    assert ("mass_of_size" in findings) == legs
    if legs:
        assert "a height of 1.77 m on two legs suggests about 76 kg" in findings["mass_of_size"].message


@pytest.mark.parametrize("share", [1.0, 0.95, 0.5, 0.1])
def test_a_sole_on_the_edge_of_the_ground_says_how_much_of_it_prints(share):
    length = 0.27
    edge = Slope(edge=(share - 0.5) * length)
    loads = stands(skin=np.subtract(PLACES, (0.05, 0, 0)))
    findings = findings_of(loads, edge)
    assert ("edge_of_ground" in findings) == (share < 0.9)
    if share < 0.9:
        percent = float(findings["edge_of_ground"].message.split("as little as ")[1].split(" %")[0])
        assert percent / 100 == pytest.approx(share, abs=0.03)
        assert "2 steps of 'walker'" in findings["edge_of_ground"].message


@pytest.mark.parametrize(
    ("slower", "speed", "period", "is_named"),
    [
        (1.0, 1.3, 1.1, False),
        (1.2, 1.3, 1.1, False),  # data of 30 frames a second in a scene of 25
        (2.0, 1.3, 1.1, True),
        (2.4, 1.3, 1.1, True),
        (4.8, 1.3, 1.1, True),
        (2.0, 1.8, 0.95, True),
        (1.0, 0.4, 2.1, False),  # a creeping walk
        (1.0, 0.7, 1.7, False),
    ],
)
def test_data_of_more_frames_a_second_than_the_scene_is_slow_motion_and_a_slow_walk_is_not(
    slower, speed, period, is_named
):
    loads = walk(speed=speed, period=period)
    slow = replace(loads, motion=replace(loads.motion, frame_rate=loads.motion.frame_rate / slower))
    _, footprints = pressed(loads, SNOW, 0.02)
    codes = {finding.code for finding in self_check([slow], footprints, FlatTerrain(), 0.02, "Field")}
    assert ("slow_motion" in codes) == is_named


def test_the_walk_ratio_is_that_of_an_adult():
    # Steps of 0.70 m at 110 a minute.
    assert 0.70 / (110 / 60) / (0.87 * np.sqrt(0.87 / 9.81)) == pytest.approx(WALK_RATIO, rel=0.01)


def test_the_worst_is_said_first_and_equals_keep_their_order():
    findings = [Finding(code, severity, "", "") for code, severity in (("a", "note"), ("b", "error"), ("c", "note"))]
    assert [finding.code for finding in worst_first(findings)] == ["b", "a", "c"]


@pytest.mark.parametrize(
    ("preset", "said"),
    [("fresh_snow", True), ("snow", False), ("mud", False), ("loose_dry_sand", False), ("powder", False)],
)
def test_steps_that_end_at_the_bottom_of_the_layer_are_said(preset, said):
    ground = presets.find(preset)
    soft = SoftGround(FlatTerrain(), ground.material, ground.pressure)
    heavy = walk()
    heavy.forces.forces[:] *= 1.5  # a person with a load
    footprints = [footprint for result in simulate([heavy], soft, 0.02) for footprint in result.footprints]
    findings = bottomed_out(footprints, ground.material, "Field")
    assert [finding.code for finding in findings] == ["bottomed_out"] * said
    if said:
        assert re.match(
            r"\d of 6 steps press 'Field' as far as it goes, 60 cm: make the layer deeper", findings[0].text
        )
