"""Ground far from the origin, and turned ground under turned gravity, are baked as level ground at the origin is."""

import re
from math import pi

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector

from sample_scenes import stage
from sample_scenes.body import Body
from sample_scenes.gait import Gait, walk
from softground_addon.blender import jobs, session
from softground_addon.blender.baking import bake_job, bake_report, step_edits
from softground_addon.blender.characters.prop_setup import add_props
from softground_addon.blender.compat import action_curves
from softground_addon.blender.debris import debris_object
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.live import live
from softground_addon.blender.output import sound_exports
from softground_addon.blender.placement import in_scene
from softground_addon.blender.playback import own_data
from softground_addon.blender.reading import analysis
from softground_addon.blender.settings import snapshot
from softground_addon.blender.state import state
from softground_addon.blender.viewport import overlay
from softground_addon.core.errors import InputError
from softground_addon.core.events.events import LANDINGS
from softground_addon.core.record.edits import StepEdit
from tests.blender.baking.test_props import ball, dropped_path, key_path
from tests.blender.ground.test_hard_ground import box
from tests.blender.grounds import as_rendered, bake, field
from tests.blender.response.test_root_motion import FRAMES, on_the_spot

MAP = (548000.0, 5932000.0, 0.0)
WHERE = {
    "on_a_map": Matrix.Translation(MAP),
    "on_a_wall": Matrix.Rotation(pi / 2, 4, "X"),
    "askew_on_a_map": Matrix.Translation(MAP) @ Euler((1.0, -2.0, 0.5)).to_matrix().to_4x4(),
}


def moved(scene, matrix):
    """Move a scene as a whole, and turn its gravity with it."""
    for obj in scene.objects:
        if obj.parent is None:
            obj.matrix_basis = matrix @ obj.matrix_basis
    scene.gravity = matrix.to_3x3() @ scene.gravity
    bpy.context.view_layer.update()


def hung_up(scene, place_of_all=(0, 0, 0)):
    """Hang a whole scene on an empty at some place."""
    place = bpy.data.objects.new("Place", None)
    for obj in scene.objects:
        if obj.parent is None:
            obj.parent = place
    scene.collection.objects.link(place)
    place.location = place_of_all
    bpy.context.view_layer.update()


def posed(scene):
    """Heads of the bones in the armature's space over the walk, (F, B, 3)."""
    rig, heads = scene.softground.characters[0].armature, []
    for frame in range(1, 31, 4):
        scene.frame_set(frame)
        shown = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
        heads.append([bone.head[:] for bone in shown.pose.bones])
    return np.array(heads)


@pytest.mark.parametrize(("where", "parented"), [("on_a_map", False), ("on_a_wall", False), ("askew_on_a_map", True)])
def test_a_bake_is_the_same_wherever_the_shot_is(short_walk, where, parented):
    scene = short_walk
    field(scene)
    if parented:
        hung_up(scene)
    before = bake(scene).footprints
    bpy.ops.softground.clear_bake()
    moved(scene, WHERE[where])
    now = bake(scene).footprints
    assert len(now) == len(before) == 3
    for here, then in zip(now, before, strict=True):
        assert here.position == pytest.approx(then.position, abs=1e-5)
        assert here.max_depth_m == pytest.approx(then.max_depth_m, abs=1e-5)
    assert bake_report.stale_reasons(scene) == ()


def test_feet_are_let_down_into_prints_on_a_wall_as_on_level_ground(short_walk):
    field(short_walk)
    bake(short_walk, sink_feet=True)
    feet = posed(short_walk)
    bpy.ops.softground.clear_bake()
    assert np.abs(posed(short_walk) - feet).max() > 0.02
    moved(short_walk, WHERE["on_a_wall"])
    bake(short_walk)
    assert posed(short_walk) == pytest.approx(feet, abs=2e-4)


def test_feet_stay_as_they_are_where_blender_would_round_their_layer(short_walk):
    field(short_walk)
    moved(short_walk, WHERE["on_a_map"])
    report = bake(short_walk, sink_feet=True).report
    assert any("Feet were not lowered" in text and "0.5 units" in text for text in report["warnings"])


