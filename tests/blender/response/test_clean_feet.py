"""Clean Feet: standing feet neither slide, float nor sink, read from the rig as the user's scene shows it."""

import importlib.util
import json
from dataclasses import replace

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs, settings
from softground_addon.blender.animation_layer.constraint_layer import LayerKind, has_layer, notes_of
from softground_addon.blender.baking.clean_feet import clean_feet
from softground_addon.blender.command_line import cli
from softground_addon.blender.compat import action_curves
from softground_addon.blender.reading.shots import estimate_shot, read_shot, settings_of
from softground_addon.blender.response import response_job
from softground_addon.blender.response.character_keys import controls_of
from softground_addon.blender.rigs.rest_pose import legs_of_feet, legs_on_shins
from softground_addon.core.composers.responses import standing_on
from softground_addon.core.errors import InputError
from softground_addon.core.motion.sole_motion import SoleMotion
from softground_addon.core.numerics.intervals import runs
from softground_addon.core.response.clean_feet import foot_faults
from softground_addon.core.response.response import at_scene_frames
from softground_addon.core.rig.mapping import RigMapping
from softground_addon.core.settings import Acts
from tests.blender import fingerprints, responders, shots
from tests.blender.grounds import plane

SLIDE_95, SLIDE_MAX, GAP_95 = 1.0, 3.0, 1.0
"""Bars [mm]: 95 of 100 frames, and the largest."""
KNEE = 1.05
"""Fastest knee over the fastest of the source."""


def read(scene):
    """The shot, and when its first character's soles touch."""
    wanted = replace(settings_of(scene, grounded=True), output="RESPONSE")
    shot = jobs.run(read_shot(wanted, LayerKind.CLEAN_FEET))
    standing = standing_on(shot.motions, shot.terrain, wanted.response)
    loads = jobs.run(estimate_shot(wanted, replace(shot, motions=standing)))[0]
    return shot, at_scene_frames(loads.contacts.touching, loads.motion.frames, shot.motions[0])


def on_the_rig(scene, motion):
    """The motion with its soles as the bones carry them now, and the height of the hips."""
    character = scene.softground.characters[0]
    mapping = responders.mapping_of(character)
    bones = [source.bone for source in mapping.soles] + [mapping.joints["hips"][0]]
    frames = motion.frames.astype(int)
    now = responders.world_matrices(scene, character.armature, bones, frames)
    character.clean_feet_strength = 0.0
    before = responders.world_matrices(scene, character.armature, bones, frames)
    character.clean_feet_strength = 1.0
    carry = now @ np.linalg.inv(before)
    soles = [SoleMotion(sole.sole, carry[:, i, None] @ sole.transforms) for i, sole in enumerate(motion.soles)]
    return replace(motion, soles=tuple(soles)), now[:, -1, :3, 3]


def millimetres(sizes):
    return np.percentile(sizes, 95) * 1e3, sizes.max() * 1e3


def fastest_knee(legs):
    return max(np.abs(np.diff(leg.flexion)).max() for leg in legs)


HIPS = 1.1
"""Jerk of the hips over that of the source..."""
STILL = 5e-5
"""...or in hips that hardly move, whose keys are exact to 20 μm [m/frame³]."""


def jerk(path):
    return np.sqrt((np.diff(path, 3, axis=0) ** 2).sum(axis=1).mean())


def check_bars(scene, name, before_knee):
    shot, touching = read(scene)
    cleaned, hips = on_the_rig(scene, shot.motions[0])
    source = foot_faults(shot.motions[0], touching, shot.terrain)
    faults = foot_faults(cleaned, touching, shot.terrain)
    knee = fastest_knee(responders.legs(scene)) / before_knee
    shaken = jerk(hips) / max(jerk(shot.motions[0].hips), STILL / (HIPS - 1.0))
    said = {of: (millimetres(getattr(source, of)), millimetres(getattr(faults, of))) for of in ("slide", "float_")}
    print(f"\n{name}: {said}, knee {knee:.3f}, hips {shaken:.3f}")
    assert millimetres(faults.slide)[0] < SLIDE_95
    assert millimetres(faults.slide)[1] < SLIDE_MAX
    assert millimetres(faults.float_)[0] < GAP_95
    assert millimetres(faults.penetration)[0] < GAP_95
    assert knee < KNEE
    assert shaken < HIPS


