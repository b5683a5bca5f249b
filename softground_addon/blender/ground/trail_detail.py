"""Detail along the trail: where the ground is coarse, a copy of it that is fine under the prints takes them.

The user's ground is hidden and otherwise left alone; removing the copy shows it again. While it is hidden, the copy is
selected and active in its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.findings import Finding
from ...core.ground.terrain import MeshTerrain
from ...core.meshing.refinement import Refinement, Surface
from ...core.meshing.region import Region
from ...core.motion.ground_frame import GroundFrame
from ...core.numerics.cell_keys import Keys, keys_of
from ...core.numerics.slices import Slices, sliced
from ...core.settings import ObjectName
from .. import mesh_arrays
from ..drafts import none_left_if_it_fails
from ..playback import playback
from ..settings import exists, find, name_of, resolve
from . import ground_mesh, ground_surface, refined_mesh
from .ground_surface import GroundSurface
from .hidden_ground import hide, hides, may_hide, show_again

DETAIL = "softground_detail"
"""Property of the ground while it is hidden: the copy."""
DETAIL_OF = "softground_detail_of"
"""Property of the copy: the ground that it stands in for."""

FLOOR = 1e-4
"""Ground that moves less stays coarse [m]: half of what the playback may be off while it moves."""
OF_CELL = 0.02
"""Part of a cell by which a ground may be off its shape."""
INWARD = 1.0 - 1e-6
"""Where vertices of the outline are compared, from the middle, so that rounding does not leave the ground."""


def detail_of(ground: bpy.types.Object) -> bpy.types.Object | None:
    """The copy that takes the prints in place of a ground, which is hidden meanwhile; no duplicate of it."""
    detail: Any = ground.get(DETAIL) if hides(ground) else None
    stands_in = exists(detail) and detail.get(DETAIL_OF) == ground  # not for a ground that is a duplicate
    return detail if stands_in else None


def ground_of(shown: bpy.types.Object) -> bpy.types.Object:
    """The ground that a copy takes the prints of; any other object is what it is."""
    ground = shown.get(DETAIL_OF)
    return ground if isinstance(ground, bpy.types.Object) and detail_of(ground) == shown else shown


def was_deleted(ground: bpy.types.Object) -> bool:
    """True if the copy that takes the prints of a ground was deleted in the viewport."""
    return hides(ground) and not exists(ground.get(DETAIL))


def region_around(footfalls: Keys, cell_size: float, reach: float) -> Region:
    """The cells within reach [m] of those in which feet come down, before it is known what they press."""
    far = int(np.ceil(reach / cell_size)) + 1
    row, column = np.mgrid[-far : far + 1, -far : far + 1]
    disc = keys_of(np.stack([column, row], axis=-1)[row**2 + column**2 <= far**2])
    return Region(np.unique(footfalls[:, None] + disc), cell_size)


@sliced
def coarsest(
    name: ObjectName, seen: GroundSurface | None, unit_scale: float, cell_size: float, frame: GroundFrame | None = None
) -> Slices[tuple[Surface, int]]:
    """The faces of a ground, subdivided no more often than its shape needs, and how often; 0 for as it is seen.

    Its shape may be off by `FLOOR`, or by a part of a cell if that is less.

    From the first subdivision on vertices lie on one surface, so that only what is between them may be off, and the
    outline: where it is rounded, a coarser one leaves out a part of the ground.
    """
    modifier = ground_surface.subdivision(resolve(name)) if seen else None
    tolerance = min(FLOOR, OF_CELL * cell_size)
    for level in range(1, modifier.levels if modifier else 0):
        coarse = yield from surface_of.slices(resolve(name), unit_scale, frame, level)
        shape = yield from MeshTerrain.from_mesh.slices(coarse.vertices, coarse.triangle_vertices)
        assert seen is not None
        middle = seen.surface_vertices[:, :2].mean(axis=0)
        for part in ground_surface.parts_of(seen.surface_vertices):
            yield
            off = np.abs(shape.heights(*(middle + INWARD * (part[:, :2] - middle)).T) - part[:, 2])
            if not (off <= tolerance).all():  # nor where there is no ground
                break
        else:
            return coarse, level
    return (yield from surface_of.slices(resolve(name), unit_scale, frame)), 0


@sliced
def surface_of(
    ground: bpy.types.Object, unit_scale: float, frame: GroundFrame | None = None, level: int = 0
) -> Slices[Surface]:
    """The faces of the ground as its modifiers leave it, in the world or a frame [m]; all is read at first."""
    with ground_surface.undisturbed_copy(ground, level=level) as source:
        faces = mesh_arrays.read_faces(source)
        to_world = ground_surface.to_world_of(ground, unit_scale, frame)
    yield
    return (yield from refined_mesh.surface_of.slices(faces, to_world))


@sliced
def draft(
    drafts: ExitStack, ground: bpy.types.Object, surface: Surface, refinement: Refinement, level: int = 0
) -> Slices[ObjectName]:
    """The refined ground as an object that is in no scene yet; one that is not published goes as `drafts` close.

    `level` is that of its surface (see `coarsest`).

    Raises
    ------
    InputError
        If the ground could not be hidden.
    """
    if not may_hide(ground):
        raise InputError(
            f"Ground '{ground.name}' is hidden and shown by keys or drivers, and would show up beside the finer "
            "copy that takes the prints: remove them, or Subdivide the ground so that it needs no copy."
        )
    with none_left_if_it_fails():
        mesh = bpy.data.meshes.new(f"{ground.name} Trail")
        with ground_surface.undisturbed_copy(ground, level=level) as source:
            for material in source.materials:
                mesh.materials.append(material and material.original)  # an evaluated mesh holds evaluated materials
            carried = refined_mesh.read(source, [group.name for group in ground.vertex_groups])
        detail = ground.copy()
        detail.name = f"{ground.name} Trail"
        for modifier in [
            item for item in detail.modifiers if item.type != "COLLISION"
        ]:  # what others collide with stays
            detail.modifiers.remove(modifier)
        detail.data = mesh
        show_again(detail)
        for name in (DETAIL, DETAIL_OF):
            detail.pop(name, None)  # of a hidden ground, or of one that is a duplicate of such a copy
        drafted = name_of(detail)
    drafts.callback(_discard_unpublished, drafted)
    yield
    yield from refined_mesh.building(drafted, carried, surface, refinement)
    return drafted


def _discard_unpublished(drafted: ObjectName) -> None:
    if (remaining := find(drafted)) is not None and DETAIL_OF not in remaining.keys():  # noqa: SIM118  (an ID is no mapping)
        ground_mesh.discard(remaining)


def publish(ground: bpy.types.Object, draft: bpy.types.Object) -> bpy.types.Object:
    """Show the refined ground in place of the ground, which is hidden.

    Where there is a copy already, it gets the mesh and the playback, and the draft stays out.
    """
    detail = detail_of(ground)
    if detail is not None:
        _exchange(detail, draft)
        ground[DETAIL] = detail
        hide(ground)
        return detail
    _forget_deleted(ground)
    ground[DETAIL], draft[DETAIL_OF] = draft, ground
    _put_beside(ground, draft)
    _choose_instead(draft, ground)
    hide(ground)
    return draft


def remove(ground: bpy.types.Object) -> None:
    """Take the copy away and show the ground as it was shown, also where the user has deleted the copy."""
    detail = detail_of(ground)
    show_again(ground)
    if detail is not None:
        _choose_instead(ground, detail)
        ground_mesh.discard(detail)
    _forget_deleted(ground)


def _forget_deleted(ground: bpy.types.Object) -> None:
    """Let go of a copy that was deleted in the viewport: it lives on in the ground's property only."""
    detail = ground.pop(DETAIL, None)
    if detail is not None and not detail.users:
        ground_mesh.discard(detail)