def test_steps_events_and_what_is_thrown_are_told_where_they_are_in_the_world(short_walk):
    ground = field(short_walk)
    short_walk.softground.debris = True
    before, wall = bake(short_walk), WHERE["on_a_wall"]
    bpy.context.view_layer.update()
    pieces = debris_object.of(ground)
    middle = pieces.matrix_world @ Vector(pieces.data.vertices[0].co)
    bpy.ops.softground.clear_bake()
    moved(short_walk, wall)
    now = bake(short_walk)
    bpy.context.view_layer.update()
    for table in ("steps", "events"):
        for here, then in zip(now.report[table], before.report[table], strict=True):
            assert here["position"] == pytest.approx(wall @ Vector(then["position"]), abs=2e-5)
    assert baked_ground.events_of(ground)[0]["normal"] == pytest.approx(wall @ Vector((0, 0, 1)), abs=1e-4)
    pieces = debris_object.of(ground)
    assert (pieces.matrix_world @ Vector(pieces.data.vertices[0].co))[:] == pytest.approx((wall @ middle)[:], abs=1e-4)


def test_a_ground_is_created_under_a_walk_on_a_wall_that_is_far_away(short_walk):
    before = bake(short_walk)
    deepest = before.report["totals"]["max_depth_m"]
    ground = short_walk.softground.ground
    bpy.data.objects.remove(ground)
    moved(short_walk, Matrix.Translation(MAP) @ WHERE["on_a_wall"])
    now = bake(short_walk)
    assert now.report["totals"]["max_depth_m"] == pytest.approx(deepest, rel=1e-2)
    assert short_walk.softground.ground.matrix_world.col[2][:3] == pytest.approx((0, -1, 0), abs=1e-6)


def deck(scene, *, keyed=(), cell=0.02):
    """A walk on a field that both hang from a ship, which is keyed at each frame by a function of the time [s]."""
    field(scene)
    scene.softground.cell_size = cell
    hung_up(scene)
    ship = bpy.data.objects["Place"]
    if keyed:
        for frame in range(-23, 61):
            ship.location, ship.rotation_euler = keyed(frame / 24)
            ship.keyframe_insert("location", frame=frame)
            ship.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(1)
    return ship


def still(_time):
    return (0, 0, 0), (0, 0, 0)


def sailing(time):
    return (6 * time, 2 * time, 0), (0, 0, 0)


def rising(time):
    return (0, 0, time * time), (0, 0, 0)


@pytest.mark.parametrize(("keyed", "away"), [(still, False), (sailing, False), (sailing, True)])
def test_prints_on_a_deck_that_is_still_or_sails_evenly_are_those_without_a_deck(short_walk, keyed, away):
    deck(short_walk)
    if away:
        hung_up(short_walk, MAP)
    before = bake(short_walk).footprints
    bpy.ops.softground.clear_bake()
    ship = bpy.data.objects["Place"]
    for frame in range(-23, 61):
        ship.location = keyed(frame / 24)[0]
        ship.keyframe_insert("location", frame=frame)
    short_walk.frame_set(1)
    now = bake(short_walk).footprints
    for here, then in zip(now, before, strict=True):
        of_both = ((*step.position, step.max_depth_m, step.compressed_m3) for step in (here, then))
        assert next(of_both) == (next(of_both) if keyed is still else pytest.approx(next(of_both), rel=1e-6, abs=1e-7))
    assert bake_report.stale_reasons(short_walk) == ()
    short_walk.frame_set(20)
    assert bake_report.stale_reasons(short_walk) == ()


def test_prints_sail_along_with_the_deck(short_walk):
    deck(short_walk, keyed=sailing)
    bake(short_walk)
    shown = baked_ground.display_mesh_of(short_walk.softground.ground)
    short_walk.frame_set(30)
    low = as_rendered(shown)[:, 2].argmin()
    short_walk.frame_set(54)
    later = as_rendered(shown)[low]
    short_walk.frame_set(30)
    assert later - as_rendered(shown)[low] == pytest.approx((6, 2, 0), abs=1e-4)


def rolling(time):
    return (2 * time, 0.5 * time, 0.1 * np.sin(time)), (0.1 * np.sin(2 * time), 0, 0.2 * time)


def picture(scene, frame, path):
    """What the camera sees at a frame, (24, 24)."""
    scene.frame_set(frame)
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels[:]).reshape(24, 24, 4)[..., 0]
    bpy.data.images.remove(image)
    return pixels


