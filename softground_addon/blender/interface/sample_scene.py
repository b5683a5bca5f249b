"""A figure that walks, for those who have none at hand: made from one small file inside the add-on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import bpy

from .. import compat, settings

FILE = Path(__file__).with_name("sample_walk.json")
"""Bones, mesh and keys of the figure in plain numbers; `sample_scenes.sample_walk` writes it."""


def add_walking_figure(context: bpy.types.Context) -> bpy.types.Object:
    """An armature with an action and a mesh on it, at the 3D cursor; returns the armature."""
    data = json.loads(FILE.read_text(encoding="utf-8"))
    scene = settings.scene_of(context)
    armature = bpy.data.objects.new("Walking Figure", bpy.data.armatures.new("Walking Figure"))
    (context.collection or scene.collection).objects.link(armature)
    armature.location = scene.cursor.location
    for other in context.selected_objects:
        other.select_set(False)
    armature.select_set(True)
    context.view_layer.objects.active = armature
    _make_bones(armature, data["bones"])
    figure = _make_figure(data)
    for collection in armature.users_collection:
        collection.objects.link(figure)
    figure.parent = armature
    figure.modifiers.new("Armature", "ARMATURE").object = armature
    _make_action(armature, data["curves"])
    return armature


def _make_bones(armature: bpy.types.Object, bones: list[Any]) -> None:
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        edit_bones = armature.data.edit_bones
        for name, parent, head, tail in bones:
            bone = edit_bones.new(name)
            bone.head, bone.tail = head, tail
            if parent:
                bone.parent = edit_bones[parent]
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def _make_figure(data: dict[str, Any]) -> bpy.types.Object:
    mesh = bpy.data.meshes.new("Walking Figure Body")
    mesh.from_pydata(data["vertices"], [], data["faces"])
    for name, colour, roughness in data["materials"]:
        material = bpy.data.materials.new(name)
        material.diffuse_color, material.roughness = colour, roughness
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", data["material_of_face"])
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    figure = bpy.data.objects.new(mesh.name, mesh)
    for number, name in enumerate(data["carriers"]):
        vertices = [vertex for vertex, carrier in enumerate(data["carried_by"]) if carrier == number]
        figure.vertex_groups.new(name=name).add(vertices, 1.0, "REPLACE")
    return figure


def _make_action(armature: bpy.types.Object, curves: dict[str, list[list[float]]]) -> None:
    action = bpy.data.actions.new("Walk")
    slot, channels = compat.new_channels(action, armature.name)
    animation = armature.animation_data_create()
    animation.action = action
    compat.set_slot(animation, slot)
    for path, values_of in curves.items():
        for index, values in enumerate(values_of):
            curve: Any = compat.new_curve(channels, path, index, path.split('"')[1])
            curve.keyframe_points.add(len(values))
            keys = [number for frame, value in enumerate(values, 1) for number in (frame, value)]
            curve.keyframe_points.foreach_set("co", keys)
            curve.update()


class SOFTGROUND_OT_add_sample_scene(bpy.types.Operator):
    """Add a walking figure to try SoftGround with; the rest of the scene stays as it is"""

    bl_idname = "softground.add_sample_scene"
    bl_label = "Add Sample Scene"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether an object can be added."""
        cls.poll_message_set("Leave Edit Mode first")
        return context.mode == "OBJECT"

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature = add_walking_figure(context)
        self.report({"INFO"}, f"Added '{armature.name}': press Add Character, then Bake Footprints")
        return {"FINISHED"}


CLASSES = (SOFTGROUND_OT_add_sample_scene,)
