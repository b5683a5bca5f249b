"""The bake as files: the formats, the checks before one is written, and the buttons for it."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ...core.errors import InputError
from ...core.events import event_files, event_midi, events
from ...core.files import files
from .. import settings
from ..baking import bake_report
from ..operator_base import Act, OnBake, beside_file
from ..reading import analysis
from ..translation import translated
from . import event_points, exports, image_exports, opensim_exports, sound_exports

LARGEST_IMAGE = 16384
"""Most pixels along the sides of an image."""


@dataclass(frozen=True)
class Options:
    """Options of an export.

    Attributes
    ----------
    format : str
        Key of one of `FORMATS`.
    path : Path
        The file; of image sequences the folder and the beginning of their names.
    start, end : int
        First and last frame.
    resolution : int
        Width and height of images [pixels].
    uv_map : str
        UV map of images; by default the one that is rendered.
    outdated : bool
        True to write a bake that no longer fits its inputs.
    samples : Path, optional
        Folder of recordings, of sounds.
    stereo : bool
        True if sounds come from where the camera sees the steps.
    """

    format: str
    path: Path
    start: int
    end: int
    resolution: int = 2048
    uv_map: str = ""
    outdated: bool = False
    samples: Path | None = None
    stereo: bool = False


Writer = Callable[[bpy.types.Object, Options], list[Path]]
"""Writes a ground of the open scene; returns the files."""


def _images(ground: bpy.types.Object, options: Options) -> list[Path]:
    scene = bpy.context.scene
    return image_exports.export_images(
        ground,
        options.path.parent,
        options.start,
        options.end,
        units=settings.units_of(scene),
        resolution=options.resolution,
        uv_map=options.uv_map,
        name=options.path.stem,
        floors=settings.hard_grounds_of(scene.softground),
    )


def _moving(of: Callable[[], Callable[[bpy.types.Object, Path, int, int], None]]) -> Writer:
    """A writer of one file that holds all frames, by a function that is looked up as it is needed."""

    def writer(ground: bpy.types.Object, options: Options) -> list[Path]:
        of()(ground, options.path, options.start, options.end)
        return [options.path]

    return writer


def _still(ground: bpy.types.Object, options: Options) -> list[Path]:
    exports.export_final(ground, options.path)
    return [options.path]


def _events(of: Callable[[], Callable[..., str | bytes]], *, is_timed: bool = True) -> Writer:
    """A writer of the events of some frames, their times counted from the first; `is_timed` needs the frame rate."""

    def writer(_ground: bpy.types.Object, options: Options) -> list[Path]:
        scene = bpy.context.scene
        rate, bakes = settings.timeline_of(scene).frame_rate, bake_report.heard_bakes(scene.softground)
        table = events.between(event_points.events_of(bakes), options.start, options.end, rate)
        content = of()(table, frame_rate=rate) if is_timed else of()(table)
        with files.replacing(options.path) as partial:
            partial.write_bytes(content.encode() if isinstance(content, str) else content)
        return [options.path]

    return writer


def _opensim(_ground: bpy.types.Object, options: Options) -> list[Path]:
    loads = analysis.read(bpy.context.scene).loads
    return opensim_exports.write(loads, options.path, options.start, options.end)


def _sound(_ground: bpy.types.Object, options: Options) -> list[Path]:
    scene, frames = bpy.context.scene, (options.start, options.end)
    sound_exports.write(scene, options.path, *frames, samples=options.samples, stereo=options.stereo)
    return [options.path]


@dataclass(frozen=True)
class Format:
    """A kind of file that a bake can be written to.

    Attributes
    ----------
    suffix : str
        Of its files.
    label, description : str
        For the user.
    write : callable
        Writes a baked ground of the open scene with `Options`; returns the files.
    built : bool
        False where the Blender that we run in was built without it, as those of some Linux distributions are.
    """

    suffix: str
    label: str
    description: str
    write: Writer
    built: bool = True

    @property
    def of_ground(self) -> bool:
        """True if it shows a ground, and not what happens on all of them."""
        return self.suffix in (".abc", ".usdc", ".pc2", ".exr", ".obj")

    @property
    def missing(self) -> str:
        """The reason for which it cannot be written; empty where it can."""
        return "" if self.built else f"This Blender was built without {self.label}: choose another format"


_BUILT = bpy.app.build_options

FORMATS = {
    "ALEMBIC": Format(".abc", "Alembic", "The moving ground", _moving(lambda: exports.export_alembic), _BUILT.alembic),
    "USD": Format(
        ".usdc", "USD", "The moving ground with its shading attributes", _moving(lambda: exports.export_usd), _BUILT.usd
    ),
    "PC2": Format(
        ".pc2",
        "Point Cache (PC2)",
        "Positions of the ground's vertices, for a mesh cache",
        _moving(lambda: exports.export_point_cache),
    ),
    "EXR": Format(
        ".exr",
        "Images (EXR)",
        "Displacement, and compression, rim and age as a mask, in the ground's UV map; marks in those of floors",
        _images,
        _BUILT.image_openexr,
    ),
    "OBJ": Format(
        ".obj", "Final Mesh (OBJ)", "The ground as it is after the last step", _still, _BUILT.io_wavefront_obj
    ),
    "EVENTS_JSON": Format(
        ".jsonl",
        "Events (JSON Lines)",
        "Heel strikes, toe-offs and slides, for game engines",
        _events(lambda: event_files.json_lines),
    ),
    "EVENTS_MIDI": Format(
        ".mid",
        "Events (MIDI)",
        "Each step as a note, for samplers and drum machines",
        _events(lambda: event_midi.dump, is_timed=False),
    ),
    "EVENTS_REAPER": Format(
        ".csv",
        "Events (Reaper)",
        "Regions and markers for Reaper",
        _events(lambda: event_files.reaper, is_timed=False),
    ),
    "EVENTS_EDL": Format(
        ".edl",
        "Events (Resolve)",
        "Timeline markers for DaVinci Resolve",
        _events(lambda: event_files.edl),
    ),
    "EVENTS_OTIO": Format(
        ".otio",
        "Events (OpenTimelineIO)",
        "Timeline markers for editors",
        _events(lambda: event_files.otio),
    ),
    "OPENSIM_MOT": Format(
        ".mot",
        "OpenSim Loads (MOT)",
        "Forces, centres of pressure and free moments, with the external loads as XML",
        _opensim,
    ),
    "OPENSIM_STO": Format(
        ".sto",
        "OpenSim Storage (STO)",
        "Forces, centres of pressure and free moments as a storage file",
        _opensim,
    ),
    "WAV": Format(".wav", "Footsteps (WAV)", "The sound of the steps, computed from their forces", _sound),
}
"""All formats: a further one is a row here."""


def export(scene: bpy.types.Scene, options: Options) -> list[Path]:
    """Write the bake on the scene's ground; returns the files.

    Raises
    ------
    InputError
        If Blender lacks the format, there is no bake, it is outdated, or the files cannot be written; says what to do.
    """
    if missing := FORMATS[options.format].missing:
        raise InputError(f"{missing}.")
    ground = _ground(scene, outdated=options.outdated)
    if options.end < options.start:
        raise InputError(
            f"The frames {options.start} to {options.end} leave nothing to write: set the first frame before the last."
        )
    path = options.path
    if not path.parent.is_dir():
        raise InputError(f"There is no folder '{path.parent}': create it first, or choose another.")
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"The folder '{path.parent}' cannot be written to: choose another.")
    is_open = scene == bpy.context.scene  # the one that Blender's exporters write
    in_scene = nullcontext() if is_open else bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0])
    with in_scene:
        return FORMATS[options.format].write(ground, options)


def with_suffix(path: Path, kind: str) -> Path:
    """The path with the suffix of a format in place of that of another one."""
    known = {each.suffix for each in FORMATS.values()} | {".usd", ".usda"}
    wanted = FORMATS[kind].suffix
    if kind == "USD" and path.suffix in (".usd", ".usda"):
        return path
    return path.with_suffix(wanted) if path.suffix in known else path.with_name(path.name + wanted)


def check_suffix(path: Path, kind: str) -> Path:
    """The path, with the suffix of a format if it has none.

    Raises
    ------
    InputError
        If it has another one: no file gets another name than the user gave.
    """
    named = with_suffix(path, kind)
    if path.suffix and named != path:
        raise InputError(f"'{path.name}' does not end in {named.suffix}: give --output a name that does.")
    return named


def default_path(ground: bpy.types.Object | None, kind: str) -> Path:
    """A file beside the .blend, named after it and the ground."""
    return with_suffix(beside_file(bpy.path.clean_name(ground.name) if ground else "ground"), kind)


def _ground(scene: bpy.types.Scene, *, outdated: bool) -> bpy.types.Object:
    """The scene's ground, whose bake is fit to be written."""
    ground: bpy.types.Object | None = scene.softground.ground
    if ground is None:
        raise InputError(f"Scene '{scene.name}' has no ground with a bake: press Bake Footprints first.")
    exports.baked_display_mesh(ground)
    reasons = () if outdated else bake_report.stale_reasons(scene)
    if reasons:
        raise InputError(
            f"The bake on ground '{ground.name}' is outdated ({'; '.join(reasons)}): bake again, or turn on "
            "Allow Outdated."
        )
    return ground


