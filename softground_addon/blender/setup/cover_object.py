"""*Cover*: snow, sand or leaves on things, as a ground that prints like any other."""

from __future__ import annotations

from typing import Any, cast

import bpy
import numpy as np
from bpy.props import FloatProperty

from ...core.errors import InputError
from ...core.meshing import cover as covers
from .. import further_grounds, mesh_arrays, settings
from ..drafts import none_left_if_it_fails
from ..ground import created_ground, ground_checks, ground_surface
from ..operator_base import Act
from ..placement import to_world, units_about
from ..properties import SoftGroundPainted
from ..reading import analysis
from ..remedies import said
from . import shot_setup

SPACING = 0.04
"""Largest distance of a cover's vertices [m]; the trail is refined as on any coarse ground."""


class SOFTGROUND_OT_cover(Act):
    """Lay a ground of this thickness on the selected mesh: on its faces that look up, with rounded edges"""

    bl_idname = "softground.cover"
    bl_label = "Cover"

    thickness_cm: FloatProperty(
        name="Thickness (cm)",
        description="Of the layer; no print is deeper",
        default=10.0,
        min=1.0,
        max=500.0,
        soft_max=60.0,
        precision=1,
    )

    @classmethod
    def missing(cls, context: bpy.types.Context) -> str:
        is_selected = context.mode == "OBJECT" and shot_setup.selected_ground(context) is not None
        return "" if is_selected else "Select the mesh to cover, in Object Mode"

    def act(self, context: bpy.types.Context) -> None:
        scene, obj = context.scene, shot_setup.selected_ground(context)
        assert obj is not None
        if fault := ground_checks.hard_fault(obj):
            what = fault.partition(":")[0].replace(" in Hard Ground", "")
            raise InputError(f"{what}: cover a copy of it that stands still.")
        options, thickness = scene.softground, settings.typed(self.thickness_cm) / 100.0
        bodies = [character.armature for character in options.characters if character.armature]
        units = units_about(scene, obj, bodies)
        surface = ground_surface.undisturbed_surface(obj, units.unit_scale_m, frame=units.frame)
        try:
            laid = covers.cover(surface.surface_vertices, surface.triangles, thickness, SPACING)
        except InputError as error:
            raise InputError(f"'{obj.name}' cannot be covered. {said(error)}") from None
        first = options.ground if settings.exists(options.ground) and options.ground != obj else None
        with analysis.own_changes(scene):
            ground = _object_of(laid, f"{obj.name} Cover", units.unit_scale_m, thickness)
            ground.matrix_basis = to_world(units.frame, obj)
            created_ground.publish(scene, ground, options.material.surface)
        for number in reversed(range(len(options.grounds))):
            if options.grounds[number].object == obj:
                options.grounds.remove(number)
        text, material, group = "'{name}' is now the ground", options.material, options
        if first:
            options.ground, group, text = first, further_grounds.add(options, ground), "Soles print in {names} too"
            material = further_grounds.own_material(options, group)
        material.layer_depth, group.under = thickness, "NEVER"  # there is no earth below
        group.painted.property_unset("layer_depth")
        if obj not in settings.hard_grounds_of(options):
            options.hard_grounds.add().object = obj
            options.active_hard_ground = len(options.hard_grounds) - 1
        created_ground.select(scene, ground)
        self.say(text, name=ground.name, names=repr(ground.name))


@none_left_if_it_fails()
def _object_of(laid: covers.Cover, name: str, unit: float, thickness: float) -> bpy.types.Object:
    """A cover as an object that is in no scene yet; its layer is painted as deep as it is."""
    depth = cast("Any", SoftGroundPainted.bl_rna.properties["layer_depth"]).default
    mesh = mesh_arrays.points(name, laid.vertices / unit, [(depth, "FLOAT", laid.thickness / thickness)])
    mesh.loops.add(laid.faces.size)
    mesh.loops.foreach_set("vertex_index", laid.faces.astype(np.int32).ravel())
    mesh.polygons.add(len(laid.faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, laid.faces.size, laid.faces.shape[1], dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(laid.faces), bool))
    mesh.update(calc_edges=True)
    return bpy.data.objects.new(name, mesh)


CLASSES = (SOFTGROUND_OT_cover,)
