"""The forces of a bake for animators: as animated custom properties of an empty, and as a table."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty, StringProperty

from ...core.errors import SoftGroundError
from ...core.files import files
from ...core.loads import deviation as load_deviation
from ...core.loads import estimate
from ...core.loads import free_moments as foot_moments
from ...core.numerics.arrays import Array
from ...core.record.footprints import Footprint
from .. import compat, settings
from ..ground import baked_ground
from ..operator_base import Act, OnBake, beside_file
from ..reading import analysis
from ..remedies import said
from ..translation import translated

FORCE, CONTACT = "force", "contact"
"""Endings of the properties' names, after a sole's name."""


def forces_over_time(footprints: Sequence[Footprint], frames: Array) -> dict[tuple[str, str], tuple[Array, Array]]:
    """Normal force [N] and contact (0 or 1) of every sole at scene frames.

    Parameters
    ----------
    frames : (N,) float array

    Returns
    -------
    dict of (character, sole) to two (N,) float arrays
    """
    curves: dict[tuple[str, str], tuple[Array, Array]] = {}
    for footprint in (each for each in footprints if len(each.load_n)):
        key = (footprint.character, footprint.sole)
        force, contact = curves.setdefault(key, (np.zeros(len(frames)), np.zeros(len(frames))))
        touching = (frames >= footprint.start_frame) & (frames <= footprint.end_frame)
        force[touching] += np.interp(frames[touching], footprint.load_frames, footprint.load_n)
        contact[touching] = 1.0
    return dict(sorted(curves.items()))


ESTIMATED = (
    *("deviation_n", "force_x_n", "force_y_n", "force_z_n"),
    *("centre_x_m", "centre_y_m", "centre_z_m", "free_moment_nm"),
)
"""Columns of the estimate beside the normal force: its standard deviation, the force of the ground in the world's axes,
its point of action, and the moment about the upward axis there."""

Estimates = Mapping[tuple[str, str], Array]
"""Values of those columns at each frame by character and sole, (N, 8); NaN where there is none."""


def estimates_of(loads: Sequence[estimate.CharacterLoads], frames: Array) -> Estimates:
    """Estimated values at scene frames. Only a body with joints has a deviation and free moments."""
    estimates: dict[tuple[str, str], Array] = {}
    for character in loads:
        touching, known = character.contacts.touching, character.motion.joints and character.motion.centre is None
        nothing = np.full(touching.shape, np.nan)
        deviation, twist = (
            (load_deviation.force_deviation(character), foot_moments.free_moments(character))
            if known
            else (nothing, nothing)
        )
        centre = np.where(touching[..., None], character.forces.centre_of_pressure, np.nan)
        columns = np.concatenate([deviation[..., None], character.forces.forces, centre, twist[..., None]], axis=-1)
        for number, sole in enumerate(character.motion.soles):
            values = [np.interp(frames, character.motion.frames, column) for column in columns[:, number].T]
            estimates[character.motion.name, sole.sole.name] = np.stack(values, axis=1)
    return estimates


def table(footprints: Sequence[Footprint], frames: Array, frame_rate: float, estimates: Estimates | None = None) -> str:
    """The forces as comma-separated values, one row per frame and sole; unknown values stay empty."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["frame", "time_s", "character", "sole", "contact", "force_n", *ESTIMATED])
    curves = forces_over_time(footprints, frames)
    unknown = np.full((len(frames), len(ESTIMATED)), np.nan)
    for place, frame in enumerate(frames):
        for (character, sole), (force, contact) in curves.items():
            time = round((frame - frames[0]) / frame_rate, 6)
            newtons = round(float(force[place]), 3)
            estimated = (estimates or {}).get((character, sole), unknown)[place].tolist()
            cells = [round(value, 4) if np.isfinite(value) else "" for value in estimated]
            rows.writerow([int(frame), time, character, sole, int(contact[place]), newtons, *cells])
    return text.getvalue()


def write_curves(scene: bpy.types.Scene, footprints: Sequence[Footprint], frames: Array) -> list[bpy.types.Object]:
    """Give each character an empty whose custom properties are its forces, in place of the one it may have.

    Parameters
    ----------
    frames : (N,) float array
        Scene frames; the keys are where those are shown if the scene's time is remapped.

    Returns
    -------
    list of bpy.types.Object
        The empties, one per character.
    """
    empties: dict[str, bpy.types.Object] = {}
    times = frames * settings.timeline_of(scene).stretch
    for (character, sole), values in forces_over_time(footprints, frames).items():
        if character not in empties:
            empties[character] = _fresh_empty(scene, f"{character} Forces")
        for what, series in zip((FORCE, CONTACT), values, strict=True):
            _animate(empties[character], f"{sole} {what}", times, series, constant=what == CONTACT)
    return list(empties.values())


