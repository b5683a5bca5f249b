"""Ground presets in Blender's preset menu: those that come with the add-on, and the user's own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import bpy
from bpy.props import FloatProperty, StringProperty

from ...core.errors import InputError
from ...core.files import files
from ...core.ground import presets
from .. import settings
from ..characters.character_setup import characters_of, title_of
from ..operator_base import OnShot, reports_errors
from ..reading import analysis
from ..settings import user_folder
from . import preset_icons


def listed(folder: Path) -> tuple[list[tuple[Path, presets.Preset]], list[str]]:
    """The presets of a folder by name, and what is wrong with the files that are none."""
    found, broken = [], []
    for path in sorted(folder.glob("*.json")):
        try:
            found.append((path, presets.load(path)))
        except InputError as error:
            broken.append(str(error))
    return sorted(found, key=lambda entry: entry[1].name.casefold()), broken


_read: dict[Path, tuple[int, presets.Preset]] = {}
"""Preset files that were read, each with the time at which it was written [ns]: a panel asks at each drawing."""


def title_of_ground(scene: bpy.types.Scene) -> str:
    """The name of the preset that was loaded last, and whether the ground is still as it says."""
    name = settings.preset_of(scene)
    preset = _last_read(name)
    return f"{name} (modified)" if preset and not settings.holds(scene, preset) else name


def picture_of_ground(scene: bpy.types.Scene) -> int:
    """The number of the picture of the preset that was loaded last; 0 where it has none."""
    return next(filter(None, map(preset_icons.of, _files_of(settings.preset_of(scene)))), 0)


def _files_of(name: str) -> Iterator[Path]:
    """Where a preset of that name is, if it comes with the add-on, and if it is the user's."""
    yield presets.FOLDER / _file_name(name)
    yield _file_for(name)


def _last_read(name: str) -> presets.Preset | None:
    """The preset of that name; None where there is none any more."""
    for path in _files_of(name):
        with suppress(OSError, InputError):
            written = path.stat().st_mtime_ns
            if path not in _read or _read[path][0] != written:
                _read[path] = written, presets.load(path)
            return _read[path][1]
    return None


class SOFTGROUND_MT_presets(bpy.types.Menu):
    """Choose what the ground is made of"""

    bl_label = "Ground Presets"

    def draw(self, _context: bpy.types.Context) -> None:
        layout: Any = self.layout
        for folder in (presets.FOLDER, user_folder()):
            found, broken = listed(folder)
            if folder != presets.FOLDER and (found or broken):
                layout.separator()
            for path, preset in found:
                is_ours, picture = folder == presets.FOLDER, preset_icons.of(path)
                shown = {"icon_value": picture} if picture else {"icon": "BLANK1"}
                entry = layout.operator("softground.load_preset", text=preset.name, translate=is_ours, **shown)
                entry.filepath = str(path)
            for message in broken:
                layout.label(text=message, icon="ERROR", translate=False)


class SOFTGROUND_OT_load_preset(bpy.types.Operator):
    """Set the ground to a preset"""

    bl_idname = "softground.load_preset"
    bl_label = "Load Ground Preset"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(name="Name", description="Name of a preset")
    filepath: StringProperty(name="File", description="Preset file, instead of a name", subtype="FILE_PATH")

    @classmethod
    def description(cls, context: bpy.types.Context, properties: Any) -> str:
        """Source of the preset, and the depth to expect from it for the characters of the scene."""
        try:
            preset = _chosen(properties)
        except InputError as error:
            return str(error)
        lines = [preset.source] if preset.source else []
        depth = analysis.expected_depth(settings.scene_of(context), preset.material)
        if depth is not None:
            who = ", ".join(title_of(c) for c in characters_of(settings.scene_of(context)))
            lines.append(f"Depth of the typical step of {who}: {depth * 100:.1f} cm")
        return "\n".join(lines)

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        settings.apply_preset(settings.scene_of(context), _chosen(self))
        return {"FINISHED"}