@pytest.mark.slow
def test_a_look_goes_along_with_the_ground_and_is_gone_with_the_bake(short_walk, tmp_path):
    ship = deck(short_walk, keyed=rolling)
    ground, before = short_walk.softground.ground, set(short_walk.softground.ground.data.keys())
    bpy.ops.softground.load_preset(name="soil")
    bake(short_walk)
    bpy.ops.softground.apply_look()
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    short_walk.collection.objects.link(camera)
    camera.parent, camera.location, short_walk.camera = ship, (1.2, 0.5, 0.5), camera
    world = short_walk.world = bpy.data.worlds.new("Sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 60.0
    render, cycles = short_walk.render, short_walk.cycles
    render.engine, cycles.samples, cycles.use_denoising, cycles.max_bounces = "CYCLES", 4, False, 0
    render.resolution_x = render.resolution_y = 24
    render.image_settings.file_format = "PNG"
    first, later = (picture(short_walk, frame, tmp_path / "seen.png") for frame in (1, 50))
    assert first.std() > 0.01
    mesh = baked_ground.display_mesh_of(ground).data
    for name in own_data.FRAME:
        del mesh[name]
    mesh.update_tag()
    sliding = picture(short_walk, 50, tmp_path / "seen.png")
    assert np.median(np.abs(later - first)) < 0.2 * np.median(np.abs(sliding - first))
    bake(short_walk)
    assert set(own_data.FRAME) <= set(baked_ground.display_mesh_of(ground).data.keys())
    bpy.ops.softground.clear_bake()
    assert set(ground.data.keys()) == before


def test_a_lift_that_speeds_up_presses_prints_deeper(short_walk):
    deck(short_walk)
    before = bake(short_walk).report["events"]
    bpy.ops.softground.clear_bake()
    bpy.data.objects.remove(bpy.data.objects["Place"])
    bpy.data.objects.remove(short_walk.softground.ground)
    deck(short_walk, keyed=rising)
    now = bake(short_walk).report["events"]
    added = 2 / 9.81
    for here, then in zip(now, before, strict=True):
        if then["peak_bw"] > 1.0 and then["phase"] == "foot_flat":
            assert here["peak_bw"] == pytest.approx(then["peak_bw"] + added, abs=0.02)


def test_steps_on_a_crate_that_rides_along_stand_on_it(short_walk):
    deck(short_walk, keyed=sailing)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, -0.8, -0.01))
    crate = bpy.context.object
    crate.scale = (1, 0.5, 0.02)
    crate.parent = bpy.data.objects["Place"]
    bpy.context.view_layer.update()
    short_walk.softground.hard_grounds.add().object = crate
    steps = bake(short_walk).footprints
    assert [step for step in steps if abs(step.position[1] + 0.8) < 0.1] == []
    assert len(steps) == 2
    crate.parent = None
    with pytest.raises(InputError, match="'Cube' in Hard Ground stands still while 'Place' moves the ground"):
        bake(short_walk)


@pytest.mark.parametrize("where", ["sails", "on_a_map"])
def test_hard_steps_are_heard_from_where_they_are_in_the_world(short_walk, tmp_path, monkeypatch, where):
    deck(short_walk, keyed=sailing if where == "sails" else ())
    crate = box(short_walk, "Crate", 0.004, y=(-1.1, -0.5), x=(-0.5, 0.5), bottom=-0.1)
    crate.parent = bpy.data.objects["Place"]
    stage.add_camera(short_walk, "Ear", 50.0)
    short_walk.camera = bpy.data.objects["Ear"]
    if where != "sails":
        moved(short_walk, WHERE[where])
    bpy.context.view_layer.update()
    short_walk.softground.hard_grounds.add().object = crate
    bake(short_walk)
    ground, seen = short_walk.softground.ground, []
    monkeypatch.setattr(sound_exports, "in_scene", lambda *args: seen.append(in_scene(*args)) or seen[-1])
    sound_exports.write(short_walk, tmp_path / "steps.wav", 1, 30, stereo=True)
    landings = [row for row in baked_ground.events_of(ground) if row["phase"] in LANDINGS]
    assert "hard" in {row["surface"] for row in landings}
    for row in (row for row in landings if row["surface"] == "hard"):
        short_walk.frame_set(int(row["frame"]))
        there = [other["position"] for other in baked_ground.events_of(ground) if other["frame"] == row["frame"]]
        apart = np.linalg.norm(np.array(seen)[:, None] - np.array(there), axis=2).min()
        assert apart < (1e-3 if where == "sails" else 1.0), "single precision"


