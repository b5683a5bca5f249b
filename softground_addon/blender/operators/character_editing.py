"""Operators that correct the list of characters: take one out, find its bones again, add and remove soles."""

from __future__ import annotations

from typing import Any, cast

import bpy
import numpy as np
from bpy.props import StringProperty

from ...core.errors import InputError
from .. import jobs, settings
from ..characters import character_setup, contact_editing
from ..characters.import_fixes import mass_of, walk_ahead
from ..operator_base import reports_errors
from ..reading import analysis
from ..rigs.frame_ranges import ancestors
from ..translation import translated
from .modal_job import Reading, Reports
from .panel_base import RemovesChosen, chosen_of


def active_character(options: Any) -> Any:
    """The character that is chosen in the list, or None."""
    return chosen_of(options, "characters", "active_character")


def active_sole(options: Any) -> Any:
    """The sole that is chosen in the list of the active character, or None."""
    return chosen_of(active_character(options), "soles", "active_sole")


class _OnCharacter:
    """Operators that need a chosen character."""

    character: StringProperty(
        name="Character",
        description="Name of the character; the selected one if empty",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    def chosen(self, options: Any) -> Any:
        """The character that is meant.

        Raises
        ------
        InputError
            If none has that name.
        """
        if not self.character:
            return active_character(options)
        for character in options.characters:
            if character_setup.title_of(character) == self.character:
                return character
        raise InputError(f"There is no character '{self.character}': select one in the list.")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if a character is chosen."""
        if active_character(settings.options_of(context)) is None:
            cast("Any", cls).poll_message_set(translated("Add a character first"))
            return False
        return True


class SOFTGROUND_OT_remove_character(RemovesChosen):
    """Remove the character from the list; its armature and the ground stay as they are"""

    bl_idname = "softground.remove_character"
    bl_label = "Remove Character"
    of_list = ("characters", "active_character")


MUCH = 2.0
"""Ratio of a mass to the likely one from which the panel suggests the latter."""


def suggested_mass(character: Any) -> float:
    """Mass that a character's skin or its height suggests where its own differs much [kg], 0 where it does not."""
    likely = mass_of(character)
    differs = likely > 0 and not likely / MUCH < character.mass < likely * MUCH
    return likely if differs else 0.0


class SOFTGROUND_OT_mass_by_volume(_OnCharacter, bpy.types.Operator):
    """Set the mass from the volume of the character's skin, at the density of water; for figures on two legs that
    would be far too heavy, from their height"""

    bl_idname = "softground.mass_by_volume"
    bl_label = "Mass by Volume"
    bl_options = {"REGISTER", "UNDO"}

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        character = active_character(settings.options_of(context))
        if not character.skin_mass > 0:
            raise InputError(f"'{character_setup.title_of(character)}' has no skin to go by: type its mass.")
        character.mass = mass_of(character)
        return {"FINISHED"}


class SOFTGROUND_OT_fix_scale(_OnCharacter, bpy.types.Operator):
    """Scale a character that was made in other units, by parenting it to a scaled empty. Its own animation does not
    change"""

    bl_idname = "softground.fix_scale"
    bl_label = "Fix Import Scale"
    bl_options = {"REGISTER", "UNDO"}

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = settings.scene_of(context)
        character = self.chosen(scene.softground)
        factor = character_setup.fix_scale(scene, character)
        name = character_setup.title_of(character)
        self.report({"INFO"}, translated("'{name}' is scaled by {factor}", name=name, factor=f"{factor:g}"))
        return {"FINISHED"}


class _ReadingCharacter(_OnCharacter, Reading):
    """Base of operators on a character that read its animation."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if a character is chosen, and no other job runs."""
        return super().poll(context) and Reading.poll.__func__(cls, context)


class SOFTGROUND_OT_walk_ahead(_ReadingCharacter):
    """Make a character that walks on the spot travel as fast as its feet slide, by parenting it to a moving empty.
    Its own animation does not change. Esc cancels"""

    bl_idname = "softground.walk_ahead"
    bl_label = "Walk Ahead"

    def _job_of(self, scene: bpy.types.Scene) -> jobs.Job[Reports]:
        character = self.chosen(scene.softground)
        name, mover = character_setup.title_of(character), character.armature or character.body
        rig = mover and settings.name_of(mover)
        known = yield from analysis.reading(scene)
        belt = known.belts.get(name)
        if belt is None or rig is None:
            raise InputError(f"'{name}' does not walk on the spot: its feet rest, or no speed lets all of them rest.")
        walk_ahead(scene, settings.resolve(rig), -belt)
        return [("INFO", translated("'{name}' travels at {speed} m/s", name=name, speed=f"{np.linalg.norm(belt):.1f}"))]


class SOFTGROUND_OT_detect_bones(_ReadingCharacter):
    """Find the character's feet and joints again, from its skin, bone names or rest pose. Esc cancels"""

    bl_idname = "softground.detect_bones"
    bl_label = "Detect Bones"

    def _job_of(self, scene: bpy.types.Scene) -> jobs.Job[list[str]]:
        return character_setup.detecting_bones(scene, scene.softground.active_character)

    def _show(self, result: list[str]) -> None:
        self.report({"INFO"}, translated("Found {parts}", parts=", ".join(result)))


class SOFTGROUND_OT_add_contact(_OnCharacter, bpy.types.Operator):
    """Let the selected bones, objects or vertices of the skin print too: hands, knees, canes, snowshoes. Each
    presses with whichever side faces down"""

    bl_idname = "softground.add_contact"
    bl_label = "Add Contact"
    bl_options = {"REGISTER", "UNDO"}

    @reports_errors
    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = settings.scene_of(context)
        posed = context.object if context.mode == "POSE" else None
        if posed is not None:
            character = next((item for item in scene.softground.characters if item.armature == posed), None)
            if character is None:
                raise InputError(f"'{posed.name}' is not a character yet: press Add Character first.")
            bones = [bone.name for bone in context.selected_pose_bones_from_active_object or ()]
            added = contact_editing.add_bone_contacts(character, bones)
        elif context.mode == "EDIT_MESH" and context.object is not None:
            rig = context.object.find_armature()
            character = next((item for item in scene.softground.characters if rig and item.armature == rig), None)
            if character is None:
                raise InputError(f"'{context.object.name}' is not the skin of a character: press Add Character first.")
            added = contact_editing.add_vertex_contacts(character, context.object)
        else:
            characters = scene.softground.characters
            props = [obj for obj in context.selected_objects if all(obj != item.armature for item in characters)]
            wearer = next((item for item in characters if any(item.armature in ancestors(obj) for obj in props)), None)
            character = wearer or active_character(scene.softground)
            added = contact_editing.add_object_contacts(scene.softground, character, props)
        name = character_setup.title_of(character)
        self.report({"INFO"}, translated("'{name}' also prints with {parts}", name=name, parts=", ".join(added)))
        return {"FINISHED"}


class SOFTGROUND_OT_add_sole(_OnCharacter, bpy.types.Operator):
    """Add a contact, and choose its bone or object below"""

    bl_idname = "softground.add_sole"
    bl_label = "Add Empty Contact"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        character = active_character(settings.options_of(context))
        taken = {sole.name for sole in character.soles}
        sole = character.soles.add()
        number = next(number for number in range(1, len(taken) + 2) if f"sole {number}" not in taken)
        sole.name = f"sole {number}"
        character.active_sole = len(character.soles) - 1
        return {"FINISHED"}


class SOFTGROUND_OT_remove_sole(RemovesChosen):
    """Remove the selected contact from the list: it leaves no prints"""

    bl_idname = "softground.remove_sole"
    bl_label = "Remove Contact"
    of_list = ("soles", "active_sole")
    owner = staticmethod(active_character)


CLASSES = (
    SOFTGROUND_OT_remove_character,
    SOFTGROUND_OT_mass_by_volume,
    SOFTGROUND_OT_fix_scale,
    SOFTGROUND_OT_walk_ahead,
    SOFTGROUND_OT_detect_bones,
    SOFTGROUND_OT_add_contact,
    SOFTGROUND_OT_add_sole,
    SOFTGROUND_OT_remove_sole,
)
