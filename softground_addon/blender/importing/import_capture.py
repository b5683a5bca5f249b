"""File > Import > Motion Capture: C3D, TRC and AMASS files as rigs that bake like any other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, StringProperty
from mathutils import Vector

from ...core.capture import amass, c3d, trc
from ...core.capture.captured import Plate
from ...core.capture.joint_centres import UPWARD, CapturedBody, captured_body
from ...core.capture.skeleton import Skeleton, skeleton_of
from ...core.errors import InputError
from ...core.files import files
from ...core.numerics.arrays import Array
from ...core.numerics.orientation import quaternions, without_leaps
from ..animation_layer.layer_curves import LayerCurve, assign_action, new_action
from ..operator_base import OperatorResult, reports_errors
from ..rigs.object_data import armature_of, pose_bones
from ..settings import timeline_of, units_of
from ..translation import translated

LARGEST = 2**29
"""Size of a file that is read [bytes]."""

MARKERS: dict[str, Any] = {".c3d": c3d, ".trc": trc}
"""Modules that read files of markers, by their suffix."""


def read_body(path: Path, up: str | None = None) -> CapturedBody:
    """The body in a file of motion capture.

    Raises
    ------
    InputError
        If the file cannot be read, or holds no body.
    """
    suffix = path.suffix.lower()
    if suffix not in (*MARKERS, ".npz"):
        raise InputError(
            f"'{path.name}' is not motion capture that SoftGround can read: choose a .c3d, .trc or AMASS .npz file"
        )
    try:
        content = files.read_regular(path, LARGEST)
    except OSError as error:
        raise InputError(f"'{path.name}' cannot be read ({error.strerror}): choose another file") from error
    return amass.read(content) if suffix == ".npz" else captured_body(MARKERS[suffix].read(content), up)


def new_rig(context: bpy.types.Context, name: str, skeleton: Skeleton, frames: Array, unit: float) -> bpy.types.Object:
    """An armature with the bones and the motion of a skeleton, active and selected.

    Parameters
    ----------
    frames : (F,) float array
        Scene frame of each pose.
    unit : float
        Length of a unit of the scene [m].
    """
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    context.collection.objects.link(armature)
    for obj in context.selected_objects:
        obj.select_set(False)
    context.view_layer.objects.active = armature
    armature.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bones = armature_of(armature).edit_bones
    for bone, matrix in zip(skeleton.bones, skeleton.rest(), strict=True):
        made = bones.new(bone.name)
        made.head, made.tail = (Vector((point / unit).tolist()) for point in (bone.head, bone.tail))
        made.align_roll(Vector(matrix[:3, 2].tolist()))
        made.parent = bones.get(bone.parent) if bone.parent else None
    bpy.ops.object.mode_set(mode="OBJECT")
    _animate(armature, skeleton, frames, unit)
    return armature


def _animate(armature: bpy.types.Object, skeleton: Skeleton, frames: Array, unit: float) -> None:
    """Key places and turns of all bones."""
    channels, curves = skeleton.channels(), []
    for index, bone in enumerate(skeleton.bones):
        path = pose_bones(armature)[bone.name].path_from_id()
        turns = without_leaps(quaternions(channels[:, index, :3, :3]))
        places = channels[:, index, :3, 3] / unit
        for what, values in (("location", places), ("rotation_quaternion", turns)):
            curves += [
                LayerCurve(f"{path}.{what}", axis, bone.name, frames, column) for axis, column in enumerate(values.T)
            ]
    assign_action(armature, new_action(armature.name, armature, curves))


def new_plate(context: bpy.types.Context, name: str, plate: Plate, frames: Array, unit: float) -> bpy.types.Object:
    """A force plate as a mesh with its force as animated custom properties `force_x`, `force_y`, `force_z` [N].

    Parameters
    ----------
    frames : (S,) float array
        Scene frame of each sample.
    unit : float
        Length of a unit of the scene [m].
    """
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(corner) for corner in plate.corners / unit], [], [(0, 1, 2, 3)])
    obj = bpy.data.objects.new(name, mesh)
    context.collection.objects.link(obj)
    curves = []
    for axis, values in zip("xyz", plate.force.T, strict=True):
        obj[f"force_{axis}"] = 0.0
        curves.append(LayerCurve(f'["force_{axis}"]', 0, "Force", frames, values))
    assign_action(obj, new_action(name, obj, curves))
    return obj


class SOFTGROUND_OT_import_capture(bpy.types.Operator):
    """Import motion capture as a rig, at its true speed, with its force plates"""

    bl_idname = "softground.import_capture"
    bl_label = "Import Motion Capture"
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(default="*.c3d;*.trc;*.npz", options={"HIDDEN"})
    up: EnumProperty(
        name="Up",
        description="Axis of the file that points up",
        items=[("AUTO", "Automatic", "From where the hips are above the feet")]
        + [(axis, axis, f"The file's {axis} axis points up") for axis in UPWARD],
    )
    scene_range: BoolProperty(
        name="Set Scene Range", description="Set the scene's first and last frame to those of the motion", default=True
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> OperatorResult:
        """Ask for the file, unless one was dropped."""
        if self.filepath:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reports_errors
    def execute(self, context: bpy.types.Context) -> OperatorResult:
        """Read the whole file, then make the rig."""
        path = Path(bpy.path.abspath(self.filepath))
        body = read_body(path, None if self.up == "AUTO" else self.up)
        skeleton = skeleton_of(body)
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        scene = context.scene
        rate = timeline_of(scene).frame_rate
        first = scene.frame_start

        def frames(count: int, sampled: float) -> Any:
            return first + np.arange(count) * rate / sampled

        unit = units_of(scene).unit_scale_m
        poses = frames(len(skeleton.poses), body.rate)
        rig = new_rig(context, path.stem, skeleton, poses, unit)
        for number, plate in enumerate(body.plates, start=1):
            new_plate(context, f"{path.stem} Plate {number}", plate, frames(len(plate.force), plate.rate), unit)
        if self.scene_range:
            scene.frame_end = max(first, int(np.floor(poses[-1])))
        text = '"{name}": {poses} poses at {rate} Hz'
        if body.plates:
            text = '"{name}": {poses} poses at {rate} Hz and {plates} force plates'
        values = {"name": rig.name, "poses": len(poses), "rate": f"{body.rate:g}", "plates": len(body.plates)}
        self.report({"INFO"}, translated(text, **values))
        return {"FINISHED"}


class SOFTGROUND_FH_capture(bpy.types.FileHandler):
    """Motion capture that is dropped into the viewport"""

    bl_idname = "SOFTGROUND_FH_capture"
    bl_label = "Motion Capture (SoftGround)"
    bl_import_operator = "softground.import_capture"
    bl_file_extensions = ".c3d;.trc"

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Only in a viewport."""
        return context.area is not None and context.area.type == "VIEW_3D"


def draw_in_import_menu(menu: Any, _context: bpy.types.Context) -> None:
    """Append the importer to File > Import."""
    menu.layout.operator("softground.import_capture", text="Motion Capture (.c3d, .trc, .npz)")


def register() -> None:
    """Add the entry."""
    bpy.types.TOPBAR_MT_file_import.append(draw_in_import_menu)


def unregister() -> None:
    """Take the entry away."""
    bpy.types.TOPBAR_MT_file_import.remove(draw_in_import_menu)


CLASSES = (SOFTGROUND_OT_import_capture, SOFTGROUND_FH_capture)
