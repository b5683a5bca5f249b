"""A bake after a bake presses again what another setting, key or ground gives, and nothing else: never what was."""

import bpy
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from softground_addon.blender import jobs, reuse
from softground_addon.blender.baking import bake_job
from softground_addon.blender.compat import action_curves, slot_of
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.state import state
from softground_addon.core.record.edits import StepEdit
from tests.blender import fingerprints, shots
from tests.blender.grounds import bake, plane


def baked_walk(scene):
    """A short walk on a plane, baked once, with all that is put on prints."""
    shots.walker(scene, frames=36)
    armature = bpy.context.view_layer.objects.active
    scene.softground.ground = plane(scene, size=5.0, vertices=120)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    bake(scene, cell_size=0.02, relief="FINE", debris=True)


@pytest.fixture
def again(opened_as):
    return opened_as(baked_walk)


def raise_hips(scene, value):
    armature = scene.softground.characters[0].armature
    for curve in action_curves(armature.animation_data.action, slot_of(armature.animation_data)):
        if curve.data_path.endswith("location"):
            curve.keyframe_points[len(curve.keyframe_points) // 2].co.y += 0.002 * value
            curve.update()


def thicken_shoes(scene, value):
    for figure in scene.softground.characters[0].armature.children:
        for vertex in figure.data.vertices:
            vertex.co.z -= 0.001 * value * (vertex.co.z < 0.05)


def lift_ground(scene, value):
    mesh = scene.softground.ground.data
    bpy.ops.softground.clear_bake()
    for vertex in mesh.vertices:
        vertex.co.z += 0.0005 * value * (vertex.co.x > 0.0)


CHANGES = {
    "relief_strength": lambda scene, value: setattr(scene.softground, "relief_strength", 0.5 * value),
    "relief": lambda scene, value: setattr(scene.softground, "relief", ("OFF", "FINE", "CLOSE_UP")[value % 3]),
    "tread": lambda scene, value: setattr(scene.softground, "tread", 0.001 * value),
    "shape_keys": lambda scene, value: setattr(scene.softground, "shape_keys", bool(value % 2)),
    "debris": lambda scene, value: setattr(scene.softground, "debris", not value % 2),
    "pressure": lambda scene, value: setattr(
        scene.softground, "pressure", ("UNIFORM", "CENTRE_OF_PRESSURE")[value % 2]
    ),
    "preset": lambda scene, value: bpy.ops.softground.load_preset(name=("Snow", "Mud", "Dry Sand")[value % 3]),
    "cell_size": lambda scene, value: setattr(scene.softground, "cell_size", 0.02 + 0.001 * value),
    "mass": lambda scene, value: setattr(scene.softground.characters[0], "mass", 60.0 + value),
    "frames": lambda scene, value: setattr(scene.softground, "frame_end", 36 - value),
    "gravity": lambda scene, value: setattr(scene, "gravity", (0.0, 0.0, -9.81 + value)),
    "sink_feet": lambda scene, value: setattr(scene.softground, "sink_feet", bool(value % 2)),
    "tilt": lambda scene, value: setattr(scene.softground.tilt, "use", bool(value % 2)),
    "keys": raise_hips,
    "shoes": thicken_shoes,
    "ground": lift_ground,
    "nothing": lambda scene, value: None,
}


def record_in(scene):
    """All that a bake leaves in the file, byte by byte, and its report, but for names and the time that it took."""
    report = bake(scene).report
    meshes = {mesh.name: fingerprints.of_mesh(mesh) for mesh in bpy.data.meshes}
    for mesh in meshes.values():
        mesh["properties"].pop(ground_mesh.SUMMARY, None)
    tables = [[fingerprints.of_attribute(each) for each in curves.attributes] for curves in bpy.data.hair_curves]
    actions = {action.name: fingerprints.of_action(action) for action in bpy.data.actions}
    return meshes, tables, actions, {key: value for key, value in report.items() if key != "timings"}


@pytest.mark.slow
@settings(max_examples=6, deadline=None, suppress_health_check=list(HealthCheck))
@example([("preset", 1), ("relief", 3)])  # water, and then none
@given(st.lists(st.tuples(st.sampled_from(sorted(CHANGES)), st.integers(1, 4)), min_size=2, max_size=4))
def test_what_a_bake_leaves_is_the_same_whatever_was_baked_before(opened_as, changes):
    scene = opened_as(baked_walk)
    for name, value in changes:
        CHANGES[name](scene, value)
        as_it_comes = record_in(scene)
        reuse.forget()
        assert record_in(scene) == as_it_comes, name


def anew(scene, change=lambda: None):
    """What a bake after a change works out anew, of what was held."""
    change()
    before = {key: held[1] for key, held in state.results.items()}
    bake(scene)
    return {key[0] for key, held in state.results.items() if before.get(key) is not held[1]}


def presses(scene, change=lambda: None):
    """True if a bake after a change presses prints."""
    return "prints" in anew(scene, change)


@pytest.mark.slow
@pytest.mark.parametrize("sink_feet", [False, True])
def test_relief_look_and_shape_keys_leave_the_prints_as_they_are(again, sink_feet):
    bake(again, sink_feet=sink_feet)
    for name in ("relief_strength", "relief", "tread", "shape_keys"):
        assert not presses(again, lambda name=name: CHANGES[name](again, 2)), name


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["debris", "pressure", "preset", "cell_size", "mass", "frames", "gravity", "keys", "shoes", "ground"]
)
def test_what_acts_on_prints_has_them_pressed_anew(again, name):
    bake(again)
    assert presses(again, lambda: CHANGES[name](again, 1))
    assert not presses(again)