@pytest.fixture
def floor_walk(scene):
    """The walker on a plane at the height that it was made for."""
    shots.walker(scene, frames=48)
    bpy.ops.softground.add_character()
    scene.softground.ground = plane(scene)
    bpy.context.view_layer.update()
    return scene


def spoil(scene, slide=0.02, floats=0.03):
    """Sliding to and fro, and a float, by keys on the armature object: known, and not in the walk."""
    armature = scene.softground.characters[0].armature
    for frame in range(scene.softground.frame_start, scene.softground.frame_end + 1):
        armature.location = (slide * np.sin(frame / 7.0), slide * np.cos(frame / 9.0), floats)
        armature.keyframe_insert("location", frame=frame)
    scene.frame_set(scene.frame_current)


@pytest.mark.slow
def test_a_slide_and_a_float_that_were_added_are_gone(floor_walk):
    jobs.run(clean_feet(floor_walk))
    shot, touching = read(floor_walk)
    plain, hips = on_the_rig(floor_walk, shot.motions[0])
    bpy.ops.softground.clear_bake()
    spoil(floor_walk)
    before = fastest_knee(responders.legs(floor_walk))
    assert bpy.ops.softground.clean_feet() == {"FINISHED"}
    check_bars(floor_walk, "spoilt walk", before)
    cleaned, cleaned_hips = on_the_rig(floor_walk, read(floor_walk)[0].motions[0])
    for with_slide, without, stands in zip(cleaned.soles, plain.soles, touching.T, strict=True):
        height = with_slide.landmark_positions()[..., 2] - without.landmark_positions()[..., 2]
        assert np.abs(height[stands]).max() < 5e-3
    assert np.abs(cleaned_hips[:, 2] - hips[:, 2]).max() < 0.01, "the body is back at its height"


@pytest.mark.slow
@pytest.mark.parametrize("part", [0.8, 1.2])
def test_a_walk_whose_travel_is_scaled_keeps_the_bars(floor_walk, part):
    """As of networks and retargets: each foot skates all the time that it stands."""
    curves = action_curves(floor_walk.softground.characters[0].armature.animation_data.action)
    along = max(
        (c for c in curves if c.data_path.endswith("location")), key=lambda c: abs(c.evaluate(48) - c.evaluate(1))
    )
    responders.scale_keys(along, 1.0, add=(part - 1.0) * (along.evaluate(48) - along.evaluate(1)) / 47)
    before = fastest_knee(responders.legs(floor_walk))
    jobs.run(clean_feet(floor_walk))
    check_bars(floor_walk, f"travel x {part}", before)


@pytest.mark.slow
def test_a_mesh_with_bumps_is_a_hard_floor_too(floor_walk):
    bumps = plane(floor_walk, height=lambda x, y: 0.05 * np.sin(3.0 * x) * np.sin(2.5 * y))
    floor_walk.softground.ground = bumps
    before = fastest_knee(responders.legs(floor_walk))
    jobs.run(clean_feet(floor_walk))
    check_bars(floor_walk, "bumps", before)


@pytest.mark.slow
def test_the_panel_lists_no_gap_that_the_summary_does_not_know(floor_walk):
    spoil(floor_walk)
    cleaned = jobs.run(clean_feet(floor_walk))
    notes = notes_of(floor_walk.softground.characters[0].armature, LayerKind.CLEAN_FEET)
    listed = max((abs(gap) for _, gap, _ in response_job.worst_gaps_in(notes)), default=0.0)
    assert listed < cleaned.feet["after"]["Walker"]["float"]["max"] + 0.1


@pytest.mark.slow
def test_clear_bake_gives_the_bytes_back(floor_walk):
    spoil(floor_walk)
    before = fingerprints.of_file()
    bpy.ops.softground.clean_feet()
    assert has_layer(floor_walk.softground.characters[0].armature, LayerKind.CLEAN_FEET)
    assert not floor_walk.softground.grounding.use
    bpy.ops.softground.clear_bake()
    assert fingerprints.of_file() == before


