"""The response on real rigs: it does what was computed, and the user's animation is as it was."""

import json

import bpy
import numpy as np
import pytest

from softground_addon.blender import settings
from softground_addon.blender.animation_layer.constraint_layer import LayerKind, has_layer, notes_of
from softground_addon.blender.compat import action_curves, set_slot, slot_of
from softground_addon.blender.panels import response_panel
from softground_addon.blender.response import response_job
from softground_addon.blender.response.character_keys import controls_of
from softground_addon.blender.sampling import rig_recording
from softground_addon.core.dynamics.centre_of_mass import centre_of_mass
from softground_addon.core.errors import InputError
from softground_addon.core.ground.heightfield import FlatTerrain
from tests.blender import auto_rig_pro, fingerprints, responders, rigs, shots


def set_up(armature):
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    return bpy.context.scene.softground.characters[0]


def flat(scene):
    ground = scene.softground.ground
    return FlatTerrain(ground.matrix_world.translation.z)


def rigify(path):
    armature = rigs.open_rigify(path, "Generated")
    responders.key_steps(armature, "torso", ["foot_ik.L", "foot_ik.R"])
    bpy.data.objects.remove(bpy.data.objects["Metarig"])
    return armature


MAKE = {
    "walker": shots.walker,
    "mixamo": lambda scene: responders.as_mixamo(shots.walker(scene)),
    "scale of 0.01": lambda scene: responders.in_centimetres(shots.walker(scene)),
    "animated object": lambda scene: responders.moved_by_its_object(shots.walker(scene)),
    "feet on a root": lambda scene: responders.with_feet_on_a_root(shots.walker(scene)),
    "ik": lambda scene: responders.with_ik(),
    "auto-rig pro": lambda scene: auto_rig_pro.walking(),
}

QUICK = ("feet on a root", "ik")
QUICK_AND_SLOW = [rig if rig in QUICK else pytest.param(rig, marks=pytest.mark.slow) for rig in (*MAKE, "rigify")]


@pytest.fixture
def armature(scene, request):
    """A rig that walks."""
    if request.param == "rigify":
        return rigify(request.getfixturevalue("rigify_file"))
    return MAKE[request.param](scene)


@pytest.mark.slow
@pytest.mark.parametrize("armature", QUICK_AND_SLOW, indirect=True)
def test_soles_stand_on_the_ground_that_they_pressed(armature):
    scene = bpy.context.scene
    set_up(armature)
    before = responders.knee_angles(scene)
    result = responders.bake(scene)
    assert len(result.report["steps"]) >= 4
    gaps = np.abs(responders.gaps_on_the_rig(scene, result, flat(scene))) * 1e3
    assert np.percentile(gaps, 95) < 2.0
    assert gaps.max() < 5.0
    sunk = result.report["gaps_mm"]["before"][armature.name]["float"]["p95"]
    assert sunk > 10.0, "the ground gives way by centimetres, so that feet must follow it"
    rate = scene.render.fps / 30
    jump, source_jump = (
        np.abs(np.diff(angles, axis=0)).max() * rate for angles in (responders.knee_angles(scene), before)
    )
    assert jump < max(15.0, 1.2 * source_jump)


@pytest.mark.slow
@pytest.mark.parametrize(("rig", "times"), [("walker", 0), ("ik", 1)])
def test_a_rig_is_evaluated_once_for_its_motion_and_its_response_or_not_at_all(scene, monkeypatch, rig, times):
    armature, entered = MAKE[rig](scene), []
    set_up(armature)
    sampling_scene = rig_recording.sampling_scene

    def counted(*arguments, **options):
        entered.append(arguments)
        return sampling_scene(*arguments, **options)

    monkeypatch.setattr(rig_recording, "sampling_scene", counted)
    responders.bake(scene)
    assert has_layer(armature)
    assert len(entered) == times


def test_auto_rig_pro_is_keyed_on_what_its_animators_key_in_ik_and_in_fk(scene):
    armature = auto_rig_pro.walking()
    set_up(armature)
    mapping = responders.mapping_of(scene.softground.characters[0])
    assert [source.bone for source in mapping.soles][:2] == ["foot.l", "foot.r"]
    by_ik = {control.bone for control in controls_of(scene.view_layers[0], armature, mapping)}
    assert by_ik >= {"c_root_master.x", "c_foot_ik.l", "c_foot_ik.r"}
    assert not [bone for bone in by_ik if "fk" in bone]
    auto_rig_pro.switch_to_fk(armature)
    by_fk = {control.bone for control in controls_of(scene.view_layers[0], armature, mapping)}
    legs = {f"c_{part}_fk.{side}" for part in ("thigh", "leg", "foot") for side in "lr"}
    assert by_fk >= {"c_root_master.x", *legs}
    assert not [bone for bone in by_fk if "_ik" in bone]


