"""What prints without a rig, and what prints beside the feet: balls, wheels, canes, hands."""

import bpy
import numpy as np
import pytest
from mathutils import Quaternion

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from softground_addon.blender.characters.character_setup import add_character
from softground_addon.blender.characters.contact_editing import add_bone_contacts, add_object_contacts
from softground_addon.blender.characters.prop_setup import add_props
from softground_addon.blender.compat import action_curves, slot_of
from softground_addon.blender.reading import analysis
from softground_addon.blender.reading.shots import read_shot, settings_of
from softground_addon.core.errors import InputError
from tests.blender import rigs, shots


def ball(name="Ball", radius=0.25, location=(0, 0, 0)):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, segments=48, ring_count=24, location=location)
    thing = bpy.context.active_object
    thing.name = name
    return thing


def key_path(thing, path, first=1):
    """Keys on every frame along a path (F, 3)."""
    for frame, place in enumerate(path, first):
        thing.location = place
        thing.keyframe_insert("location", frame=frame)


def dropped_path(x, y, height, radius=0.25, frames=60, rate=24):
    time = np.arange(frames) / rate
    z = np.maximum(height - 9.81 / 2 * np.maximum(time - 0.3, 0) ** 2, 0.0) + radius
    return np.stack([x + 0 * z, y + 0 * z, z], -1)


def bake(scene, **values):
    for name, value in values.items():
        setattr(scene.softground, name, value)
    return jobs.run(bake_job.bake(scene))


def heights(scene):
    mesh = scene.softground.ground.data
    positions = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", positions)
    return positions


@pytest.mark.slow
def test_a_dropped_ball_bakes_from_one_click(scene):
    key_path(ball(), dropped_path(0.1, 0.2, 2.5))
    assert bpy.ops.softground.add_character() == {"FINISHED"}
    (character,) = scene.softground.characters
    assert (character.name, character.armature, character.soles[0].object.name) == ("Ball", None, "Ball")
    assert character.mass == pytest.approx(4 / 3 * np.pi * 0.25**3 * 500, rel=0.05)
    assert (scene.softground.frame_start, scene.softground.frame_end) == (1, 60)
    character.mass = 50
    analysis.read(scene)
    expected = analysis.expected_depth(scene)
    (step,) = bake(scene).report["steps"]
    speed = np.sqrt(2 * 9.81 * 2.5)
    assert step["peak_force_n"] == pytest.approx(50 * (9.81 + speed / 0.2), rel=0.01)
    assert step["position"][:2] == pytest.approx([0.1, 0.2], abs=0.005)
    assert step["max_depth_m"] == pytest.approx(expected, rel=0.03)
    # A cap of the ball: what it carries is its volume times E/L0.
    assert step["compressed_m3"] == pytest.approx(step["peak_force_n"] * 0.3 / 375e3, rel=0.02)


def test_the_thing_that_was_just_added_is_not_taken_as_the_ground(scene):
    thing = ball()
    key_path(thing, dropped_path(0.0, 0.0, 1.0, frames=40))
    bpy.ops.softground.add_character()
    assert bpy.context.active_object == thing
    bpy.ops.softground.create_ground()
    assert scene.softground.ground not in (None, thing)


@pytest.mark.parametrize("is_contact", [True, False])
def test_what_a_character_carries_is_not_taken_as_the_ground(scene, is_contact):
    armature = shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    bpy.ops.mesh.primitive_cube_add(size=0.1)
    shoe = bpy.context.active_object
    shoe.parent, shoe.parent_type, shoe.parent_bone = armature, "BONE", "foot.L"
    if is_contact:
        assert bpy.ops.softground.add_contact() == {"FINISHED"}
    assert (bpy.context.active_object, shoe.select_get()) == (shoe, True)
    bpy.ops.softground.create_ground()
    assert scene.softground.ground not in (None, shoe)


