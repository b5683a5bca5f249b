"""Operators on the grounds of a scene: hard ones, soft ones beside the first and their prints, and their materials."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ...core.errors import InputError
from ...core.ground import presets
from .. import further_grounds, ground_slots, reuse, session, settings
from ..animation_layer.constraint_layer import LayerKind
from ..baking import bake_report
from ..ground import baked_ground, ground_checks, look, trail_detail
from ..ground_slots import HARD
from ..operator_base import Act, Needs, OnGround
from ..operators.panel_base import OnMeshes, RemovesChosen, chosen_of
from ..preset_files import listed, user_folder
from ..reading import analysis
from ..response import response_job
from ..state import state
from ..translation import translated

AS_GROUND = "AS_GROUND"
"""In place of a preset: what the rest of the ground is made of."""


class SOFTGROUND_OT_add_ground(OnMeshes, OnGround, Act):
    """Let the selected meshes take prints too, each by itself: crates, stairs, rocks beside the ground"""

    bl_idname = "softground.add_ground"
    bl_label = "Add Another Ground"

    def act(self, context: bpy.types.Context) -> None:
        options = settings.options_of(context)
        meshes = dict.fromkeys(map(trail_detail.ground_of, self.meshes(context)))
        chosen = [obj for obj in meshes if obj not in settings.grounds_of(options)]
        if not chosen:
            raise InputError("Select meshes to walk on, other than those that are grounds already.")
        for obj in chosen:
            ground_checks.check_usable(obj)
            if fault := ground_checks.hard_fault(obj, options.ground, "beside the ground"):
                raise InputError(fault)
        for obj in chosen:
            further_grounds.add(options, obj)
        names = ", ".join(repr(obj.name) for obj in chosen)
        self.say("Soles print in {names} too", names=names)
        heard = bake_report.baked_grounds(options)
        for obj in [obj for obj in settings.grounds_of(options) if baked_ground.is_baked(obj) and obj not in heard]:
            text = "The bake on '{name}' is older, and left out of sound and events: bake again"
            self.report({"WARNING"}, translated(text, name=obj.name))


class SOFTGROUND_OT_remove_ground(RemovesChosen):
    """Take the ground out of the list; it stays in the scene as it is"""

    bl_idname = "softground.remove_ground"
    bl_label = "Remove Ground"
    of_list = ("grounds", "active_ground")

    def act(self, context: bpy.types.Context) -> None:
        options = settings.options_of(context)
        bake_report.note_prints(options)
        ground = chosen_of(options, *self.of_list).object
        super().act(context)
        if ground in bake_report.unlisted(options):
            text = "'{name}' keeps its prints: clear them, or list it again, in the Ground panel"
            self.report({"WARNING"}, translated(text, name=ground.name))


class SOFTGROUND_OT_choose_ground(Act):
    """Show this ground in the panels: its preset, steps, weather and warnings. The one shown before takes its place"""

    bl_idname = "softground.choose_ground"
    bl_label = "Show This Ground"

    object: StringProperty(
        name="Object", description="Name of the ground; the one chosen in the list if empty", options={"SKIP_SAVE"}
    )

    def act(self, context: bpy.types.Context) -> None:
        options = settings.options_of(context)
        named = next((item for item in options.grounds if item.object and item.object.name == self.object), None)
        item = named if self.object else chosen_of(options, "grounds", "active_ground")
        if item is None or not settings.exists(item.object):
            raise InputError("Choose a ground in the list.")
        with analysis.own_changes(context.scene):
            further_grounds.choose(options, item)


class _Clears(Needs):
    """Operators that take prints away."""

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        is_live = session.current().is_live
        return "Live mode is on: press Keep or Discard first" if is_live else super().missing(context)


class SOFTGROUND_OT_clear_bake(_Clears, Act):
    """Remove the footprints from the ground and the response from the characters, as if there had been no bake"""

    bl_idname = "softground.clear_bake"
    bl_label = "Clear Bake"

    only_shown: BoolProperty(
        name="Only the Ground Shown",
        description="Of several grounds, leave the others and the response as they are",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        options = settings.options_of(context)
        grounds = settings.listed_grounds(options)
        has_any = any(map(baked_ground.has_remains, grounds)) or any(map(look.count_over_theirs, grounds))
        if not has_any and not response_job.has_layers(options):
            return "There is no bake on the ground"
        return super().missing(context)

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        grounds = settings.listed_grounds(scene.softground)
        if self.only_shown and grounds[1:] and not baked_ground.has_remains(grounds[0]):
            raise InputError(f"There is no bake on ground '{grounds[0].name}': show another one, or clear all of them.")
        _clear(scene, grounds[:1] if self.only_shown else grounds)
        if self.only_shown and grounds[1:]:
            return
        with analysis.own_changes(scene):
            response_job.remove_layers(scene, LayerKind.RESPONSE)
        response_job.remove_layers(scene, LayerKind.CLEAN_FEET)  # which the shot was read with
        if scene.softground.grounding.by_button:  # nothing stays switched on that no one has switched on
            scene.softground.grounding.use = scene.softground.grounding.by_button = False


class SOFTGROUND_OT_clear_unlisted(_Clears, Act):
    """Remove the footprints from a ground that is not in the list any more, as if there had been no bake on it"""

    bl_idname = "softground.clear_unlisted"
    bl_label = "Clear Prints"

    object: StringProperty(
        name="Object", description="Name of the ground; all that have left the list if empty", options={"SKIP_SAVE"}
    )

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        has_prints = bake_report.unlisted(settings.options_of(context))
        return super().missing(context) if has_prints else "No ground that left the list has prints"

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        grounds = bake_report.unlisted(scene.softground)
        chosen = [obj for obj in grounds if self.object in ("", obj.name)]
        if not chosen:
            raise InputError(f"There is no ground '{self.object}' with prints outside the list.")
        _clear(scene, chosen)


def _clear(scene: bpy.types.Scene, grounds: Sequence[bpy.types.Object]) -> None:
    """Take the prints off some grounds, or off none where one of them cannot be changed (InputError)."""
    for ground in filter(baked_ground.has_remains, grounds):
        baked_ground.check_writable(ground)
    reuse.forget()
    with analysis.own_changes(scene):
        for ground in grounds:
            if baked_ground.has_remains(ground):
                baked_ground.clear(ground)
            look.take_off(ground)
        bake_report.note_prints(scene.softground)


class SOFTGROUND_OT_add_hard_ground(OnMeshes, Act):
    """Let soles stand on the selected meshes, which take no prints: crates, stairs, floors, rocks"""

    bl_idname = "softground.add_hard_ground"
    bl_label = "Add Hard Ground"

    def act(self, context: bpy.types.Context) -> None:
        options = settings.options_of(context)
        taken = [*settings.grounds_of(options), *settings.hard_grounds_of(options)]
        chosen = [obj for obj in self.meshes(context) if trail_detail.ground_of(obj) not in taken]
        if not chosen:
            raise InputError("Select meshes to stand on, other than the ground and those that are in Hard Ground.")
        for obj in chosen:
            if fault := ground_checks.hard_fault(obj, options.ground):
                raise InputError(fault)
        for obj in chosen:
            options.hard_grounds.add().object = obj
        options.active_hard_ground = len(options.hard_grounds) - 1
        self.say("Soles stand on {names}", names=", ".join(repr(obj.name) for obj in chosen))


class SOFTGROUND_OT_remove_hard_ground(RemovesChosen):
    """Take the object out of the list; it stays in the scene as it is"""

    bl_idname = "softground.remove_hard_ground"
    bl_label = "Remove Hard Ground"
    of_list = ("hard_grounds", "active_hard_ground")


def _choices(_operator: Any, _context: bpy.types.Context | None) -> list[tuple[str, str, str]]:
    """The presets by the names of their files; Blender keeps no copy of these texts, so that the state has to."""
    ours = {preset: path.stem for path, preset in listed(presets.FOLDER)[0]}
    yours = {preset: path.stem for path, preset in listed(user_folder())[0]}
    items = [
        (AS_GROUND, "As the Ground", "The preset of the ground"),
        (HARD, "Hard Floor", "It bears and takes no print: stone, concrete, a deck"),
    ]
    for section, title in presets.SECTIONS.items():
        items += _rows(title, ours, presets.soft_to_firm(each for each in ours if each.section == section))
    state.preset_choices = items + (_rows("Your Own", yours, yours) if yours else [])
    return state.preset_choices


def _rows(title: str, files: dict[presets.Preset, str], shown: Iterable[presets.Preset]) -> list[tuple[str, str, str]]:
    return [("", title, ""), *((files[preset], preset.name, preset.source) for preset in shown)]


class SOFTGROUND_OT_region_preset(Act):
    """Choose what the ground is made of where it has this material"""

    bl_idname = "softground.region_preset"
    bl_label = "Ground of Material"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    slot: IntProperty(name="Slot", description="Number of the material slot", min=0, options={"SKIP_SAVE"})
    preset: EnumProperty(name="Preset", description="What the ground is made of there", items=_choices)

    def act(self, context: bpy.types.Context) -> None:
        ground = settings.options_of(context).ground
        ground_slots.choose(
            ground if settings.exists(ground) else None, self.slot, "" if self.preset == AS_GROUND else self.preset
        )


CLASSES = (
    SOFTGROUND_OT_region_preset,
    SOFTGROUND_OT_add_hard_ground,
    SOFTGROUND_OT_remove_hard_ground,
    SOFTGROUND_OT_add_ground,
    SOFTGROUND_OT_remove_ground,
    SOFTGROUND_OT_choose_ground,
    SOFTGROUND_OT_clear_bake,
    SOFTGROUND_OT_clear_unlisted,
)