@pytest.mark.parametrize("armature", ["walker", "ik", pytest.param("rigify", marks=pytest.mark.slow)], indirect=True)
def test_the_users_keys_pose_and_constraints_are_the_same_bytes_after_clearing(armature):
    scene = bpy.context.scene
    set_up(armature)
    armature["custom"] = 3.5
    scene.frame_set(20)
    before = fingerprints.of_file()
    responders.bake(scene, output="RESPONSE")
    baked = fingerprints.of_file()
    for action, content in before["actions"].items():
        assert baked["actions"][action] == content
    assert baked["objects"][armature.name]["action"] == before["objects"][armature.name]["action"]
    assert baked["objects"][armature.name]["nla"] == before["objects"][armature.name]["nla"]
    bpy.ops.softground.clear_bake()
    scene.frame_set(20)
    assert fingerprints.of_file() == before


def test_clearing_takes_the_response_off_a_character_that_has_left_the_list(scene):
    armature = shots.walker(scene, frames=30)
    scene.frame_set(1)
    before = fingerprints.of_object(armature)
    set_up(armature)
    responders.bake(scene, output="RESPONSE")
    bpy.ops.softground.remove_character()
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    scene.frame_set(1)
    assert fingerprints.of_object(armature) == before


@pytest.mark.slow
def test_without_influence_every_bone_is_where_it_was_to_the_last_bit(scene):
    armature = shots.walker(scene)
    character = set_up(armature)
    bones = [bone.name for bone in armature.pose.bones]
    frames = range(1, 73, 7)
    before = responders.world_matrices(scene, armature, bones, frames)
    responders.bake(scene)
    assert np.abs(responders.world_matrices(scene, armature, bones, frames) - before).max() > 0.01
    character.response_strength = 0.0
    assert responders.world_matrices(scene, armature, bones, frames) == pytest.approx(before, abs=1e-6)
    character.response_strength = 1.0
    bpy.data.objects.remove(bpy.data.objects[LayerKind.RESPONSE.value])
    assert responders.world_matrices(scene, armature, bones, frames) == pytest.approx(before, abs=1e-6)


@pytest.mark.slow
def test_the_strength_scales_the_response_from_none_to_twice_without_a_bake(scene):
    armature = shots.walker(scene)
    character = set_up(armature)
    responders.bake(scene)
    heights = {}
    for strength in (0.0, 0.5, 1.0, 1.5, 2.0):
        character.response_strength = strength
        heights[strength] = responders.world_matrices(scene, armature, ["hips"], [40])[0, 0, 2, 3]
    sunk = heights[1.0] - heights[0.0]
    assert sunk < -0.01
    for strength, height in heights.items():
        assert height - heights[0.0] == pytest.approx(strength * sunk, rel=0.02, abs=1e-5)


@pytest.mark.slow
def test_baking_again_replaces_the_layer_and_reads_the_animation_without_it(scene):
    armature = shots.walker(scene)
    set_up(armature)
    first = responders.bake(scene).report
    constraints = fingerprints.of_object(armature)["bones"]
    actions = sorted(action.name for action in bpy.data.actions)
    second = responders.bake(scene).report
    assert second["gaps_mm"]["before"] == first["gaps_mm"]["before"]
    assert {name: len(bone[2]) for name, bone in fingerprints.of_object(armature)["bones"].items()} == {
        name: len(bone[2]) for name, bone in constraints.items()
    }
    assert sorted(action.name for action in bpy.data.actions) == actions


@pytest.mark.slow
@pytest.mark.parametrize("nla", ["strips alone", "off", "solo", "tweak", "tracks named like layers"])
def test_whatever_the_users_nla_is_like_feet_sink_and_clear_gives_it_back(scene, nla):
    armature = shots.walker(scene)
    set_up(armature)
    animation = armature.animation_data
    action, slot = animation.action, slot_of(animation)
    if nla == "off":
        animation.use_nla = False
    else:
        names = {"tracks named like layers": ("SoftGround Response", "SoftGround Source")}.get(nla, ("Mine",))
        for name in names:
            track = animation.nla_tracks.new()
            track.name = name
            set_slot(track.strips.new("mine", 1, action), slot)
        animation.action = None
        track.is_solo = nla == "solo"
        if nla == "tweak":
            track.select = track.strips[0].select = True
            animation.nla_tracks.active = track
            animation.use_tweak_mode = True
            if not animation.use_tweak_mode:
                pytest.skip("this Blender enters tweak mode from its editor only")
    scene.frame_set(20)
    before = fingerprints.of_file()
    result = responders.bake(scene, output="RESPONSE")
    gaps = np.abs(responders.gaps_on_the_rig(scene, result, FlatTerrain(0.0))) * 1e3
    assert np.percentile(gaps, 95) < 2.0
    bpy.ops.softground.clear_bake()
    scene.frame_set(20)
    assert fingerprints.of_file() == before