def test_a_thing_beside_a_character_that_answers_the_ground(scene):
    add_character(scene, shots.walker(scene, frames=30))
    thing = ball(location=(3, 0, 0))
    key_path(thing, dropped_path(3.0, 0.0, 0.5, frames=30))
    add_props(scene, [thing])
    before = np.array([[curve.evaluate(f) for f in range(1, 31)] for curve in curves_of(thing)])
    scene.softground.tilt.use = scene.softground.grounding.use = True
    report = bake(scene, cell_size=0.02, frame_start=1, frame_end=30).report
    assert {"Ball", "foot.L"} <= {step["contact"] for step in report["steps"]}
    assert list(report["gaps_mm"]["after"]) != []
    after = np.array([[curve.evaluate(f) for f in range(1, 31)] for curve in curves_of(thing)])
    assert (before == after).all()
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}


def curves_of(thing):
    return list(action_curves(thing.animation_data.action, slot_of(thing.animation_data)))


def test_live_mode_presses_a_thing_and_takes_it_back(scene):
    thing = ball()
    key_path(thing, dropped_path(0.0, 0.0, 0.5, frames=40))
    add_props(scene, [thing])
    scene.softground.cell_size = 0.02
    bpy.ops.softground.create_ground()
    scene.frame_set(1)
    untouched = heights(scene)
    bpy.ops.softground.live()
    scene.frame_set(40)
    pressed = heights(scene)
    scene.frame_set(1)
    assert heights(scene).tobytes() == untouched.tobytes()
    scene.frame_set(40)
    assert heights(scene).tobytes() == pressed.tobytes()
    bpy.ops.softground.live(keep=True)
    assert pressed.min() < -0.005


def test_a_wheel_that_rolls_leaves_one_continuous_rut(scene):
    bpy.ops.mesh.primitive_cylinder_add(radius=0.35, depth=0.05, vertices=64)
    wheel = bpy.context.active_object
    wheel.rotation_mode = "QUATERNION"
    for frame in range(1, 31):
        x = 2.0 * (frame - 1) / 24
        wheel.location = (x, 0.0, 0.35)
        wheel.rotation_quaternion = Quaternion((0, 1, 0), x / 0.35) @ Quaternion((1, 0, 0), np.pi / 2)
        wheel.keyframe_insert("location", frame=frame)
        wheel.keyframe_insert("rotation_quaternion", frame=frame)
    add_props(scene, [wheel])
    scene.softground.characters[0].mass = 40
    bake(scene, cell_size=0.02)
    z = heights(scene).reshape(-1, 3) + np.array(scene.softground.ground.matrix_world)[:3, 3]
    middle = z[(np.abs(z[:, 1]) < 0.011) & (z[:, 0] > 0.4) & (z[:, 0] < 2.0)]
    assert len(middle) > 50
    assert (middle[:, 2] < -0.002).all()
    assert np.ptp(middle[:, 2]) < 0.1 * np.abs(middle[:, 2]).max()


def test_two_things_make_the_same_ground_in_either_order(scene):
    first, other = ball("One", location=(0, 0, 0)), ball("Other", 0.15, location=(2, 0, 0))
    key_path(first, dropped_path(0.0, 0.0, 1.0))
    key_path(other, dropped_path(2.0, 0.3, 2.0, radius=0.15))
    grounds = []
    for order in ([first, other], [other, first]):
        scene.softground.characters.clear()
        scene.softground.ground = None
        add_props(scene, order)
        bake(scene, cell_size=0.02)
        grounds.append(heights(scene))
    assert (np.abs(grounds[0]) > 0).any()
    assert grounds[0].tobytes() == grounds[1].tobytes()


@pytest.mark.slow
def test_two_walkers_and_a_ball_make_the_same_ground_in_any_order(scene):
    walkers = [shots.walker(scene, frames=30), shots.walker(scene, frames=30)]
    walkers[1].location = (3.0, 0.0, 0.0)
    thing = ball(location=(-2, 0, 0))
    key_path(thing, dropped_path(-2.0, 0.0, 0.5, frames=30))
    scene.softground.characters.clear()
    grounds = []
    for order in ((0, 1), (1, 0)):
        scene.softground.characters.clear()
        scene.softground.ground = None
        if order[0]:
            add_props(scene, [thing])
        for number in order:
            add_character(scene, walkers[number])
        if not order[0]:
            add_props(scene, [thing])
        bake(scene, cell_size=0.02, frame_start=1, frame_end=30)
        grounds.append(heights(scene))
    assert grounds[0].tobytes() == grounds[1].tobytes()