def _put_beside(ground: bpy.types.Object, draft: bpy.types.Object) -> None:
    """Put a draft into the collections of its ground; of two rigid bodies at one place, the ground stays the one."""
    worlds = draft.users_collection  # of rigid bodies, into which Blender puts the copy of one
    for collection in ground.users_collection:
        if collection not in worlds:
            collection.objects.link(draft)
    for world in worlds:
        if len(draft.users_collection) > 1:
            world.objects.unlink(draft)


def _choose_instead(shown: bpy.types.Object, gone: bpy.types.Object) -> None:
    """Select one object, and make it the active one, wherever the other is that."""
    for scene in gone.users_scene:
        for layer in scene.view_layers:
            layer.update()  # an object that has just come in, or was hidden, cannot be selected yet
            if gone.name in layer.objects and shown.name in layer.objects:
                shown.select_set(gone.select_get(view_layer=layer), view_layer=layer)
                if layer.objects.active == gone:
                    layer.objects.active = shown


def _exchange(detail: bpy.types.Object, draft: bpy.types.Object) -> None:
    """Give the copy the draft's mesh, under the name of its own; its materials and what the user added to it stay."""
    old, mesh = ground_mesh.mesh_of(detail), ground_mesh.mesh_of(draft)
    for place, material in enumerate(old.materials):
        if place < len(mesh.materials):
            mesh.materials[place] = material
        else:
            mesh.materials.append(material)
    detail.data = mesh
    playback.hand_over(draft, detail)
    name = old.name
    if not old.users:
        bpy.data.meshes.remove(old)
    mesh.name = name


def copy_findings(ground: bpy.types.Object) -> list[Finding]:
    """Findings about a finer copy of a ground: it holds what modifiers show in the viewport."""
    # Nodes may scatter objects for renders only, and those stay.
    hidden = (modifier for modifier in ground.modifiers if modifier.show_render and not modifier.show_viewport)
    lacking = [each.name for each in hidden if each.type not in ("NODES", "PARTICLE_SYSTEM", "COLLISION")]
    divides: Any = (each for each in ground.modifiers if each.type in ("SUBSURF", "MULTIRES"))
    both = (each for each in divides if each.show_viewport and each.show_render)
    coarser = [each.name for each in both if each.render_levels > each.levels]
    findings = []
    if lacking:
        text = f"The finer copy of ground '{ground.name}' lacks what {_listed(lacking)} shows in renders only"
        remedy = "show it in the viewport too (the modifier's screen icon), and bake again."
        findings.append(Finding("render_modifiers", "warning", text, remedy))
    if coarser:
        text = (
            f"The finer copy of ground '{ground.name}' has the viewport's levels of {_listed(coarser)} in renders too"
        )
        remedy = "where that shows, raise Levels Viewport to that of renders, and bake again."
        findings.append(Finding("render_levels", "note", text, remedy))
    return findings


def _listed(names: Sequence[str]) -> str:
    return " and ".join(f"'{name}'" for name in names)