@pytest.mark.slow
def test_outside_its_frames_the_layer_does_nothing(scene):
    armature = shots.walker(scene)
    set_up(armature)
    before = responders.world_matrices(scene, armature, ["hips", "foot.L"], [5, 65])
    responders.bake(scene, frame_start=10, frame_end=60)
    assert responders.world_matrices(scene, armature, ["hips", "foot.L"], [5, 65]) == pytest.approx(before, abs=1e-6)


@pytest.mark.slow
def test_prints_only_leaves_the_character_and_response_only_leaves_the_ground(scene):
    armature = shots.walker(scene)
    set_up(armature)
    responders.bake(scene, output="PRINTS")
    assert not has_layer(armature)
    assert scene.softground.ground is not None
    ground = fingerprints.of_mesh(scene.softground.ground.data)
    responders.bake(scene, output="RESPONSE")
    assert has_layer(armature)
    assert fingerprints.of_mesh(scene.softground.ground.data) == ground


@pytest.mark.slow
def test_a_linked_rig_is_refused_with_a_remedy_and_untouched(scene, tmp_path):
    armature = responders.linked_walker(tmp_path)
    set_up(armature)
    before = fingerprints.of_file()
    with pytest.raises(InputError, match=r"'Walker' is linked.*library override"):
        responders.bake(bpy.context.scene)
    assert fingerprints.of_file() == before