def _fresh_empty(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    """The empty of that name without any forces; the user's other animation of it stays."""
    empty = scene.objects.get(name)
    if empty is None or empty.type != "EMPTY":
        empty = bpy.data.objects.new(name, None)
        empty.empty_display_size = 0.2
        scene.collection.objects.link(empty)
    earlier = [key for key in empty.keys() if key.endswith((f" {FORCE}", f" {CONTACT}"))]  # noqa: SIM118
    paths = {_path_of(key) for key in earlier}
    animation: Any = empty.animation_data
    if animation and animation.action and (compat.slot_of(animation) or not compat.HAS_SLOTS):
        curves = compat.channels_of(animation.action, compat.slot_of(animation))
        for curve in [curve for curve in curves if curve.data_path in paths]:
            curves.remove(curve)
    for key in earlier:
        del empty[key]
    return empty


def _path_of(name: str) -> str:
    """Data path of a custom property."""
    return f'["{bpy.utils.escape_identifier(name)}"]'


def _animate(obj: Any, name: str, frames: Array, values: Array, *, constant: bool) -> None:
    """Key a custom property at every frame."""
    obj[name] = 0.0
    obj.id_properties_ui(name).update(min=0.0, description="Normal force of the ground in newtons")
    if constant:
        obj.id_properties_ui(name).update(max=1.0, description="Whether the sole touches the ground")
    path = _path_of(name)
    obj.keyframe_insert(path, frame=float(frames[0]))
    animation: Any = obj.animation_data
    curves = compat.action_curves(animation.action, compat.slot_of(animation))
    curve: Any = next(curve for curve in curves if curve.data_path == path)
    curve.keyframe_points.clear()
    curve.keyframe_points.add(len(frames))
    curve.keyframe_points.foreach_set("co", np.column_stack([frames, values]).astype(np.float32).ravel())
    interpolation = curve.keyframe_points[0].bl_rna.properties["interpolation"].enum_items
    kind = interpolation["CONSTANT" if constant else "LINEAR"].value
    curve.keyframe_points.foreach_set("interpolation", np.full(len(frames), kind, dtype=np.int32))
    curve.update()


def _baked(context: bpy.types.Context) -> tuple[list[Footprint], Array]:
    """The record on the scene's ground, and the frames that it covers."""
    scene = context.scene
    footprints, about = baked_ground.load(scene.softground.ground)
    first, last = about.get("inputs", {}).get("frames", (scene.softground.frame_start, scene.softground.frame_end))
    return footprints, np.arange(first, last + 1, dtype=float)


class SOFTGROUND_OT_force_curves(OnBake, Act):
    """Put the force and contact of every sole on an empty, as animated properties for the Graph Editor and for
    drivers"""

    bl_idname = "softground.force_curves"
    bl_label = "Add Force Curves"

    def act(self, context: bpy.types.Context) -> None:
        empties = write_curves(context.scene, *_baked(context))
        for other in context.selected_objects:
            other.select_set(False)
        for empty in empties:  # the Graph Editor shows the curves of selected objects
            if empty.name in context.view_layer.objects:
                empty.select_set(True)
                if context.mode == "OBJECT":
                    context.view_layer.objects.active = empty
        self.say("The forces are on {names}", names=", ".join(f"'{empty.name}'" for empty in empties))


class SOFTGROUND_OT_export_forces(OnBake, Act):
    """Write the force and contact of every sole at every frame to a table (CSV)"""

    bl_idname = "softground.export_forces"
    bl_label = "Export Forces"
    bl_options = {"REGISTER"}

    filepath: StringProperty(name="File", description="Table to write", subtype="FILE_PATH")
    check_existing: BoolProperty(default=True, options={"HIDDEN"})  # the file browser shows it in red
    filter_glob: StringProperty(default="*.csv", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        self.filepath = str(beside_file("forces.csv"))
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def act(self, context: bpy.types.Context) -> None:
        footprints, frames = _baked(context)
        scene = context.scene
        try:
            estimates = estimates_of(analysis.read(scene).loads, frames)
        except SoftGroundError as error:  # the record exists without its characters
            why = translated("Normal forces only, as the shot cannot be read: {error}", error=said(error))
            self.report({"WARNING"}, why)
            estimates = {}
        path = Path(bpy.path.ensure_ext(bpy.path.abspath(self.filepath), ".csv"))
        files.write_text(path, table(footprints, frames, settings.timeline_of(scene).frame_rate, estimates))
        self.say("Wrote {path}", path=path)


CLASSES = (SOFTGROUND_OT_force_curves, SOFTGROUND_OT_export_forces)