class SOFTGROUND_OT_export(OnBake, Act):
    """Write the baked ground for other programs: Alembic, USD, a point cache, image sequences or the final mesh"""

    bl_idname = "softground.export"
    bl_label = "Export Ground"
    bl_options = {"REGISTER", "PRESET"}

    filepath: StringProperty(name="File", description="File to write", subtype="FILE_PATH")
    check_existing: BoolProperty(default=True, options={"HIDDEN"})  # the file browser shows it in red
    filter_glob: StringProperty(
        default=";".join(f"*{each.suffix}" for each in FORMATS.values()) + ";*.usd;*.usda", options={"HIDDEN"}
    )
    format: EnumProperty(
        name="Format",
        description="Kind of file",
        items=[(kind, each.label, each.missing or each.description) for kind, each in FORMATS.items()],
        default=next(kind for kind, each in FORMATS.items() if each.built),
    )
    frame_start: IntProperty(name="First Frame", description="First frame to write", default=1)
    frame_end: IntProperty(name="Last Frame", description="Last frame to write", default=250)
    resolution: IntProperty(
        name="Resolution", description="Width and height of the images", default=2048, min=16, max=LARGEST_IMAGE,
        subtype="PIXEL",
    )  # fmt: skip
    uv_map: StringProperty(name="UV Map", description="UV map for the images; if empty, the one used for rendering")
    outdated: BoolProperty(
        name="Allow Outdated", description="Export the bake even if it no longer fits what it was made from"
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        scene = context.scene
        options = scene.softground
        self.frame_start, self.frame_end = options.frame_start, options.frame_end
        self.filepath = str(default_path(options.ground, self.format))
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def check(self, _context: bpy.types.Context) -> bool:
        """Let the file's suffix follow the format."""
        path = str(with_suffix(Path(self.filepath), self.format))
        changed = path != self.filepath
        self.filepath = path
        return changed

    def draw(self, context: bpy.types.Context) -> None:
        layout: Any = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column(align=True)
        column.use_property_split = False
        for kind, export_format in FORMATS.items():
            row = column.row()
            row.enabled = export_format.built
            row.prop_enum(self, "format", kind)
        if self.format != "OBJ":
            column = layout.column(align=True)
            column.prop(self, "frame_start", text="Frame Start")
            column.prop(self, "frame_end", text="End")
        if self.format == "EXR":
            column = layout.column()
            column.prop(self, "resolution")
            column.prop_search(self, "uv_map", settings.options_of(context).ground.data, "uv_layers")
            column = layout.column(align=True)
            column.active = False
            for kind in image_exports.kinds_of(settings.options_of(context).ground):
                column.label(text=f"…_{kind}_{self.frame_start:04d}.exr", translate=False)
        layout.prop(self, "outdated")

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        set_frames = self.properties.is_property_set("frame_start") or self.properties.is_property_set("frame_end")
        options = scene.softground
        start, end = (self.frame_start, self.frame_end) if set_frames else (options.frame_start, options.frame_end)
        path = Path(bpy.path.abspath(self.filepath)) if self.filepath else default_path(options.ground, self.format)
        path = with_suffix(path, self.format)
        wanted = Options(self.format, path, start, end, self.resolution, self.uv_map, outdated=self.outdated)
        written = export(scene, wanted)
        if FORMATS[self.format].of_ground and len(bake_report.baked_grounds(options)) > 1:
            text = "Wrote ground '{name}' alone: show another one in the Ground panel to write that too"
            text = translated(text, name=options.ground.name)
        elif len(written) == 1:
            text = translated("Wrote {path}", path=written[0])
        else:
            text = translated("Wrote {count} files to {folder}", count=len(written), folder=path.parent)
        self.report({"INFO"}, text)


class SOFTGROUND_OT_final_mesh(OnBake, Act):
    """Add the ground as it is after the last step to the scene, as a plain mesh that does not move"""

    bl_idname = "softground.final_mesh"
    bl_label = "Add Final Mesh"

    def act(self, context: bpy.types.Context) -> None:
        still = exports.final_mesh(settings.options_of(context).ground)
        self.say("Added '{name}'", name=still.name)


CLASSES = (SOFTGROUND_OT_export, SOFTGROUND_OT_final_mesh)