@pytest.mark.slow
def test_an_override_of_a_linked_character_responds(scene, tmp_path):
    shots.walker(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "asset.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "asset.blend"), link=True) as (_, wanted):
        wanted.objects = ["Walker"]
    scene = bpy.context.scene
    scene.render.fps = 24
    linked = wanted.objects[0]
    armature = linked.override_create()
    scene.collection.objects.link(armature)
    set_up(armature)
    before = responders.world_matrices(scene, armature, ["hips", "foot.L"], [10, 40])
    result = responders.bake(scene)
    gaps = np.abs(responders.gaps_on_the_rig(scene, result, flat(scene))) * 1e3
    assert np.percentile(gaps, 95) < 2.0
    bpy.ops.softground.clear_bake()
    assert responders.world_matrices(scene, armature, ["hips", "foot.L"], [10, 40]) == pytest.approx(before, abs=1e-6)


@pytest.mark.slow
def test_the_layer_notes_its_root_control_and_worst_frames(scene):
    armature = shots.walker(scene)
    set_up(armature)
    result = responders.bake(scene)
    notes = notes_of(armature)
    assert notes[response_job.ROOT_CONTROL] == "hips"
    assert json.loads(notes[response_job.WORST]) == result.report["worst_gaps"]
    bpy.ops.softground.show_frame(frame=17.0)
    assert scene.frame_current == 17


def test_tilt_presets_set_the_papers_gains_for_the_characters_mass(scene):
    character = set_up(shots.walker(scene))
    tilt = scene.softground.tilt
    bpy.ops.softground.tilt_preset(source="AUTHORS")
    assert 0.5 < tilt.frequency < 0.75
    assert 0.7 < tilt.damping < 1.0
    bpy.ops.softground.tilt_preset(source="PAPER")
    assert 1 / tilt.frequency > 8
    light = tilt.frequency
    character.mass *= 4
    bpy.ops.softground.tilt_preset(source="PAPER")
    assert tilt.frequency == pytest.approx(light / 2, rel=1e-3)
    bpy.ops.softground.tilt_preset(source="DEFAULT")
    assert (tilt.frequency, tilt.damping) == pytest.approx((0.6, 0.85))


def test_tilt_presets_swing_the_body_about_its_own_centre_of_mass(scene):
    armature = shots.walker(scene)
    set_up(armature)
    motion, tilt = responders.source_motion(scene), scene.softground.tilt
    ratio = response_panel.CENTRE_HEIGHT * motion.stature / np.mean(centre_of_mass(motion)[:, 2])
    assert ratio == pytest.approx(1.0, abs=0.03)
    bpy.ops.softground.tilt_preset(source="PAPER")
    frequency, damping = tilt.frequency, tilt.damping
    armature.scale = (4.0, 4.0, 4.0)
    bpy.context.view_layer.update()
    bpy.ops.softground.tilt_preset(source="PAPER")
    # the inertia grows with the square of the arm, the torque with the arm
    assert tilt.frequency == pytest.approx(frequency / 2, rel=1e-3)
    assert tilt.damping == pytest.approx(damping / 8, rel=1e-3)


def test_tilt_presets_are_not_for_a_body_without_mass(scene):
    set_up(shots.walker(scene)).mass = 0.0
    assert not bpy.ops.softground.tilt_preset.poll()


@pytest.mark.slow
def test_acting_raises_the_arms_or_the_knees_on_the_rig(scene):
    set_up(shots.walker(scene))
    scene.softground.material.youngs_modulus = 5e4
    grounding = scene.softground.grounding
    joints = dict(responders.mapping_of(scene.softground.characters[0]).joints)
    bones = [joints[joint][0] for joint in ("wrist_l", "wrist_r", "shoulder_l", "shoulder_r")]

    def acted(**acting):
        """Wrists apart (N,), shoulders (N, 2, 3), the most bent knee and the report, with that acting and no other."""
        grounding.arms, grounding.knee_lift = acting.get("arms", 0.0), acting.get("knee_lift", 0.0)
        result = responders.bake(scene, tilt=False)
        armature = scene.softground.characters[0].armature
        points = responders.world_matrices(scene, armature, bones, range(20, 60, 4))[..., :3, 3]
        apart = np.linalg.norm((points[:, 0] - points[:, 1])[:, :2], axis=1)
        return apart, points[:, 2:], responders.knee_angles(scene).max(), result.report

    apart, shoulders, knees, _ = acted()
    apart_with_arms, shoulders_with_arms, knees_with_arms, _ = acted(arms=1.0)
    assert (apart_with_arms > apart + 0.1).all()
    assert shoulders_with_arms == pytest.approx(shoulders, abs=1e-3)
    assert knees_with_arms == pytest.approx(knees, abs=1e-3)
    apart_with_lift, _, knees_with_lift, report = acted(knee_lift=1.0)
    assert apart_with_lift == pytest.approx(apart, abs=1e-3)
    assert knees_with_lift > knees
    assert 0.8 < report["suggested_speed"]["Walker"] < 0.95


@pytest.mark.slow
def test_slowing_down_stretches_time_and_the_response_still_fits(scene):
    set_up(shots.walker(scene))
    result = responders.bake(scene)
    bpy.ops.softground.slow_down()
    stretch = scene.render.frame_map_new / scene.render.frame_map_old
    assert stretch == pytest.approx(1 / result.report["suggested_speed"]["Walker"], abs=0.01)
    result = responders.bake(scene)
    gaps = np.abs(responders.gaps_on_the_rig(scene, result, flat(scene))) * 1e3
    assert np.percentile(gaps, 95) < 2.0
    assert gaps.max() < 5.0


@pytest.mark.parametrize("mapping", [(100, 100), (100, 200), (1, 2), (200, 100), (1, 12), (900, 1)])
def test_slowing_down_keeps_the_users_own_time_and_is_the_same_twice(scene, mapping):
    set_up(shots.walker(scene))
    render = scene.render
    render.frame_map_old, render.frame_map_new = mapping
    for _ in range(2):
        settings.slow_down(scene, 0.8)
        slowed = render.frame_map_new / render.frame_map_old
        assert slowed == pytest.approx(mapping[1] / mapping[0] / 0.8, rel=0.01, abs=0.01)
    render.frame_map_old, render.frame_map_new = 100, 50  # the user's hand again
    settings.slow_down(scene, 0.5)
    assert render.frame_map_new / render.frame_map_old == pytest.approx(1.0)


@pytest.mark.slow
def test_cyclic_keys_go_on_beyond_their_end_as_before(scene):
    armature = shots.walker(scene)
    set_up(armature)
    for curve in action_curves(armature.animation_data.action):
        curve.modifiers.new("CYCLES")
    before = responders.world_matrices(scene, armature, ["hips", "foot.L"], [-30, 200, 500])
    responders.bake(scene)
    now = responders.world_matrices(scene, armature, ["hips", "foot.L"], [-30, 200, 500])
    assert now == pytest.approx(before, abs=1e-5)
