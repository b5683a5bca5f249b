"""The skin as it is read is the skin as it is seen: shape keys and modifiers have their part in it."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import mesh_arrays
from softground_addon.blender.baking.bake_report import shapes_left_out
from softground_addon.blender.reading import staleness
from softground_addon.blender.rigs.rig_mapping import rest_bones
from softground_addon.blender.sampling.rig_recording import record
from softground_addon.blender.sampling.skin_sampling import read_skin
from softground_addon.blender.sampling.take import Take
from softground_addon.blender.settings import snapshot
from softground_addon.core.rig.rig_skin import skinned
from tests.blender import shots

FRAMES = (1, 7, 15)


@pytest.fixture
def body(scene):
    armature = shots.walker(scene, frames=20)
    return next(obj for obj in armature.children if obj.type == "MESH")


def thick_soles(body, value=1.0):
    """A shape key that thickens the soles by 5 cm."""
    body.shape_key_add(name="Basis")
    key = body.shape_key_add(name="boots")
    for vertex in body.data.vertices:
        if vertex.co.z < 0.03:
            key.data[vertex.index].co.z -= 0.05
    key.value = value
    return key


def keyed(body):
    for frame, value in ((1, 0.0), (20, 1.0)):
        thick = body.data.shape_keys.key_blocks["boots"] if body.data.shape_keys else thick_soles(body)
        thick.value = value
        thick.keyframe_insert("value", frame=frame)


def driven(body):
    driver = thick_soles(body).driver_add("value").driver
    driver.type = "SUM"
    target = driver.variables.new().targets[0]
    driver.variables[0].type = "TRANSFORMS"
    target.id, target.bone_target, target.transform_type = body.parent, "shin.L", "LOC_Z"


def muted(body):
    thick_soles(body).mute = True


def mirrored(body):
    """The left half alone, which a modifier completes."""
    for vertex in body.data.vertices:
        vertex.co.x = max(vertex.co.x, 0.0)
    body.modifiers.new("Mirror", "MIRROR")
    body.modifiers.move(1, 0)


def swollen(body):
    body.modifiers.new("Displace", "DISPLACE").strength = 0.02


def solid(body):
    body.modifiers.new("Shell", "SOLIDIFY").thickness = 0.03
    thick_soles(body, 0.5)


def enveloped(body):
    """Bound by the envelopes of bones alone."""
    body.vertex_groups.clear()
    body.modifiers[0].use_bone_envelopes = True
    for bone in body.parent.data.bones:
        bone.head_radius, bone.tail_radius, bone.envelope_distance = 0.06, 0.04, 0.1


def without_groups(body):
    """Its vertex groups are there and switched off."""
    names = [group.name for group in body.vertex_groups]
    enveloped(body)
    for name in names:
        body.vertex_groups.new(name=name).add(range(len(body.data.vertices)), 1.0, "REPLACE")
    body.modifiers[0].use_vertex_groups = False


def half_enveloped(body):
    """By envelopes where it has no groups."""
    body.parent.data.bones["shin.L"].envelope_weight = 3.0
    body.modifiers[0].use_bone_envelopes = True
    for name in ("shin.L", "foot.L", "head"):
        body.vertex_groups.remove(body.vertex_groups[name])


def parented(body):
    """By being a child of the armature, without a modifier."""
    half_enveloped(body)
    body.modifiers.clear()
    body.parent_type = "ARMATURE"


SHAPES = [thick_soles, keyed, driven, muted, mirrored, swollen, solid]
BOUND = [enveloped, without_groups, half_enveloped, parented]


@pytest.mark.parametrize("shape", SHAPES + BOUND)
def test_the_skin_that_is_read_is_the_skin_that_is_seen(scene, body, shape):
    shape(body)
    armature, before = body.parent, {kind: len(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "scenes")}
    skin = read_skin(scene.objects, armature)
    shapes = [shape.key for shape in skin.shapes]
    recording = list_of(record(Take.about(armature, scene, range(1, 21)), armature, skin.bones, shapes=shapes))
    assert before == {kind: len(getattr(bpy.data, kind)) for kind in before}
    read = skinned(skin, rest_bones(armature), recording, np.arange(len(skin.vertices)))
    for frame in FRAMES:
        scene.frame_set(frame)
        evaluated = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
        turn = np.array(evaluated.matrix_world)
        seen = mesh_arrays.positions(evaluated.data) @ turn[:3, :3].T + turn[:3, 3]
        assert len(read[0]) == len(seen)
        # Where skin bends, its thickness turns with its bones here, and with its faces there.
        apart = np.linalg.norm(read[frame - 1] - seen, axis=1)
        assert np.median(apart) < 1e-4
        assert np.percentile(apart, 99) < (0.02 if shape in (swollen, solid) else 1e-4)
        assert abs(read[frame - 1, :, 2].min() - seen[:, 2].min()) < 2e-3


def list_of(reading):
    """What a generator returns."""
    while True:
        try:
            next(reading)
        except StopIteration as done:
            return done.value


def test_what_acts_on_the_posed_mesh_is_said_to_be_left_out(scene, body):
    bpy.ops.softground.add_character()
    assert shapes_left_out(scene.objects, snapshot(scene)) == []
    body.modifiers.new("Suit", "CLOTH")
    hung = [finding.message for finding in shapes_left_out(scene.objects, snapshot(scene))]
    assert hung == [f"The skin of '{body.name}' was read without the modifier 'Suit'."]


def test_an_envelope_of_another_size_makes_a_bake_outdated(scene, body):
    enveloped(body)
    bpy.ops.softground.add_character()
    before = staleness._of_body(scene.objects, snapshot(scene).characters[0])
    body.parent.data.bones["shin.L"].envelope_distance *= 2
    assert staleness._of_body(scene.objects, snapshot(scene).characters[0]) != before


@pytest.mark.slow
@pytest.mark.parametrize("change", [thick_soles, keyed, swollen])
def test_a_shape_that_is_changed_makes_a_bake_outdated(scene, body, change):
    bpy.ops.softground.add_character()
    before = staleness._of_body(scene.objects, snapshot(scene).characters[0])
    change(body)
    after = staleness._of_body(scene.objects, snapshot(scene).characters[0])
    assert after != before
    scene.frame_set(5)
    assert staleness._of_body(scene.objects, snapshot(scene).characters[0]) == after
