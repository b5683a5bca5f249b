"""Data of objects whose kind is known, and rigs of which Blender has not made a pose yet."""

from __future__ import annotations

import bpy
import pytest

from softground_addon.blender.rigs.object_data import armature_of, mesh_of, pose_bones
from softground_addon.blender.sampling.rig_checks import is_animated


def new_rig(scene):
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    scene.collection.objects.link(rig)
    return rig


def test_data_of_another_kind_are_an_error_that_names_the_object(scene):
    rig = new_rig(scene)
    bpy.context.view_layer.update()
    box = bpy.data.objects.new("Box", bpy.data.meshes.new("Box"))
    top = bpy.data.objects.new("Top", None)
    assert (armature_of(rig), mesh_of(box), list(pose_bones(rig))) == (rig.data, box.data, [])
    for look_up, of, kind in ((armature_of, box, "Armature"), (mesh_of, top, "Mesh"), (pose_bones, box, "Pose")):
        with pytest.raises(TypeError, match=f"'{of.name}', of type {of.type}, has no {kind}"):
            look_up(of)


def test_a_rig_that_a_script_has_just_made_is_not_animated_yet(scene):
    rig = new_rig(scene)
    assert rig.pose is None  # until Blender evaluates it
    assert not is_animated(rig)
    rig.animation_data_create().action = bpy.data.actions.new("Walk")
    assert is_animated(rig)