def test_edits_of_steps_have_them_pressed_anew_and_come_with_the_bake(again):
    step = bake(again).report["steps"][0]["id"]
    ground = again.softground.ground
    edited = {step: StepEdit(strength=0.5)}
    whole = baked_ground.record_of(ground).edited[0]
    jobs.run(bake_job.bake(again, edits=edited))
    half = baked_ground.record_of(ground).edited[0]
    assert half.compressed_m3 < 0.9 * whole.compressed_m3
    assert not presses(again)
    assert baked_ground.edits_of(ground) == edited
    assert baked_ground.record_of(ground).edited[0].compressed_m3 == half.compressed_m3


PRINTED = {"prints", "findings", "trail", "movements", "relief"}
"""What follows from other prints."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "follows"),
    [
        ("nothing", set()),
        ("relief_strength", set()),
        ("tread", {"relief"}),
        ("pressure", PRINTED),
        ("preset", PRINTED),
        ("cell_size", PRINTED),
        ("mass", PRINTED | {"loads", "motion"}),
        ("keys", PRINTED | {"loads", "motion"}),
        ("shoes", PRINTED | {"loads", "motion"}),
        ("ground", PRINTED | {"loads", "terrain", "motion"}),  # the bake is cleared before
    ],
)
def test_a_bake_works_out_only_what_follows_from_what_has_changed(again, name, follows):
    bake(again)
    assert anew(again, lambda: CHANGES[name](again, 1)) == follows
    if not follows:
        assert record_in(again) == (reuse.forget(), record_in(again))[1]


@pytest.mark.slow
@pytest.mark.parametrize("value", [0.05, 0.3])
def test_landings_follow_the_time_that_the_ground_needs(again, value):
    again.softground.characters[0].force_model = "IMPULSE"
    bake(again)
    assert "loads" in anew(again, lambda: setattr(again.softground.material, "characteristic_time", value))
    assert record_in(again) == (reuse.forget(), record_in(again))[1]


@pytest.mark.slow
def test_what_is_held_is_bounded_and_given_back(again, monkeypatch):
    bake(again)
    held, sizes = reuse._size(*(each[1] for each in state.results.values())), dict(state.results)
    assert 0 < held < 80 * len(baked_ground.stored_record(again.softground.ground))
    bpy.ops.softground.clear_bake()
    assert not state.results
    largest = max(each[2] for each in sizes.values())
    monkeypatch.setattr(reuse, "LARGEST", largest - 1)
    bake(again)
    assert {key: each[2] for key, each in state.results.items()} == {
        k: e[2] for k, e in sizes.items() if e[2] < largest
    }
    monkeypatch.undo()
    bake(again)
    assert ("prints", "") in state.results
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not state.results


def walk_without_ground(scene):
    """A walk that no bake has given a ground yet."""
    shots.walker(scene, frames=36)
    bpy.ops.softground.add_character()
    scene.softground.relief, scene.softground.debris, scene.softground.cell_size = "FINE", True, 0.02


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "follows"),
    [
        ("nothing", set()),
        ("relief_strength", set()),
        ("tread", {"relief"}),
        ("preset", PRINTED),
        ("keys", PRINTED | {"loads", "motion"}),
        ("ground", PRINTED | {"loads", "terrain", "motion"}),
    ],
)
def test_a_bake_on_the_ground_that_the_last_has_made_takes_over_what_still_holds(opened_as, name, follows):
    scene = opened_as(walk_without_ground)
    jobs.run(bake_job.bake(scene))
    its = anew(scene, lambda: CHANGES[name](scene, 1)) | {"findings"}  # which name the ground
    assert its == follows | {"findings"}
    as_it_comes = record_in(scene)
    reuse.forget()
    assert record_in(scene) == as_it_comes