def _chosen(properties: Any) -> presets.Preset:
    path = bpy.path.abspath(properties.filepath)
    return presets.load(Path(path)) if path else presets.find(properties.name, (presets.FOLDER, user_folder()))


class SOFTGROUND_OT_save_preset(bpy.types.Operator):
    """Save the ground as a preset of your own"""

    bl_idname = "softground.save_preset"
    bl_label = "Add Ground Preset"
    bl_options = {"REGISTER"}

    name: StringProperty(name="Name", description="Name of the preset in the menu", default="My Ground")
    source: StringProperty(name="Source", description="Where the numbers come from; shown in the tooltip")

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        return context.window_manager.invoke_props_dialog(self)

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        name = self.name.strip()
        if not name:
            raise InputError("A preset needs a name: type one.")
        scene = settings.scene_of(context)
        if any(preset.name == name for _, preset in listed(presets.FOLDER)[0]):
            raise InputError(f"'{name}' comes with SoftGround: choose another name.")
        preset = settings.as_preset(scene, name, self.source)
        path = _file_for(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        files.write_text(path, presets.dump(preset))
        scene.softground.material.preset = name
        self.report({"INFO"}, f"Saved preset '{name}'")
        return {"FINISHED"}


class SOFTGROUND_OT_remove_preset(bpy.types.Operator):
    """Delete the current preset, if it is your own; the ground keeps its values"""

    bl_idname = "softground.remove_preset"
    bl_label = "Remove Ground Preset"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether the chosen preset is one of the user's."""
        cls.poll_message_set("Built-in presets cannot be deleted; choose one of your own")
        return _file_for(settings.scene_of(context).softground.material.preset).is_file()

    def execute(self, context: bpy.types.Context) -> set[str]:
        _file_for(settings.scene_of(context).softground.material.preset).unlink()
        return {"FINISHED"}


def _file_for(name: str) -> Path:
    """File in which the user's preset of that name is kept."""
    return user_folder() / f"{bpy.path.clean_name(name).casefold()}.json"


def _file_name(name: str) -> str:
    """Name of the file in which a preset comes with the add-on: `Fresh Snow (field)` in `fresh_snow.json`."""
    return name.partition(" (")[0].casefold().replace(" ", "_") + ".json"


class SOFTGROUND_OT_predict_depth(OnShot, bpy.types.Operator):
    """Read the animation and predict how deep the prints will be, before any bake"""

    bl_idname = "softground.predict_depth"
    bl_label = "Predict Depth"
    bl_options = {"REGISTER"}

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        analysis.forget()
        scene = settings.scene_of(context)
        depth = analysis.expected_depth(scene) if analysis.read(scene) else None
        deepest = analysis.deepest(analysis.read(scene), settings.snapshot(scene))
        self.report({"INFO"}, f"Typical step: {(depth or 0.0) * 100:.1f} cm deep; the deepest: {deepest * 100:.1f} cm")
        return {"FINISHED"}


class SOFTGROUND_OT_match_depth(OnShot, bpy.types.Operator):
    """Set the stiffness of the ground so that the typical step is as deep as you type"""

    bl_idname = "softground.match_depth"
    bl_label = "Match Depth"
    bl_options = {"REGISTER", "UNDO"}

    depth: FloatProperty(
        name="Depth (cm)", description="Depth of the typical step", default=5.0, min=0.01, soft_max=30.0, precision=2
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        depth = analysis.expected_depth(settings.scene_of(context))
        if depth:
            self.depth = depth * 100
        return context.window_manager.invoke_props_dialog(self)

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = settings.scene_of(context)
        scene.softground.material.youngs_modulus = analysis.match_depth(scene, self.depth / 100)
        return {"FINISHED"}


CLASSES = (
    SOFTGROUND_MT_presets,
    SOFTGROUND_OT_load_preset,
    SOFTGROUND_OT_save_preset,
    SOFTGROUND_OT_remove_preset,
    SOFTGROUND_OT_predict_depth,
    SOFTGROUND_OT_match_depth,
)