def test_a_simulated_rigid_body_falls_where_blender_drops_it(scene):
    bpy.ops.mesh.primitive_cube_add(size=20, location=(0, 0, -10))
    floor = bpy.context.active_object
    bpy.ops.rigidbody.object_add()
    floor.rigid_body.type = "PASSIVE"
    thing = ball(location=(0.4, 0.0, 1.5))
    bpy.ops.rigidbody.object_add()
    thing.rigid_body.mass = 7.0
    thing.rigid_body.collision_shape = "SPHERE"
    scene.frame_end = 40
    scene.frame_set(13)
    (character,) = add_props(scene, [thing])
    assert character.mass == pytest.approx(7.0)
    assert (scene.softground.frame_start, scene.softground.frame_end) == (1, 40)
    step = bake(scene).report["steps"][0]
    assert scene.frame_current == 13
    assert step["position"][:2] == pytest.approx([0.4, 0.0], abs=0.02)
    assert step["frame_start"] == pytest.approx(1 + 24 * np.sqrt(2 * 1.25 / 9.81), abs=2)
    assert step["peak_force_n"] == pytest.approx(7 * (9.81 + np.sqrt(2 * 9.81 * 1.25) / 0.2), rel=0.15)


def test_rigid_bodies_are_stepped_to_a_late_start_a_frame_at_a_time(scene):
    """Blender answers its user between the frames that lead up to the shot, and is put back when it is left early."""
    bpy.ops.object.select_all(action="DESELECT")
    thing = ball(location=(0.0, 0.0, 50.0))
    bpy.ops.rigidbody.object_add()
    add_props(scene, [thing])
    scene.softground.frame_start, scene.softground.frame_end = 30, 40
    scene.frame_set(5)
    reading, shown = read_shot(settings_of(scene)), []
    for _ in reading:
        shown.append(scene.frame_current)
        if scene.frame_current == 32:
            break
    reading.close()
    assert sorted(set(shown)) == list(range(1, 33))
    assert scene.frame_current == 5


def test_wheels_on_one_frame_are_one_thing_and_share_its_mass(scene):
    parent = bpy.data.objects.new("Bicycle", None)
    scene.collection.objects.link(parent)
    wheels = [ball(f"Wheel {k}", location=(k, 0, 0.25)) for k in (0, 1)]
    for wheel in wheels:
        wheel.parent = parent
    rigs.key(parent, "location", {1: (0, 0, 0), 20: (1, 0, 0)})
    (character,) = add_props(scene, wheels)
    assert (character.name, len(character.soles)) == ("Bicycle", 2)
    (motion,) = jobs.run(read_shot(settings_of(scene))).motions
    assert motion.centre[0] == pytest.approx([0.5, 0, 0.25], abs=1e-4)


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 0.5, 1), (-1, 1, 1), (1, 1, -3)])
def test_any_lasting_scale_is_the_things_own_shape(scene, scale):
    bpy.ops.mesh.primitive_cube_add(size=0.4, location=(0, 0, 0.2 * abs(scale[2])))
    cube = bpy.context.active_object
    cube.scale = scale
    rigs.key(cube, "location", {1: cube.location, 10: cube.location})
    add_props(scene, [cube])
    scene.softground.characters[0].mass = 100
    (step,) = bake(scene, frame_end=10).report["steps"]
    assert step["area_m2"] == pytest.approx(0.16 * abs(scale[0] * scale[1]), rel=0.03)