def test_what_is_cancelled_leaves_everything_as_it_was(floor_walk):
    before = fingerprints.of_file()
    job = clean_feet(floor_walk)
    for _ in range(3):
        next(job)
    job.close()
    assert fingerprints.of_file() == before


@pytest.mark.slow
def test_controls_of_ik_legs_are_cleaned(scene):
    responders.with_ik()
    bpy.ops.softground.add_character()
    spoil(scene, floats=0.01)
    before = fastest_knee(responders.legs(scene))
    jobs.run(clean_feet(scene))
    check_bars(scene, "IK legs", before)


def test_a_walk_on_the_spot_is_refused_with_the_remedy(floor_walk):
    armature = floor_walk.softground.characters[0].armature
    path = responders.world_matrices(floor_walk, armature, ["hips"], (1, 48))[:, 0, :3, 3]
    step = np.array(armature.data.bones["hips"].matrix_local)[:3, :3].T @ ((path[1] - path[0]) / 47 * (1, 1, 0))
    for curve in action_curves(armature.animation_data.action):
        if curve.data_path.endswith("location"):
            responders.scale_keys(curve, 1.0, add=-float(step[curve.array_index]))
    floor_walk.frame_set(1)
    before = fingerprints.of_file()
    with pytest.raises(RuntimeError, match=r"walks on the spot.*press Root Motion"):
        bpy.ops.softground.clean_feet()
    assert fingerprints.of_file() == before


def test_what_has_no_feet_is_refused(scene):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.25, location=(0, 0, 0.25))
    bpy.ops.softground.add_character()
    with pytest.raises(RuntimeError, match="feet to clean"):
        bpy.ops.softground.clean_feet()


def test_the_command_line_cleans_a_shot_and_reports_before_and_after(saved_walker, tmp_path):
    report, cleaned = tmp_path / "feet.json", tmp_path / "clean.blend"
    assert cli.run_standalone(["clean", str(saved_walker), "--save", str(cleaned), "--report", str(report)]) == 0
    feet = json.loads(report.read_text(encoding="utf-8"))["feet"]
    assert set(feet) == {"before", "after"}
    for of_one in feet.values():
        assert set(of_one["Walker"]) == {"slide", "float", "penetration"}
        assert all(set(size) == {"p95", "max"} for size in of_one["Walker"].values())
    assert feet["after"]["Walker"]["slide"]["max"] < SLIDE_MAX
    bpy.ops.wm.open_mainfile(filepath=str(cleaned))
    assert has_layer(bpy.context.scene.softground.characters[0].armature, LayerKind.CLEAN_FEET)


def test_the_command_line_refuses_to_clean_for_nothing(saved_walker, capsys):
    assert cli.run_standalone(["clean", str(saved_walker)]) == 2
    assert "--save" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("name", shots.MOTION_FILES)
def test_reference_motions_keep_the_bars(scene, name):
    shots.import_motion(name)
    bpy.ops.softground.add_character()
    before = fastest_knee(responders.legs(scene))
    jobs.run(clean_feet(scene))
    check_bars(scene, name, before)


@pytest.mark.slow
def test_knees_keep_the_pace_of_a_fast_run_whose_feet_are_stopped(scene):
    """On a treadmill at 4 m/s: what slows one knee makes another too fast, many times over."""
    shots.import_file(shots.MotionFile("gait/hamner04_run400.bvh", 0.01, "-Z", "Y"))
    bpy.ops.softground.add_character()
    before = fastest_knee(responders.legs(scene))
    jobs.run(clean_feet(scene))
    check_bars(scene, "run at 4 m/s", before)


def lock_contact(scene, mode, **options):
    """A foot lock on the contact of the foot that is lowest in a frame, as the panel's button adds it."""
    scene.frame_set(20)
    assert bpy.ops.softground.add_foot_lock() == {"FINISHED"}
    hold = scene.softground.characters[0].holds[-1]
    hold.mode = mode
    for name, value in options.items():
        setattr(hold, name, value)
    return hold


