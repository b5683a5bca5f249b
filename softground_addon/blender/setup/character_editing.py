"""Operators that correct the list of characters: take one out, find its bones again, add and remove soles."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.props import StringProperty

from ...core.errors import InputError
from .. import jobs, settings
from ..characters import character_setup, contact_editing, import_fixes
from ..operator_base import Act, Needs
from ..operators.modal_job import Reading, Reports
from ..operators.panel_base import RemovesChosen, active_character
from ..reading import analysis
from ..rigs import frame_ranges
from ..translation import translated


class _OnCharacter(Needs):
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
    def missing(cls, context: bpy.types.Context) -> str:
        is_chosen = active_character(settings.options_of(context)) is not None
        return super().missing(context) if is_chosen else "Add a character first"


class SOFTGROUND_OT_remove_character(RemovesChosen):
    """Remove the character from the list; its armature and the ground stay as they are"""

    bl_idname = "softground.remove_character"
    bl_label = "Remove Character"
    of_list = ("characters", "active_character")


MUCH = 2.0
"""Ratio of a mass to the likely one from which the panel suggests the latter."""


def suggested_mass(character: Any) -> float:
    """Mass that a character's skin or its height suggests where its own differs much [kg], 0 where it does not."""
    likely = import_fixes.mass_of(character)
    differs = likely > 0 and not likely / MUCH < character.mass < likely * MUCH
    return likely if differs else 0.0


class SOFTGROUND_OT_mass_by_volume(_OnCharacter, Act):
    """Set the mass from the volume of the character's skin, at the density of water; for figures on two legs that
    would be far too heavy, from their height"""

    bl_idname = "softground.mass_by_volume"
    bl_label = "Mass by Volume"

    def act(self, context: bpy.types.Context) -> None:
        character = active_character(settings.options_of(context))
        if not character.skin_mass > 0:
            raise InputError(f"'{character_setup.title_of(character)}' has no skin to go by: type its mass.")
        character.mass = import_fixes.mass_of(character)


class SOFTGROUND_OT_fix_scale(_OnCharacter, Act):
    """Scale a character that was made in other units, by parenting it to a scaled empty. Its own animation does not
    change"""

    bl_idname = "softground.fix_scale"
    bl_label = "Fix Import Scale"

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        character = self.chosen(scene.softground)
        factor = character_setup.fix_scale(scene, character)
        self.say("'{name}' is scaled by {factor}", name=character_setup.title_of(character), factor=f"{factor:g}")


class SOFTGROUND_OT_walk_ahead(_OnCharacter, Reading):
    """Make a character that walks on the spot travel as fast as its feet slide, by parenting it to a moving empty.
    Its own animation does not change. Esc cancels"""

    bl_idname = "softground.walk_ahead"
    bl_label = "Walk Ahead"

    def _job_of(self) -> jobs.Job[Reports]:
        character = self.chosen(self.scene.softground)
        name, mover = character_setup.title_of(character), character.armature or character.body
        rig = mover and settings.name_of(mover)
        known = yield from analysis.reading(self.scene)
        belt = known.belts.get(name)
        if belt is None or rig is None:
            raise InputError(f"'{name}' does not walk on the spot: its feet rest, or no speed lets all of them rest.")
        import_fixes.walk_ahead(self.scene, settings.resolve(rig), -belt)
        return [("INFO", translated("'{name}' travels at {speed} m/s", name=name, speed=f"{np.linalg.norm(belt):.1f}"))]


class SOFTGROUND_OT_detect_bones(_OnCharacter, Reading):
    """Find the character's feet and joints again, from its skin, bone names or rest pose. Esc cancels"""

    bl_idname = "softground.detect_bones"
    bl_label = "Detect Bones"

    def _job_of(self) -> jobs.Job[list[str]]:
        return character_setup.detecting_bones(self.scene, self.scene.softground.active_character)

    def _show(self, result: list[str]) -> None:
        self.say("Found {parts}", parts=", ".join(result))


class SOFTGROUND_OT_add_contact(_OnCharacter, Act):
    """Let the selected bones, objects or vertices of the skin print too: hands, knees, canes, snowshoes. Each
    presses with whichever side faces down"""

    bl_idname = "softground.add_contact"
    bl_label = "Add Contact"

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
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
            wearer = next(
                (item for item in characters if any(item.armature in frame_ranges.ancestors(obj) for obj in props)),
                None,
            )
            character = wearer or active_character(scene.softground)
            added = contact_editing.add_object_contacts(scene.softground, character, props)
        self.say("'{name}' also prints with {parts}", name=character_setup.title_of(character), parts=", ".join(added))


class SOFTGROUND_OT_add_sole(_OnCharacter, Act):
    """Add a contact, and choose its bone or object below"""

    bl_idname = "softground.add_sole"
    bl_label = "Add Empty Contact"

    def act(self, context: bpy.types.Context) -> None:
        character = active_character(settings.options_of(context))
        taken = {sole.name for sole in character.soles}
        sole = character.soles.add()
        number = next(number for number in range(1, len(taken) + 2) if f"sole {number}" not in taken)
        sole.name = f"sole {number}"
        character.active_sole = len(character.soles) - 1


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
