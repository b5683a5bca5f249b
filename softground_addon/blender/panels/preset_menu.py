"""Ground presets in Blender's preset menu: those that come with the add-on, and the user's own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, StringProperty

from ...core.errors import InputError
from ...core.files import files
from ...core.ground import presets
from .. import ground_presets, settings
from ..characters import character_setup
from ..operator_base import Act
from ..preset_files import listed, loaded, user_folder
from ..reading import analysis
from ..translation import CONTEXT, translated
from . import preset_icons


def title_of_ground(options: Any) -> str:
    """The name of the preset that was loaded last, and whether the ground is still as it says."""
    name = ground_presets.preset_of(options)
    path, preset = next(_presets_of(name), (None, None))
    shown = translated(name) if path and path.parent == presets.FOLDER else name
    changed = preset and not ground_presets.holds(options, preset)
    return translated("{name} (modified)", name=shown) if changed else shown


def picture_of_ground(options: Any) -> int:
    """The number of the picture of the preset that was loaded last; 0 where it has none."""
    return next(filter(None, (preset_icons.of(path) for path, _ in _presets_of(ground_presets.preset_of(options)))), 0)


def _presets_of(name: str) -> Iterator[tuple[Path, presets.Preset]]:
    """The preset of that name with its file: that which comes with the add-on, and the user's."""
    for path in (presets.FOLDER / _shipped_file_name(name), _users_file(name)):
        with suppress(OSError, InputError):
            preset = loaded(path)
            if preset.name == name:
                yield path, preset


class SOFTGROUND_MT_presets(bpy.types.Menu):
    """Choose what the ground is made of"""

    bl_label = "Ground Presets"

    def draw(self, context: bpy.types.Context) -> None:
        layout: Any = self.layout
        ours, _ = listed(presets.FOLDER)
        paths = {preset: path for path, preset in ours}
        for section, title in presets.SECTIONS.items():
            layout.label(text=title, text_ctxt=CONTEXT)
            for preset in presets.soft_to_firm(built_in for built_in in paths if built_in.section == section):
                _entry(layout, paths[preset], preset, translate=True)
        own_presets, broken = listed(user_folder())
        if own_presets or broken:
            layout.separator()
        for path, preset in own_presets:
            _entry(layout, path, preset, translate=False)
        for message in broken:
            layout.label(text=message, icon="ERROR", translate=False)
        if _chosen_of_user(context):
            layout.operator("softground.remove_preset", text="Remove Ground Preset", icon="TRASH")


def _entry(layout: Any, path: Path, preset: presets.Preset, *, translate: bool) -> None:
    picture = preset_icons.of(path)
    shown = {"icon_value": picture} if picture else {"icon": "BLANK1"}
    layout.operator("softground.load_preset", text=preset.name, translate=translate, **shown).filepath = str(path)


class SOFTGROUND_OT_load_preset(Act):
    """Set the ground to a preset"""

    bl_idname = "softground.load_preset"
    bl_label = "Load Ground Preset"

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
        depth = analysis.expected_depth(context.scene, preset.material)
        if depth is not None:
            who = ", ".join(
                character_setup.title_of(c) for c in character_setup.characters_of(settings.options_of(context))
            )
            lines.append(
                translated("Depth of the typical step of {who}: {depth} cm", who=who, depth=f"{depth * 100:.1f}")
            )
        return "\n".join(lines)

    def act(self, context: bpy.types.Context) -> None:
        ground_presets.apply_preset(settings.options_of(context), _chosen(self))


def _chosen(properties: Any) -> presets.Preset:
    path = bpy.path.abspath(properties.filepath)
    return presets.load(Path(path)) if path else presets.find(properties.name, (presets.FOLDER, user_folder()))


class SOFTGROUND_OT_save_preset(Act):
    """Save the ground as a preset of your own"""

    bl_idname = "softground.save_preset"
    bl_label = "Add Ground Preset"
    bl_options = {"REGISTER"}

    name: StringProperty(name="Name", description="Name of the preset in the menu", default="My Ground", maxlen=64)
    source: StringProperty(name="Source", description="Where the numbers come from; shown in the tooltip")
    replace: BoolProperty(
        name="Replace", description="Replace your preset that has this name already", options={"SKIP_SAVE"}
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, _context: bpy.types.Context) -> None:
        layout: Any = self.layout
        layout.use_property_split = True
        layout.prop(self, "name")
        layout.prop(self, "source")
        if _with_like_name(self.name, user_folder()):
            layout.prop(self, "replace")

    def act(self, context: bpy.types.Context) -> None:
        name = self.name.strip()
        if not presets.bare(name):
            raise InputError("A preset needs a name with letters or digits: type one.")
        scene = context.scene
        if _with_like_name(name, presets.FOLDER):
            raise InputError(f"'{name}' comes with SoftGround: choose another name.")
        older, path = _with_like_name(name, user_folder()), _users_file(name)
        if older and not self.replace:
            raise InputError(
                f"You have a preset like '{name}' ({older[0].name}): choose another name, or tick Replace."
            )
        preset = ground_presets.as_preset(scene.softground, name, self.source)
        path.parent.mkdir(parents=True, exist_ok=True)
        files.write_text(path, presets.dump(preset))
        for other in older:
            if other != path:
                other.unlink()
        scene.softground.material.preset = name
        self.say("Saved preset '{name}'", name=name)


class SOFTGROUND_OT_remove_preset(Act):
    """Delete the current preset, if it is your own; the ground keeps its values"""

    bl_idname = "softground.remove_preset"
    bl_label = "Remove Ground Preset"
    bl_options = {"REGISTER"}

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        return "" if _chosen_of_user(context) else "Built-in presets cannot be deleted; choose one of your own"

    def act(self, context: bpy.types.Context) -> None:
        path = _chosen_of_user(context)
        assert path is not None
        path.unlink()


def _chosen_of_user(context: bpy.types.Context) -> Path | None:
    """The file of the current preset, if it is the user's."""
    current = _presets_of(settings.options_of(context).material.preset)
    return next((path for path, _ in current if path.parent == user_folder()), None)


def _with_like_name(name: str, folder: Path) -> list[Path]:
    """The presets of a folder that a name cannot be told from: by their letters and digits."""
    wanted = presets.bare(name)
    named = {path for path, preset in listed(folder)[0] if presets.bare(preset.name) == wanted}
    return sorted(named | {path for path in folder.glob("*.json") if presets.bare(path.stem) == wanted})


def _users_file(name: str) -> Path:
    """File in which the user's preset of that name is kept; names of the same letters and digits share one."""
    return user_folder() / f"{presets.bare(name)}.json"


def _shipped_file_name(name: str) -> str:
    """Name of the file in which a preset comes with the add-on: `Fresh Snow (field)` in `fresh_snow.json`."""
    return name.partition(" (")[0].casefold().replace(" ", "_") + ".json"


CLASSES = (
    SOFTGROUND_MT_presets,
    SOFTGROUND_OT_load_preset,
    SOFTGROUND_OT_save_preset,
    SOFTGROUND_OT_remove_preset,
)
