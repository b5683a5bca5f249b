"""A figure that walks, in the sun and before a camera, for those who have none: from one small file in the add-on."""

from __future__ import annotations

import json
from math import pi, radians
from pathlib import Path
from typing import Any, cast

import bpy
from mathutils import Vector

from .. import compat
from ..operator_base import Act
from ..operators import show_prints
from ..rigs.object_data import armature_of

FILE = Path(__file__).with_name("sample_walk.json")
"""Bones, mesh and keys of the figure in plain numbers; `sample_scenes.sample_walk` writes it."""

WALK = ((-1.5, -6.5), (1.5, 1.5))
"""Corners of what the walk needs, about where it begins [m]."""
STANDING = (0.1, 1.9)
"""What is that high above the figure's floor is in its way [m]."""
FIRST_STEPS, LAST_STEPS = Vector((0.0, -1.2, 0.7)), Vector((0.0, -3.7, 0.7))
"""What the view looks at as the walk begins, and the camera at its end, from where it begins [m]."""
LOOK = radians(-145.0)
"""Heading in which they look: from the side that is free, past the figure, which walks along -Y."""
SUN, SUN_HEIGHT, SUN_ASIDE = 4.0, radians(18), radians(170)
"""Strength of the sun [W/m²], its height and how far from the camera's heading its light goes."""
FAR, DOWN = 5.6, radians(13)
"""Distance of view and camera [m], and how far the camera looks down."""


def add_walking_figure(context: bpy.types.Context) -> bpy.types.Object:
    """An armature with an action and a mesh on it, at the 3D cursor or beside what stands there; returns it."""
    data = json.loads(FILE.read_text(encoding="utf-8"))
    scene = context.scene
    armature = bpy.data.objects.new("Walking Figure", bpy.data.armatures.new("Walking Figure"))
    (context.collection or scene.collection).objects.link(armature)
    armature.location = _free_place(context, scene.cursor.location)
    for other in context.selected_objects:
        other.select_set(False)
    armature.select_set(True)
    context.view_layer.objects.active = armature
    _make_bones(armature, data["bones"])
    figure = _make_figure(data)
    for collection in armature.users_collection:
        collection.objects.link(figure)
    figure.parent = armature
    cast("Any", figure.modifiers.new("Armature", "ARMATURE")).object = armature
    _make_action(armature, data["curves"])
    return armature


def _make_bones(armature: bpy.types.Object, bones: list[Any]) -> None:
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        edit_bones = armature_of(armature).edit_bones
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
        inputs = next(node for node in compat.shader_tree(material).nodes if node.type == "BSDF_PRINCIPLED").inputs
        inputs["Base Color"].default_value, inputs["Roughness"].default_value = colour, roughness
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


def _free_place(context: bpy.types.Context, place: Vector) -> Vector:
    """A place for the walk, moved along X past whatever stands in its way."""
    boxes = []
    for obj in context.visible_objects:
        if obj.type in _SOLID:
            corners = zip(*(obj.matrix_world @ Vector(corner) for corner in obj.bound_box), strict=True)
            boxes.append([(min(along), max(along)) for along in corners])
    place = place.copy()
    while beyond := [box[0][1] for box in boxes if _is_in_the_way(box, place)]:
        place.x = max(beyond) - WALK[0][0]
    return place


def _is_in_the_way(box: list[tuple[float, float]], place: Vector) -> bool:
    """True if a box, from where to where along each axis, stands in the walk that begins at a place."""
    needed = (*zip(*WALK, strict=True), STANDING)
    return all(
        lower - at < most - _TOUCHING and upper - at > least + _TOUCHING
        for (lower, upper), (least, most), at in zip(box, needed, place[:], strict=True)
    )


_TOUCHING = 1e-3
"""How far boxes are in each other that only touch, at most [m]."""
_SOLID = ("MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD", "VOLUME")
"""Types of objects that may stand in the way."""


def add_light_and_camera(context: bpy.types.Context, armature: bpy.types.Object) -> None:
    """A low sun, where there is none, and a camera on the last steps, for a scene without one or a new file."""
    scene = context.scene
    place = armature.location + LAST_STEPS
    if not any(isinstance(obj.data, bpy.types.SunLight) for obj in scene.objects):
        sun: Any = bpy.data.lights.new("Walking Figure Sun", "SUN")
        sun.energy, sun.angle, sun.color = SUN, radians(0.5), (1.0, 0.87, 0.72)
        _link(armature, sun).rotation_euler = (pi / 2 - SUN_HEIGHT, 0.0, LOOK + SUN_ASIDE - pi / 2)
    camera = _link(armature, bpy.data.cameras.new("Walking Figure Camera"))
    camera.rotation_euler = show_prints.low_from(LOOK, DOWN).to_euler()
    camera.location = place + show_prints.low_from(LOOK, DOWN) @ Vector((0.0, 0.0, FAR))
    if scene.camera is None or not bpy.data.filepath:
        scene.camera = camera


def _link(armature: bpy.types.Object, data: Any) -> bpy.types.Object:
    """A new object of some data, in the figure's collections."""
    obj = bpy.data.objects.new(data.name, data)
    for collection in armature.users_collection:
        collection.objects.link(obj)
    return obj


class SOFTGROUND_OT_add_sample_scene(Act):
    """Add a walking figure to try SoftGround with, a sun and a camera, beside what is there. The camera becomes the
    scene's if it has none or the file was never saved; the rest stays as it is"""

    bl_idname = "softground.add_sample_scene"
    bl_label = "Add Sample Scene"

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        return "" if context.mode == "OBJECT" else "Leave Edit Mode first"

    def act(self, context: bpy.types.Context) -> None:
        armature = add_walking_figure(context)
        add_light_and_camera(context, armature)
        if show_prints.is_free(context.area):
            show_prints.turn(context.area, armature.location + FIRST_STEPS, LOOK, FAR)
        self.say("Added '{name}': press Add Character, then Bake Footprints", name=armature.name)


CLASSES = (SOFTGROUND_OT_add_sample_scene,)