def test_modifiers_shape_what_prints(scene):
    bpy.ops.mesh.primitive_cube_add(size=0.4, location=(0, 0, 0.2))
    cube = bpy.context.active_object
    cube.modifiers.new("Round", "SUBSURF").levels = 4
    rigs.key(cube, "location", {1: (0, 0, 0.2), 10: (0, 0, 0.2)})
    scene.view_layers[0].update()
    add_props(scene, [cube])
    scene.softground.characters[0].mass = 100
    (step,) = bake(scene, frame_end=10).report["steps"]
    assert step["area_m2"] < 0.08


def hidden(thing):
    thing.hide_viewport = thing.hide_render = True


def in_a_hidden_collection(thing):
    collection = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(collection)
    for owner in thing.users_collection:
        owner.objects.unlink(thing)
    collection.objects.link(thing)
    bpy.context.view_layer.layer_collection.children["Hidden"].exclude = True


@pytest.mark.parametrize("hide", [hidden, in_a_hidden_collection])
def test_a_hidden_thing_prints_as_one_that_shows(scene, hide):
    thing = ball()
    key_path(thing, dropped_path(0.0, 0.0, 1.0, frames=40))
    add_props(scene, [thing])
    hide(thing)
    scene.view_layers[0].update()
    (step,) = bake(scene).report["steps"]
    assert step["max_depth_m"] > 0.01


def growing(scene, thing):
    rigs.key(thing, "scale", {1: (1, 1, 1), 20: (2, 2, 2)})


def squashed(scene, thing):
    thing.scale = (1, 1, 0)


def without_faces(scene, thing):
    thing.data = bpy.data.meshes.new("Empty")


def with_a_vertex_nowhere(scene, thing):
    thing.data.vertices[0].co.x = float("nan")
    thing.data.update()


def weightless(scene, thing):
    scene.softground.characters[0].mass = 0.0


def unlinked(scene, thing):
    for collection in thing.users_collection:
        collection.objects.unlink(thing)


def removed(scene, thing):
    bpy.data.objects.remove(thing)


def turned_into_the_ground(scene, thing):
    scene.softground.ground = thing


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (growing, "'Ball' changes its size"),
        (squashed, "'Ball' has a scale of zero"),
        (without_faces, "'Ball' has no faces"),
        (with_a_vertex_nowhere, "mesh of 'Ball' has vertices without a valid position"),
        (weightless, "mass of 'Ball'"),
        (unlinked, "object 'Ball' was deleted"),
        (removed, "object of 'Ball' was deleted"),
        (turned_into_the_ground, "'Ball' is the ground"),
    ],
)
def test_a_thing_that_cannot_print_is_refused_with_its_name_and_the_remedy(scene, spoil, message):
    thing = ball()
    key_path(thing, dropped_path(0.0, 0.0, 1.0, frames=40))
    add_props(scene, [thing])
    spoil(scene, thing)
    with pytest.raises(InputError, match=message):
        bake(scene)


def test_what_is_no_thing_is_not_added(scene):
    thing = ball()
    scene.softground.ground = thing
    with pytest.raises(InputError, match="'Ball' is the ground"):
        add_props(scene, [thing])
    scene.softground.ground = None
    add_props(scene, [thing])
    with pytest.raises(InputError, match="already prints"):
        add_props(scene, [thing])
    light = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    with pytest.raises(InputError, match=r"'Lamp'.*of type Light"):
        add_props(scene, [light])
    assert len(scene.softground.characters) == 1


def test_limbs_of_a_lying_figure_share_its_weight_with_whatever_side_is_down(scene):
    armature = rigs.human(rigs.FAMILIES["blender"])
    rigs.key(armature, "rotation_euler", {1: (np.pi / 2, 0, 0), 20: (np.pi / 2, 0, 0)})
    rigs.key(armature, "location", {1: (0, 0, 0.088), 20: (0, 0, 0.088)})
    character = add_character(scene, armature)
    character.soles.clear()
    lying = ["chest", "head", "thigh.L", "thigh.R", "shin.L", "shin.R"]
    add_bone_contacts(character, lying)
    report = bake(scene, frame_end=20, keep_forces=True).report
    steps = {step["contact"]: step for step in report["steps"]}
    assert {"thigh.L", "thigh.R"} <= steps.keys() <= set(lying)
    assert steps["thigh.L"]["compressed_m3"] == pytest.approx(steps["thigh.R"]["compressed_m3"], rel=0.05)
    (of_character,) = report["forces"]["characters"].values()
    total = sum(np.array(forces)[-1, 2] for forces in of_character.values())
    assert total == pytest.approx(character.mass * 9.81, rel=0.01)


