"""*Make Sound*: the steps as a file beside the .blend, and as a strip of the sequencer at the right frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, StringProperty

from ...core.errors import InputError
from ...core.files import files
from .. import compat
from ..operator_base import Act, OnBake, beside_file
from ..translation import translated
from . import sound_exports

STRIP = "SoftGround Footsteps"
FILE = "footsteps.wav"


def put_strip(strips: Any, path: Path, frame: int) -> Any:
    """A sound strip at a frame, in the place of ours among these, else on the first free channel."""
    older = _strip(strips)
    channel, volume = (older.channel, older.volume) if older else (_free_channel(strips), 1.0)
    if older:
        sound = older.sound
        strips.remove(older)
        if sound is not None and not sound.users:
            bpy.data.sounds.remove(sound)
    strip = strips.new_sound(STRIP, str(path), channel, frame)
    strip.volume = volume
    return strip


def _strip(strips: Any) -> Any:
    """The strip that was added before; None if there is none any more."""
    return next((strip for strip in strips if strip.type == "SOUND" and strip.name.startswith(STRIP)), None)


def _is_others(scene: bpy.types.Scene, path: Path) -> bool:
    """True if there is a file that the strip which was added before does not play."""
    strip = _strip(compat.strips_of(scene) if scene.sequence_editor else ())
    played = Path(bpy.path.abspath(strip.sound.filepath)) if strip is not None and strip.sound else None
    return path.exists() and (played is None or files.identity(played) != files.identity(path))


def _free_channel(strips: Any) -> int:
    return 1 + max((strip.channel for strip in strips), default=0)


class SOFTGROUND_OT_make_sound(OnBake, Act):
    """Compute the sound of the footsteps from their forces, save it beside the file, and add it to the sequencer"""

    bl_idname = "softground.make_sound"
    bl_label = "Make Sound"

    samples: StringProperty(
        name="Own Sounds",
        description="Folder of WAV files of single steps to play instead; the force of a step sets how loud it is. "
        "Files named after a ground, such as snow_1.wav, are used on that ground only",
        subtype="DIR_PATH",
    )
    stereo: BoolProperty(
        name="Stereo from Camera",
        description="Hear each step from where the camera sees it, quieter the farther away it is",
    )

    replace: BoolProperty(
        name="Replace File", description="Write over the sound that is beside the file already", options={"SKIP_SAVE"}
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: bpy.types.Context) -> None:
        layout: Any = self.layout
        layout.use_property_split = True
        layout.prop(self, "samples")
        layout.prop(self, "stereo")
        if _is_others(context.scene, beside_file(FILE)):
            layout.label(
                text=translated("There is a {file} already", file=beside_file(FILE).name), icon="ERROR", translate=False
            )
            layout.prop(self, "replace")

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        if not bpy.data.filepath:
            raise InputError("The sound is written beside the .blend file: save the file first.")
        path, options = beside_file(FILE), scene.softground
        if not self.replace and _is_others(scene, path):
            raise InputError(f"There is a '{path.name}' already: tick Replace File, or move that file.")
        sound_exports.write(
            scene,
            path,
            options.frame_start,
            options.frame_end,
            samples=Path(bpy.path.abspath(self.samples)) if self.samples else None,
            stereo=self.stereo,
        )
        if compat.PLAYS_SOUND:
            put_strip(compat.strips_of(scene), path, options.frame_start)
            compat.show_in_sequencer(context, scene)
        self.say("Wrote {path}, and put it into the sequencer" if compat.PLAYS_SOUND else "Wrote {path}", path=path)


CLASSES = (SOFTGROUND_OT_make_sound,)