def sole_in_contact(scene, hold):
    """The held foot on the rig, in the frames of the held contact."""
    shot, touching = read(scene)
    moved, _ = on_the_rig(scene, shot.motions[0])
    number = next(i for i, sole in enumerate(moved.soles) if sole.sole.name == hold.foot)
    starts, ends = runs(touching[:, number])
    at = np.searchsorted(starts, np.abs(moved.frames - hold.frame).argmin(), side="right") - 1
    return moved.soles[number], slice(starts[at], ends[at])


@pytest.mark.slow
def test_a_contact_is_locked_as_a_whole_on_the_rig(floor_walk):
    spoil(floor_walk)
    hold = lock_contact(floor_walk, "FULL")
    assert bpy.ops.softground.clean_feet() == {"FINISHED"}
    sole, during = sole_in_contact(floor_walk, hold)
    places = sole.transforms[during, 0, :3, 3]
    assert np.linalg.norm(places - places[0], axis=1).max() < 1e-3
    assert np.abs(sole.transforms[during, 0, :3, :3] - sole.transforms[during.start, 0, :3, :3]).max() < 5e-3


@pytest.mark.slow
def test_a_contact_without_strength_is_left_as_it_was_animated(floor_walk):
    spoil(floor_walk)
    hold = lock_contact(floor_walk, "FLAT", strength=0.0)
    before, during = sole_in_contact(floor_walk, hold)
    bpy.ops.softground.clean_feet()
    after, _ = sole_in_contact(floor_walk, hold)
    assert np.abs(after.transforms[during] - before.transforms[during]).max() < 1e-3


@pytest.mark.slow
def test_a_foot_lock_leaves_a_bake_as_it_is(floor_walk):
    now = settings.snapshot(floor_walk)
    lock_contact(floor_walk, "BALL")
    assert settings.snapshot(floor_walk) != now
    assert settings.snapshot(floor_walk).inputs(Acts.WRITING) == now.inputs(Acts.WRITING)


def test_a_foot_lock_where_no_foot_stands_is_told(floor_walk):
    hold = lock_contact(floor_walk, "HEEL")
    hold.frame = 5000
    cleaned = jobs.run(clean_feet(floor_walk))
    assert cleaned.warnings == (f"'{hold.foot}' of 'Walker' is not planted at frame 5000: its foot lock was ignored.",)


def test_the_selected_bone_says_which_foot_is_locked_and_a_lock_is_removed(floor_walk):
    armature = floor_walk.softground.characters[0].armature
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="POSE")
    for sole in floor_walk.softground.characters[0].soles:
        armature.data.bones.active = armature.data.bones[sole.bone]
        assert lock_contact(floor_walk, "ROLL").foot == sole.name
    bpy.ops.object.mode_set(mode="OBJECT")
    character = floor_walk.softground.characters[0]
    bpy.ops.softground.remove_foot_lock()
    assert [hold.foot for hold in character.holds] == [character.soles[0].name]
    bpy.ops.softground.remove_foot_lock()
    assert not bpy.ops.softground.remove_foot_lock.poll()


def test_a_character_without_feet_takes_no_foot_lock(floor_walk):
    floor_walk.softground.characters[0].soles.clear()
    with pytest.raises(RuntimeError, match="has no foot with a bone"):
        bpy.ops.softground.add_foot_lock()
    assert not floor_walk.softground.characters[0].holds


