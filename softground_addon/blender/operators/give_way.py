"""*Give Way*: plants and litter of the user's bend under the soles of the bake, and rise again."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from bpy.props import EnumProperty

from ...core.errors import InputError
from ...core.plants import tramplings as plant_tramplings
from ...core.plants.bending import PLANTS
from .. import jobs, mesh_arrays, settings
from ..ground import baked_ground, ground_checks, ground_mesh, ground_surface, trampled_ground
from ..placement import hang_on
from ..plants import give_way, give_way_nodes, meadow, trampling_table
from ..translation import translated
from ..weather import ground_weather
from .modal_job import Reading, Reports

KINDS = (
    *((key, title, f"Plants that bend and rise like {title.lower()}") for key, (title, _) in PLANTS.items()),
    ("LITTER", "Leaves and Twigs", "What lies on the ground, is pressed in, tilts with the prints, and is thrown"),
    ("PEBBLES", "Pebbles", "As leaves and twigs; on hard ground they roll aside"),
)
"""What gives way, as an enum has it."""


class SOFTGROUND_OT_give_way(Reading):
    """Let the selected plants or litter give way to the feet: hair curves, instances, meshes of loose blades. One
    modifier behind yours; remove it, and all is as it was. Esc cancels"""

    bl_idname = "softground.give_way"
    bl_label = "Give Way"

    kind: EnumProperty(name="Kind", description="What gives way", items=KINDS, default="MEADOW")

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        ground, active = settings.options_of(context).ground, context.active_object  # a redraw looks at no other object
        is_selected = ground is not None and active is not None and active.select_get() and context.mode == "OBJECT"
        if not is_selected or not _may_give_way(active, ground):
            return "Choose a ground, and select plants or litter on it"
        return super().missing(context)

    def _job_of(self) -> jobs.Job[Reports]:
        ground = self.scene.softground.ground
        chosen = [obj for obj in bpy.context.selected_objects if _may_give_way(obj, ground)]
        linked = next((obj for obj in chosen if obj.library), None)
        if linked is not None:
            raise InputError(f"'{linked.name}' is linked from another file: give way there, or make it local.")
        emitter = next((obj for obj in chosen if obj.particle_systems and not _scatters_by_nodes(obj)), None)
        if emitter is not None:
            remedy = "make them real (Object > Apply > Make Instances Real), or convert hair to curves."
            raise InputError(f"'{emitter.name}' scatters particles, which no modifier moves: {remedy}")
        names = [settings.name_of(obj) for obj in (ground, *chosen)]
        yield from _grouped(ground)
        ground, *chosen = map(settings.resolve, names)
        _let(ground, chosen, self.kind)
        text = "{count} objects give way" if len(chosen) > 1 else "'{name}' gives way"
        return [("INFO", translated(text, count=len(chosen), name=chosen[0].name))]


def _grouped(ground: bpy.types.Object) -> jobs.Job[None]:
    """Make the node group that plants on a ground give way by; nothing else is changed."""
    ground_checks.check_writable(ground)
    yield from jobs.meanwhile(jobs.Progress("write", 0.5), give_way_nodes.ensure_group.slices())


def _let(ground: bpy.types.Object, chosen: Sequence[bpy.types.Object], kind: str) -> None:
    """Let objects give way to the prints of a ground."""
    renew_table(ground)
    table = trampling_table.ensure(ground)
    give_way.put(chosen, kind, table, {baked_ground.display_mesh_of(ground)})


def renew_table(ground: bpy.types.Object) -> None:
    """Write the table of a ground from its record, where there is a bake and no table of this version; see `load`."""
    if trampling_table.is_current(ground) or not baked_ground.is_baked(ground):
        return
    record = baked_ground.record_of(ground)
    with ground_weather.damage_named(ground):
        units = baked_ground.units_of(record.about["inputs"])
    trampling_table.ensure(ground)
    made = plant_tramplings.tramplings([*record.shaping, *record.on_floors])
    trampled_ground.write(ground, made, units)


def _may_give_way(obj: bpy.types.Object | None, ground: bpy.types.Object) -> bool:
    """True of plants and litter; of a ground only with a scatter of its own."""
    if obj is None or obj.type not in give_way.SCATTERS:
        return False
    is_ground = obj in (ground, baked_ground.display_mesh_of(ground))
    return not is_ground or _scatters_by_nodes(obj)


def _scatters_by_nodes(obj: bpy.types.Object) -> bool:
    return any(modifier.type == "NODES" for modifier in ground_mesh.users_modifiers(obj))


class SOFTGROUND_OT_add_sample_meadow(Reading):
    """Let a meadow of hair curves grow around the prints, or on all of the ground before a bake. It gives way. Esc
    cancels"""

    bl_idname = "softground.add_sample_meadow"
    bl_label = "Add Sample Meadow"

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        ground = settings.options_of(context).ground
        if ground is None or ground.type != "MESH" or context.mode != "OBJECT":
            return "Choose or create a ground first"
        return super().missing(context)

    def _job_of(self) -> jobs.Job[Reports]:
        name = settings.name_of(self.scene.softground.ground)
        ground = settings.resolve(name)
        unit_scale = settings.units_of(self.scene).unit_scale_m
        shown = baked_ground.display_mesh_of(ground)
        steps, about = baked_ground.load(ground) if baked_ground.is_baked(ground) else ([], {"inputs": {}})
        frame = baked_ground.frame_in(about["inputs"])
        vertices = ground_surface.rest_vertices(shown, unit_scale, frame)
        corners = vertices[mesh_arrays.triangles(ground_mesh.mesh_of(shown))]
        if not len(corners):
            raise InputError(f"Ground '{ground.name}' has no faces that a meadow could grow on.")
        yield from _grouped(ground)
        ground = settings.resolve(name)
        near = np.array([step.position[:2] for step in steps]) if steps else None
        grass = meadow.grow(corners, unit_scale, near, _REACH)
        if frame:
            hang_on(grass, ground, frame)
        for collection in ground.users_collection:
            collection.objects.link(grass)
        _let(ground, [grass], "MEADOW")
        return [("INFO", translated("Added '{name}'", name=grass.name))]


_REACH = 1.0
"""How far around prints the sample meadow grows [m]."""

CLASSES = (SOFTGROUND_OT_give_way, SOFTGROUND_OT_add_sample_meadow)
