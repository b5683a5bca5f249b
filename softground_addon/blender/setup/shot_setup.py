"""Operators that set up a shot. Each is thin: it calls one function, and its errors become a report."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty

from ...batch import manifest
from ...batch.shell import command_line
from ...core.composers.ground_plan import GroundPlan, plan_ground
from ...core.errors import InputError
from ...core.ground import surfaces
from ...core.settings import BakeSettings
from .. import further_grounds, ground_presets, ground_slots, jobs, settings
from ..baking import scene_findings
from ..characters import character_setup, import_fixes, prop_setup, recognition, selection
from ..command_line import program
from ..ground import baked_ground, created_ground, ground_checks, ground_mesh, look, trail_detail
from ..operator_base import Act, OnGround
from ..operators.modal_job import Reading, Reports
from ..operators.panel_base import active_character
from ..reading import analysis, shots
from ..rigs import frame_ranges, rig_mapping
from ..sampling import body_sampling, rig_checks, skin_sampling
from ..translation import translated


class SOFTGROUND_OT_add_character(Reading):
    """Add the selected characters: feet, hips and limbs are recognised from the skin, the bone names or the rest
    pose. Selected objects without a rig are added as props that fall, roll or slide. Esc cancels"""

    bl_idname = "softground.add_character"
    bl_label = "Add Character"

    def _job_of(self) -> jobs.Job[Reports]:
        return _added(self.scene, bpy.context.active_object, list(bpy.context.selected_objects))


def _added(
    scene: bpy.types.Scene, active: bpy.types.Object | None, selected: list[bpy.types.Object]
) -> jobs.Job[Reports]:
    """Add what is selected, and read the shot for its prediction; the reports of it, each with its kind."""
    options = scene.softground
    before = len(options.characters), options.active_character, options.frame_start, options.frame_end
    fresh, material = ground_presets.untouched(options), options.material
    sizes: list[tuple[Any, str]] = [(options, "cell_size"), (options, "cells_along_sole"), (options, "length_scale")]
    sizes += [(material, "rim_reach"), (material, "blur_sigma")]
    fitted = [(group, field, getattr(group, field)) for group, field in sizes]
    stays = False
    try:
        reports = yield from _add(scene, active, selected)
        yield jobs.Progress("sample", recognition.SHARE)
        yield from _read_for_prediction(scene)
        stays = True
    finally:
        if not stays:
            while len(options.characters) > before[0]:
                options.characters.remove(len(options.characters) - 1)
            options.active_character, options.frame_start, options.frame_end = before[1:]
            for group, field, value in fitted:
                setattr(group, field, value)
            for group, field in fresh:
                group.property_unset(field)
    return reports


def _read_for_prediction(scene: bpy.types.Scene) -> jobs.Job[None]:
    """Read the shot where there is a panel to show its prediction, if it can be read."""
    if not bpy.app.background:
        with suppress(InputError):  # it says so when the user asks for the depth, or bakes
            yield from analysis.reading(scene)


def _add(
    scene: bpy.types.Scene, active: bpy.types.Object | None, selected: list[bpy.types.Object]
) -> jobs.Job[Reports]:
    rigs, props = selection.chosen(scene, active, selected)
    reports: Reports = []
    remaining, weights = [settings.name_of(prop) for prop in props], dict[str, skin_sampling.Weights]()
    for name in [settings.name_of(obj) for obj in (*rigs, *filter(body_sampling.deforms, props))]:
        if name in remaining:
            character = yield from character_setup.adding_body(scene, settings.resolve(name))
        else:
            character = yield from character_setup.adding_character(scene, settings.resolve(name), weights)
        if character is None:  # it prints as a prop
            continue
        remaining = [prop for prop in remaining if prop != name]
        soles = ", ".join(sole.name for sole in character.soles)
        if soles:
            reports.append(("INFO", translated("Added '{name}' with {soles}", name=character.name, soles=soles)))
            size = import_fixes.sizes_of(scene.unit_settings.scale_length, character)[1]
            if size > 0 and character.skin_mass > 0:  # one that is larger in its file than in life weighs tons
                size_and_mass = {"name": character.name, "size": f"{size:.2g}", "mass": f"{character.mass:g}"}
                reports.append(("INFO", translated("'{name}': {size} m in size, {mass} kg", **size_and_mass)))
        elif rig_checks.is_animated(character.armature) and skin_sampling.has_skin(scene.objects, character.armature):
            what = "nothing of its skin rests on the ground, as of what swims or flies: it leaves no print. If it does"
            reports.append(("WARNING", f"Added '{character.name}', but {what}, {rig_mapping.CHOOSE_CONTACTS}"))
        else:
            reports.append(("WARNING", f"Added '{character.name}', but found no feet: {rig_mapping.CHOOSE_CONTACTS}"))
    props = [settings.resolve(prop) for prop in remaining]
    added = prop_setup.add_props(scene, props) if props else []
    if added:
        each = [translated("'{name}' of {mass} kg", name=entry.name, mass=f"{entry.mass:g}") for entry in added]
        reports.append(("INFO", translated("Added {props}", props=", ".join(each))))
    for obj in props:
        if changing := scene_findings.shape_findings([obj]):
            reports.append(("WARNING", changing[0].text))
        elif not selection.moves(obj):
            text = translated("'{name}' does not move: give it keys or a rigid body before you bake", name=obj.name)
            reports.append(("WARNING", text))
    return reports


class SOFTGROUND_OT_use_as_ground(Reading):
    """Take the selected mesh as the ground, as it is: flat, sculpted or sloped. Esc cancels"""

    bl_idname = "softground.use_as_ground"
    bl_label = "Use Selected as Ground"
    cancelled = "Use Selected cancelled: nothing was changed"

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        if not (selected_ground(context) or _selected_instance(context)):
            return "Select the mesh to walk on, not a character"
        return super().missing(context)

    def _job_of(self) -> jobs.Job[Reports]:
        _check_no_instance(bpy.context)
        chosen = selected_ground(bpy.context)
        assert chosen is not None
        return _taken_as_ground(self.scene, chosen)


def _taken_as_ground(scene: bpy.types.Scene, chosen: bpy.types.Object) -> jobs.Job[Reports]:
    """Take a mesh as the ground, and read the shot for its prediction."""
    ground_checks.check_usable(chosen)
    options, before = scene.softground, scene.softground.ground
    chosen_text = translated("'{name}' is now the ground", name=chosen.name)
    if item := next((item for item in options.grounds if item.object == chosen and settings.exists(before)), None):
        with analysis.own_changes(scene):
            further_grounds.choose(options, item)  # with what is set for it; the first takes its place
        return [("INFO", chosen_text)]
    name = settings.name_of(before) if before else None
    stays = False
    try:
        options.ground = chosen
        reports: Reports = [("INFO", chosen_text)]
        yield jobs.Progress("sample", 0.0)
        if options.characters:
            yield from _read_for_prediction(scene)
        stays = True
    finally:
        if not stays:
            options.ground = settings.find(name) if name else None
    return reports


class SOFTGROUND_OT_create_ground(Reading):
    """Create a ground that fits the walk: fine where feet come down, coarse elsewhere. Esc cancels"""

    bl_idname = "softground.create_ground"
    bl_label = "Create Ground"

    use_selected: BoolProperty(
        name="Use Selected", description="Use the selected mesh as it is, if one is selected", default=True
    )

    def _job_of(self) -> jobs.Job[Reports]:
        if self.use_selected:
            _check_no_instance(bpy.context)
            if chosen := selected_ground(bpy.context):
                return (yield from _taken_as_ground(self.scene, chosen))
        has_first = settings.exists(self.scene.softground.ground)
        wanted = shots.settings_of(self.scene)
        plan = yield from _planned(wanted)
        with ExitStack() as drafts:
            now = jobs.Progress("sample", 1.0)
            layout = yield from jobs.meanwhile(now, created_ground.laid_out.slices(wanted, plan))
            name = yield from jobs.meanwhile(now, created_ground.created(drafts, wanted, layout))
            ground, options = settings.resolve(name), self.scene.softground
            with analysis.own_changes(self.scene):
                before = options.ground
                former = before if has_first and _is_as_made(before, self.scene) else None
                created_ground.publish(self.scene, ground, wanted.surface)
                if former:
                    _take_place(ground, former)
                elif before and not has_first:  # it was the next in the list
                    options.ground = before
                    further_grounds.choose(options, further_grounds.add(options, ground))
        created_ground.select(self.scene, ground)
        count = f"{len(ground_mesh.mesh_of(ground).vertices):,}"
        text = translated("Created '{name}' with {count} vertices", name=ground.name, count=count)
        return [("INFO", text), *(("WARNING", warning) for warning in plan.warnings)]


def _planned(wanted: BakeSettings) -> jobs.Job[GroundPlan]:
    """The ground that fits the walk; if bodies may carve it, by how deep the shot is predicted to be."""
    if wanted.carves:
        with suppress(InputError):  # of a shot that cannot be baked on the ground that it has
            motions = (yield from analysis.reading(settings.scene_named(wanted.scene))).shot.motions
            depth = (yield from analysis.working_out_depth(wanted)) or 0.0
            return (yield from jobs.meanwhile(jobs.Progress("sample", 1.0), plan_ground.slices(motions, depth)))
    return (yield from shots.fit_ground(wanted))


def _is_as_made(ground: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """True if the add-on made this ground, and nobody has changed it, baked on it or made anything else use it."""
    if ground.type != "MESH" or ground.library or baked_ground.has_remains(ground):
        return False
    mesh, users = ground_mesh.mesh_of(ground), bpy.data.user_map(subset={ground})[ground]
    added: Any = (ground.parent, ground.animation_data, mesh.animation_data, mesh.shape_keys, ground.rigid_body)
    added += (*ground.modifiers, *ground.constraints, *ground.vertex_groups, *ground.keys())
    return (
        not any(each is not None for each in added)
        and ground.users_scene == (scene,)
        and all(isinstance(user, bpy.types.Scene | bpy.types.Collection) for user in users)
        and [each and each.get(ground_slots.MARK) in surfaces.SURFACES for each in mesh.materials] == [True]
        and mesh.users - mesh.use_fake_user == 1
        and mesh.get(created_ground.AS_CREATED) == created_ground.made_shape(ground)
    )


def _take_place(ground: bpy.types.Object, former: bpy.types.Object) -> None:
    """Put a ground where another one was, with its name, and remove that."""
    name, collections = former.name, former.users_collection
    for collection in set(ground.users_collection) - set(collections):
        collection.objects.unlink(ground)
    for collection in set(collections) - set(ground.users_collection):
        collection.objects.link(ground)
    ground_mesh.discard(former)
    ground.name = name


def _selected_instance(context: bpy.types.Context) -> bpy.types.Object | None:
    """The active object if it is a selected instance of a collection with meshes."""
    obj = context.active_object
    return obj if obj is not None and obj.select_get() and rig_mapping.instances_mesh(obj) else None


def _check_no_instance(context: bpy.types.Context) -> None:
    if obj := _selected_instance(context):
        raise InputError(
            f"'{obj.name}' is a collection instance, which takes no prints: make it real (Object > Apply > "
            "Make Instances Real), select the mesh to walk on, and press Use Selected."
        )


def selected_ground(context: bpy.types.Context) -> bpy.types.Object | None:
    """The active object if it is a selected mesh that no character wears or carries and that does not print itself.

    Of a copy that takes the prints of a ground, that ground.
    """
    obj = context.active_object
    if obj is None or obj.type != "MESH" or not obj.select_get() or obj.find_armature():
        return None
    characters = settings.options_of(context).characters
    above = frame_ranges.ancestors(obj)
    belongs = any(
        character.armature in above or any(sole.object == obj for sole in character.soles) for character in characters
    )
    return None if belongs else trail_detail.ground_of(obj)


class SOFTGROUND_OT_open_settings(Act):
    """Select what has these settings, and show them in Properties > Physics"""

    bl_idname = "softground.open_settings"
    bl_label = "Open Settings"

    of: EnumProperty(
        name="Of",
        items=[
            ("GROUND", "Ground", "The ground, or the copy of it that takes the prints"),
            ("CHARACTER", "Character", "The character that is chosen in the list"),
        ],
    )

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        return "" if context.mode == "OBJECT" else "Switch to Object Mode first"

    def act(self, context: bpy.types.Context) -> None:
        options = settings.options_of(context)
        character, shown = active_character(options), None
        if self.of == "GROUND" and settings.exists(options.ground):
            shown = baked_ground.display_mesh_of(options.ground)
        elif character:  # a ground that is not there yet has its settings beside those of the character
            shown = settings.body_of(character)
        if shown is None:
            raise InputError("Add a character first")
        if not settings.exists(shown):
            raise InputError(f"'{shown.name}' was deleted: undo, or remove the character with -.")
        if shown.name not in context.view_layer.objects or not shown.visible_get():
            raise InputError(f"'{shown.name}' is hidden, or excluded from this view layer: show it first.")
        created_ground.select(context.scene, shown)
        if not context.screen or not show_physics(context.screen.areas):
            self.say("Its settings are in Properties > Physics")
            if context.screen and not bpy.app.background:
                bpy.app.timers.register(partial(_show_physics_of, context.screen.name), first_interval=ONCE_DRAWN)


ONCE_DRAWN = 0.2
"""Time after which editors have been drawn with another active object [s]."""


def show_physics(areas: Iterable[bpy.types.Area]) -> bool:
    """Show Physics in the Properties editors that offer it; True if there is any.

    One does not where other data is pinned, nor, until it is drawn again, where no object was active.
    """
    is_shown = False
    for area in areas:
        if area.type == "PROPERTIES":
            space: Any = area.spaces.active
            with suppress(TypeError):  # Blender's, for what is not offered
                space.context = "PHYSICS"
                is_shown = True
    return is_shown


def _show_physics_of(name: str) -> None:
    if screen := bpy.data.screens.get(name):
        show_physics(screen.areas)


class SOFTGROUND_OT_apply_look(OnGround, Act):
    """Show the preset's look in the prints, over copies of your own materials. Clear Bake removes it"""

    bl_idname = "softground.apply_look"
    bl_label = "Apply Look"

    def act(self, context: bpy.types.Context) -> None:
        scene = context.scene
        options = scene.softground
        ground_checks.check_writable(baked_ground.display_mesh_of(options.ground))
        with analysis.own_changes(scene):
            mixed = look.apply(options.ground, options.material.surface)
        shown = translated(surfaces.find(options.material.surface).label.lower())
        text = "'{ground}' now looks like {look}"
        if mixed:
            text = "'{ground}' now looks like {look}, over {count} of your materials"
        self.say(text, ground=options.ground.name, look=shown, count=mixed)


