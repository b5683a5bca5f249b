"""Checks that prints show on a ground whose modifiers act after the playback."""

from __future__ import annotations

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.findings import Finding
from ...core.ground.heightfield import Terrain
from ...core.ground.terrain import MeshTerrain
from ...core.motion.ground_frame import GroundFrame
from ...core.numerics.arrays import Array, Indices
from .. import mesh_arrays
from ..playback import playback
from . import ground_mesh, ground_surface

LIFT = 0.01
"""How far vertices are raised to see what modifiers make of it [m]."""

PROBES = 1000
"""Vertices that are looked at, spread over those that a bake moves, about."""

MARGIN = 0.1
"""How far around them the surface is looked at [m]."""


def are_undone(
    ground: bpy.types.Object,
    vertices: Array,
    moved: Indices,
    terrain: Terrain,
    *,
    unit_scale: float,
    detail: str,
    frame: GroundFrame | None = None,
) -> bool:
    """True if the ground's modifiers put back what a bake moves, as a Shrinkwrap does, or would not let it play.

    Parameters
    ----------
    vertices : (V, 3) float array
        Undisturbed world positions of the vertices of its mesh [m].
    moved : (K,) int array
        Those that the bake moves.
    terrain : Terrain
        The undisturbed surface.
    unit_scale : float
        Metres per Blender unit.
    detail : str
        True if there may be a copy without modifiers, in the words of the settings.
    frame : GroundFrame, optional
        That the positions and the terrain are in.

    Raises
    ------
    InputError
        If they do, and there may be no copy.
    """
    if barrier := playback.barrier_on(ground):
        if detail == "NEVER":
            raise InputError(
                f"The modifier '{barrier.name}' of ground '{ground.name}' keeps prints from playing: set Detail to "
                "Automatic in Properties > Physics > Mesh and Look, or apply it."
            )
        return True
    if not len(moved) or not any(item.show_viewport for item in ground_mesh.users_modifiers(ground)):
        return False
    to_world = ground_surface.to_world_of(ground, unit_scale, frame)
    lift = LIFT * ground_surface.up_of(ground, unit_scale, frame)
    with ground_surface.undisturbed_copy(ground, moved, lift) as raised:
        surface = mesh_arrays.positions(raised) @ to_world[:3, :3].T + to_world[:3, 3]
        triangles = mesh_arrays.triangles(raised)
    if np.linalg.det(to_world[:3, :3]) < 0:
        triangles = triangles[:, ::-1]
    place = vertices[moved[:: len(moved) // PROBES + 1], :2]
    bounds = np.stack([place.min(axis=0) - MARGIN, place.max(axis=0) + MARGIN])
    raised_by = MeshTerrain.from_mesh(surface, triangles, bounds).heights(*place.T) - terrain.heights(*place.T)
    if (raised_by > LIFT / 2).mean() > 1 / 2:
        return False
    if detail == "NEVER":
        raise InputError(
            f"Prints on ground '{ground.name}' would not show, as its modifiers undo them: set Detail to Automatic in "
            "Properties > Physics > Mesh and Look, or apply the modifiers."
        )
    return True


def undone_prints(ground: bpy.types.Object) -> Finding:
    """Message about such a ground."""
    if barrier := playback.barrier_on(ground):
        return Finding(
            "blocking_modifier",
            "note",
            f"The modifier '{barrier.name}' of ground '{ground.name}' keeps prints from playing: a copy without it, "
            f"'{ground.name} Trail', takes the prints.",
            f"To have them on '{ground.name}' itself, clear the bake and apply the modifier.",
        )
    return Finding(
        "undoing_modifiers",
        "note",
        f"The modifiers of ground '{ground.name}' undo prints on it: a copy without them, '{ground.name} Trail', takes "
        "the prints.",
        f"To have them on '{ground.name}' itself, clear the bake and apply the modifiers.",
    )