@pytest.mark.slow
def test_a_walk_on_the_spot_on_a_belt_prints_as_the_walk_that_goes_ahead(scene):
    armature = on_the_spot(scene, walk(Body(), Gait(), FRAMES, 24), Gait().speed, 24, hips_held=False)
    scene.softground.cell_size = 0.02
    ground = field(scene, size=12.0)
    prints = {}
    for runs in (False, True):
        carrier = bpy.data.objects.new("Carrier", None)
        scene.collection.objects.link(carrier)
        (ground if runs else armature).parent = carrier
        for frame in (1, FRAMES):
            carrier.location.y = (1.0 if runs else -1.0) * Gait().speed * (frame - 1) / 24
            carrier.keyframe_insert("location", frame=frame)
        for curve in action_curves(carrier.animation_data.action):
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
        scene.frame_set(1)
        result = bake(scene)
        assert result.report["warnings"] == []
        prints[runs] = [(*step.position, step.max_depth_m, step.compressed_m3) for step in result.footprints]
        bpy.ops.softground.clear_bake()
        bpy.data.objects.remove(carrier)
        scene.frame_set(1)
    assert len(prints[True]) > 3
    np.testing.assert_allclose(prints[True], prints[False], rtol=1e-3, atol=1e-5)


def props_on(scene, keyed):
    """Depth and force of a ball that drops on a deck and a crate that is set down on it, both of 50 kg."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    drop, crate = ball(), box(scene, "Crate", 0.25, x=(0.75, 1.25), y=(-0.25, 0.25), bottom=-0.25)
    key_path(drop, dropped_path(0.0, 0.0, 0.5, frames=48))
    key_path(crate, [(0.0, 0.0, 0.25 + max(0.0, 0.4 - 0.04 * frame)) for frame in range(48)])
    add_props(scene, [drop, crate])
    for character in scene.softground.characters:
        character.mass = 50
    scene.softground.frame_end = 48
    deck(scene, keyed=keyed)
    scene.softground.detail = "ALWAYS"
    steps = {step["character"]: step for step in bake(scene).report["steps"]}
    return {name: (step["max_depth_m"], step["compressed_m3"], step["peak_force_n"]) for name, step in steps.items()}


@pytest.mark.slow
def test_props_on_a_deck_that_sails_press_as_on_still_ground_and_weigh_more_on_a_lift(scene):
    before = props_on(scene, ())
    assert before.keys() == {"Ball", "Crate"}
    for keyed in (still, sailing):
        assert all(props_on(scene, keyed)[name] == pytest.approx(each, rel=1e-6) for name, each in before.items())
    lifted = props_on(scene, rising)
    for name, (depth, _, force) in before.items():
        assert lifted[name][0] > depth
        assert lifted[name][2] - force == pytest.approx(50 * 2.0, rel=0.01)


def test_a_crate_on_a_bone_that_moves_beside_the_deck_is_refused(short_walk):
    ground = field(short_walk)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, -0.8, 0))
    crate = bpy.context.object
    bpy.ops.object.armature_add()
    crane = bpy.context.object
    crate.parent = crane
    for bone, hung in (("Bone", crate), ("Object", ground)):
        hung.parent, hung.parent_type = crane, "BONE" if bone == "Bone" else "OBJECT"
    crate.parent_bone = "Bone"
    arm = crane.pose.bones["Bone"]
    short_walk.softground.hard_grounds.add().object = crate
    arm.keyframe_insert("location", frame=1)
    bpy.context.view_layer.update()
    bake(short_walk)
    arm.location = (0.5, 0, 0)
    arm.keyframe_insert("location", frame=30)
    with pytest.raises(InputError, match="'Cube' in Hard Ground does not move as ground 'Field' does"):
        bake(short_walk)


def turning_over(time):
    return (0, 0, 0), (1.5 * time, 0, 0)


def test_a_ground_that_turns_over_or_changes_its_size_is_refused(short_walk):
    ship = deck(short_walk, keyed=turning_over)
    short_walk.softground.frame_end = 60
    with pytest.raises(
        InputError, match=r"Ground 'Field' tilts by up to \d+° against what pulls on it, at frame (1|60)\b"
    ):
        bake(short_walk)
    ship.animation_data_clear()
    for frame, size in ((1, 1.0), (30, 1.2)):
        ship.scale = (size,) * 3
        ship.keyframe_insert("scale", frame=frame)
    with pytest.raises(InputError, match="Ground 'Field' changes its size in these frames"):
        bake(short_walk)


@pytest.mark.parametrize(("slow", "first", "last"), [(2, 1, 60), (27, -20, 28)])
def test_a_deck_that_sets_off_or_stops_at_once_is_named_with_the_frame_and_the_way_out(short_walk, slow, first, last):
    """As between the first two keys or the last two of curves that ease, though the deck hardly tilts."""
    ship = deck(short_walk)
    for frame in range(first, last + 1, 3):
        (ship.location, _), tilt = sailing(frame / 24), 0.14 * np.sin(frame / 12)
        ship.rotation_euler.x = tilt
        ship.keyframe_insert("location", frame=frame)
        ship.keyframe_insert("rotation_euler", frame=frame)
    short_walk.softground.frame_end = min(last, 30)
    with pytest.raises(InputError) as refused:
        bake(short_walk)
    said = re.search(r"'Field' changes its speed by (\d+) m/s² around frame (\d+), which tilts", str(refused.value))
    assert said
    assert 15 < float(said[1]) < 60
    assert abs(int(said[2]) - slow) <= 4
    assert "before Start and after End, or make its curves linear" in str(refused.value)
    for curve in action_curves(ship.animation_data.action):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    bake(short_walk)


@pytest.mark.slow
def test_feet_sink_into_prints_on_a_sailing_deck_as_on_a_still_one(short_walk):
    deck(short_walk)
    bake(short_walk, sink_feet=True)
    feet = posed(short_walk)
    bpy.ops.softground.clear_bake()
    for frame in range(-23, 61):
        bpy.data.objects["Place"].location = sailing(frame / 24)[0]
        bpy.data.objects["Place"].keyframe_insert("location", frame=frame)
    short_walk.frame_set(7)
    bake(short_walk)
    assert posed(short_walk) == pytest.approx(feet, abs=1e-4)


def test_a_step_on_a_sailing_deck_can_be_edited(short_walk):
    deck(short_walk, keyed=sailing)
    result = bake(short_walk)
    short_walk.frame_set(20)
    edited = jobs.run(step_edits.reading(short_walk))
    name = edited.record.steps[1].name
    jobs.run(step_edits.editing(edited, {name: StepEdit(move_m=(0.1, 0.0))}))
    prints = baked_ground.record_of(short_walk.softground.ground).edited
    assert len(prints) == len(result.footprints)
    moves = [new.position - old.position for new, old in zip(prints, result.footprints, strict=True)]
    assert moves[1] == pytest.approx((0.1, 0, 0), abs=0.02)
    assert moves[0] == pytest.approx((0, 0, 0))


def test_what_a_shot_is_known_by_holds_while_the_deck_moves_on(short_walk):
    deck(short_walk, keyed=sailing)
    known = analysis.read(short_walk)
    short_walk.frame_set(20)
    assert analysis.known(snapshot(short_walk)) is known
    bpy.data.objects["Place"].location.x = 9
    bpy.data.objects["Place"].keyframe_insert("location", frame=20)
    analysis.look_again()
    assert analysis.known(snapshot(short_walk)) is None


def test_live_mode_presses_a_deck_that_sails(short_walk):
    deck(short_walk, keyed=sailing)
    bake(short_walk)
    short_walk.frame_set(30)
    deepest = as_rendered(baked_ground.display_mesh_of(short_walk.softground.ground))[:, 2].min()
    bpy.ops.softground.clear_bake()
    assert bpy.ops.softground.live() == {"FINISHED"}
    try:
        short_walk.frame_set(30)
        shown = baked_ground.display_mesh_of(short_walk.softground.ground)
        assert as_rendered(shown)[:, 2].min() == pytest.approx(deepest, abs=2e-3)
    finally:
        live.discard()


@pytest.mark.parametrize("where", ["on_a_wall", "on_a_ship"])
def test_early_prints_are_drawn_where_the_bake_puts_them(short_walk, where):
    if where == "on_a_ship":
        deck(short_walk, keyed=sailing)
        short_walk.frame_set(20)
    else:
        field(short_walk)
        moved(short_walk, WHERE[where])
    session.show_bake(0.0, "")
    try:
        steps = jobs.run(bake_job.bake(short_walk)).report["steps"]
        prints = sorted(state.pressing.footprints, key=lambda each: each.start_frame)
        drawn = [overlay.corners_of(each, state.pressing, short_walk) for each in prints]
    finally:
        session.show_no_bake()
    assert len(drawn) == len(steps) == 3
    for corners, step in zip(drawn, steps, strict=True):
        assert (corners.min(axis=0) + corners.max(axis=0)) / 2 == pytest.approx(step["position"], abs=0.08)