def test_a_cane_on_the_hand_prints_with_its_tip_and_carries_its_share(scene):
    armature = shots.walker(scene, frames=20)
    character = add_character(scene, armature)
    bpy.ops.mesh.primitive_cylinder_add(radius=0.015, depth=0.9, location=(0.3, 0, 0.45))
    cane = bpy.context.active_object
    cane.name = "Cane.L"
    rigs.key(cane, "location", {1: (0.3, 0, 0.45), 20: (0.3, 0, 0.45)})
    assert add_object_contacts(scene.softground, character, [cane]) == ["Cane.L"]
    assert character.soles[-1].side == "LEFT"
    (motion,) = jobs.run(read_shot(settings_of(scene))).motions
    sole = motion.soles[-1]
    assert sole.lowest() == pytest.approx(np.zeros(len(motion.frames)), abs=1e-4)
    steps = bake(scene, frame_end=20).report["steps"]
    (tip,) = [step for step in steps if step["contact"] == "Cane.L"]
    assert tip["area_m2"] == pytest.approx(np.pi * 0.015**2, rel=0.1)


@pytest.mark.slow
def test_contacts_are_added_from_what_is_selected(scene):
    armature = shots.walker(scene, frames=20)
    add_character(scene, armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="POSE")
    for bone in armature.pose.bones:
        selectable = bone if hasattr(bone, "select") else bone.bone  # the bone itself before Blender 5
        selectable.select = bone.name.startswith("hand")
    assert bpy.ops.softground.add_contact() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    limbs = [sole for sole in scene.softground.characters[0].soles if sole.kind == "LIMB"]
    assert {sole.side for sole in limbs} == {"LEFT", "RIGHT"}
    (motion,) = jobs.run(read_shot(settings_of(scene))).motions
    assert [sole.sole.prop is not None for sole in motion.soles] == [False, False, True, True]
    # Hands that only swing by change nothing.
    report = bake(scene, frame_end=20).report
    assert {step["contact"] for step in report["steps"]} <= {"foot.L", "foot.R"}


@pytest.mark.slow
def test_the_hands_of_a_cartwheel_print_between_the_feet(scene):
    """Arms as long as legs: turned about its hips like a wheel, the figure lands on foot, hand, hand and foot."""
    armature = rigs.human(rigs.FAMILIES["blender"])
    height, frames = 0.955, 73
    for frame in range(1, frames + 1):
        angle = 2 * np.pi * (frame - 1) / (frames - 1)
        hips = np.array([height * angle, 0.0, height])
        armature.rotation_euler = (0, angle, 0)
        armature.location = hips - 0.95 * np.array([np.sin(angle), 0, np.cos(angle)])
        armature.keyframe_insert("location", frame=frame)
        armature.keyframe_insert("rotation_euler", frame=frame)
    character = add_character(scene, armature)
    add_bone_contacts(character, ["hand.L", "hand.R"])
    assert {sole.side for sole in character.soles if sole.kind == "LIMB"} == {"LEFT", "RIGHT"}
    steps = sorted(bake(scene, frame_end=frames).report["steps"], key=lambda step: step["frame_start"])
    order = [step["contact"] for step in steps]
    assert order.index("hand.L") < order.index("hand.R")
    assert "foot" in order[0]
    assert "foot" in order[-1]
    hands = [step for step in steps if step["contact"].startswith("hand")]
    assert len(hands) == 2
    for step in hands:
        assert step["area_m2"] < 0.03
        assert step["peak_force_n"] > 0.3 * character.mass * 9.81
    assert hands[1]["position"][0] - hands[0]["position"][0] > 0.8