class SOFTGROUND_OT_copy_bake_command(Act):
    """Copy a command line that bakes the saved file into a new file beside it, for a terminal or a farm"""

    bl_idname = "softground.copy_bake_command"
    bl_label = "Copy Bake Command"
    bl_options = {"REGISTER"}

    @classmethod
    def missing(cls, _context: bpy.types.Context) -> str:
        if not bpy.data.filepath:
            return "Save the file first: the command bakes it from there"
        is_changed = bpy.data.is_dirty and not bpy.app.background  # in background it always is
        return "Save your changes first: the command bakes the file as it is saved" if is_changed else ""

    def act(self, context: bpy.types.Context) -> None:
        context.window_manager.clipboard = bake_command(context.scene)
        self.report({"INFO"}, "Copied the command that bakes this shot")


def bake_command(scene: bpy.types.Scene) -> str:
    """The command line that bakes a scene of the saved file into `NAME-baked.blend` beside it.

    Raises
    ------
    InputError
        If a name in it cannot be typed.
    """
    shot = Path(bpy.data.filepath)
    bake = manifest.BatchShot(
        name=shot.stem,
        file=shot,
        scene=scene.name if len(bpy.data.scenes) > 1 else "",
        save=shot.with_name(f"{shot.stem}-baked.blend"),
    )
    return command_line(program.worker_command(shot, bake.options), windows=os.name == "nt")


CLASSES = (
    SOFTGROUND_OT_add_character,
    SOFTGROUND_OT_use_as_ground,
    SOFTGROUND_OT_create_ground,
    SOFTGROUND_OT_open_settings,
    SOFTGROUND_OT_apply_look,
    SOFTGROUND_OT_copy_bake_command,
)
