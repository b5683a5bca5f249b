"""Bodies that are hidden from renders: which meshes soles are cut from, and what is said of it."""

import bpy
import pytest

from softground_addon.blender.baking.bake_job import bake
from softground_addon.blender.jobs import run
from softground_addon.core.record import record
from tests.blender import shots


def prints_of(scene):
    """The bytes of the prints of a bake that writes nothing, and the codes of its findings."""
    result = run(bake(scene, write=False))
    codes = {finding["code"]: finding["message"] for finding in result.report["self_check"]}
    return record.dump(record.BakeRecord(result.footprints, {})), codes


@pytest.fixture
def walk(scene):
    """A walk of some steps, and its body."""
    armature = shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    return scene, armature, next(obj for obj in armature.children if obj.type == "MESH")


def cube(scene, name, *, parent, bone=""):
    """A box of 20 cm that hangs on a bone, or is deformed by the armature as its vertex groups say."""
    bpy.ops.mesh.primitive_cube_add(size=0.2)
    obj = bpy.context.object
    obj.name = name
    obj.parent, obj.parent_type = parent, "BONE" if bone else "ARMATURE"
    if bone:
        obj.parent_bone = bone
    return obj


@pytest.mark.slow
def test_a_body_that_is_hidden_from_renders_prints_as_it_does_when_it_is_shown(walk):
    scene, _, body = walk
    shown, _ = prints_of(scene)
    body.hide_render = True
    hidden, said = prints_of(scene)
    assert hidden == shown
    assert "hidden_skin" not in said
    bpy.data.objects.remove(body)
    assert prints_of(scene)[0] != shown


def test_a_hidden_body_beside_what_is_rendered_is_named(walk):
    scene, armature, body = walk
    cube(scene, "Hat", parent=armature, bone=scene.softground.characters[0].joints["head"].bone)
    assert "hidden_skin" not in prints_of(scene)[1]
    body.hide_render = True
    said = prints_of(scene)[1]["hidden_skin"]
    assert f"'{body.name}', which covers them, is hidden from renders" in said


@pytest.mark.parametrize(("how", "to"), [("hide_render", True), ("display_type", "WIRE"), ("display_type", "BOUNDS")])
def test_a_stand_in_that_is_not_rendered_or_shown_as_wires_does_not_print(walk, how, to):
    scene, armature, _ = walk
    shown, _ = prints_of(scene)
    stand_in = cube(scene, "Stand-in", parent=armature, bone=scene.softground.characters[0].soles[0].bone)
    assert prints_of(scene)[0] != shown
    setattr(stand_in, how, to)
    hidden, said = prints_of(scene)
    assert hidden == shown
    assert "hidden_skin" not in said