def test_a_bone_that_is_gone_is_named(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.characters[0].joints["hips"].bone = "Pelvis"
    with pytest.raises(InputError, match="'Walker' has no bone 'Pelvis'"):
        jobs.run(clean_feet(scene))


def test_feet_that_hang_on_the_root_find_their_legs(scene):
    """As in game rigs whose IK was baked, whatever the bones are called."""
    armature = shots.walker(scene)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bones = armature.data.edit_bones
    numbers = {bone.name: f"b{number}" for number, bone in enumerate(bones)}
    for side in "LR":
        bones[f"foot.{side}"].parent = None
    for bone in bones:
        bone.name = numbers[bone.name]
    bpy.ops.object.mode_set(mode="OBJECT")
    feet = [numbers["foot.R"], numbers["foot.L"]]
    assert legs_of_feet(armature, feet) == {
        f"{joint}_{side.lower()}": (numbers[f"{bone}.{side}"], "head")
        for side in "LR"
        for joint, bone in (("hip", "thigh"), ("knee", "shin"), ("ankle", "foot"))
    }
    assert legs_of_feet(armature, [numbers["hips"]]) == {}


def without_feet(scene):
    """The walker as a figure of blocks, whose shins carry the feet: its bones under names that say nothing."""
    armature = shots.walker(scene)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bones = armature.data.edit_bones
    for bone in [bone for bone in bones if bone.name.split(".")[0] in ("foot", "toe")]:
        bones.remove(bone)
    numbers = {bone.name: f"b{number}" for number, bone in enumerate(bones)}
    for bone in bones:
        bone.name = numbers[bone.name]
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature, numbers


def test_legs_that_end_in_shins_are_found_by_the_bones_on_which_they_stand(scene):
    armature, numbers = without_feet(scene)
    legs = {
        f"{joint}_{side.lower()}": (numbers[f"{bone}.{side}"], "head")
        for side in "LR"
        for joint, bone in (("hip", "thigh"), ("knee", "shin"))
    }
    shins, hands = ([numbers[f"{bone}.{side}"] for side in "RL"] for bone in ("shin", "hand"))
    assert legs_on_shins(armature, shins) == legs
    assert legs_on_shins(armature, shins[:1]) == legs, "whichever of them stands"
    assert legs_on_shins(armature, [numbers["hips"], *hands]) == {}


def test_what_goes_on_below_is_no_shin_on_which_a_leg_ends(scene):
    assert legs_on_shins(shots.walker(scene), ["shin.L", "shin.R"]) == {}


@pytest.mark.slow
def test_legs_that_end_in_shins_are_keyed_by_their_bones_and_not_by_ik_that_cannot_turn_them(scene):
    armature, numbers = without_feet(scene)
    legs = legs_on_shins(armature, [numbers["shin.L"], numbers["shin.R"]])
    mapping = RigMapping({"hips": (numbers["hips"], "head"), **legs})
    parts = {f"{part}_{side}" for part in ("thigh", "shank") for side in "lr"}
    assert {control.part for control in controls_of(scene.view_layers[0], armature, mapping)} == {"body", *parts}
    for side in "LR":
        ik = armature.pose.bones[numbers[f"shin.{side}"]].constraints.new("IK")
        ik.target, ik.subtarget, ik.chain_count = armature, numbers[f"hand.{side}"], 2
    bpy.context.view_layer.update()
    assert {control.part for control in controls_of(scene.view_layers[0], armature, mapping)} == {"body"}


RIGS = shots.SHARED / "rigs"


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "fox_walk",
        "rat_walk",
        "trex_run",
        "trex_idle",
        "scifi_walk",
        "robot_run",
        "rogue_walk",
        "bandai_walk",
        "cmu_walk",
        "boxman_idle",
        "boxman_run",
    ],
)
def test_rigs_of_other_people_keep_the_bars(scene, tmp_path, name):
    if not RIGS.exists():
        pytest.skip("the rigs of other people are not here: see docs/development.md")
    clips = json.loads((RIGS / "rigs.json").read_text(encoding="utf-8"))
    spec = importlib.util.spec_from_file_location("zoo", RIGS.parents[1] / "tools" / "zoo.py")
    zoo = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(zoo)
    shot, report = tmp_path / "shot.blend", tmp_path / "feet.json"
    zoo.imported(next(clip for clip in clips if clip["clip"] == name), RIGS, shot)
    asked = ["clean", str(shot), "--save", str(tmp_path / "clean.blend"), "--report", str(report)]
    assert 0 in (cli.run_standalone(asked), cli.run_standalone([*asked, "--root-motion"])), "one or the other"
    for feet in json.loads(report.read_text(encoding="utf-8"))["feet"]["after"].values():
        assert feet["slide"]["p95"] < SLIDE_95
        assert feet["slide"]["max"] < SLIDE_MAX
        assert feet["float"]["p95"] < GAP_95
        assert feet["penetration"]["p95"] < GAP_95
