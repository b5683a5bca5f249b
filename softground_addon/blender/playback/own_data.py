"""Marks on the attributes and properties of a mesh that a bake has made: a user may have data of the same names."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, cast

import bpy

from ..rigs.object_data import mesh_of
from .playback_nodes import AGE, COMPRESSION, OF_PLAYBACK, REST, RIM
from .weather_nodes import OF_WEATHER, WATER

SOLE = "softground_sole"
"""Vector attribute for the tread of shoes: place along and across the sole, and depth of the tread there [m]."""
LAYER = "softground_layer"
"""Depth of the layer that feet press through to what lies below [m]; 0 where nothing says so."""
PASSES = "softground_passes"
"""How many soles have trodden on a vertex, of grounds with plants that give way."""
ATTRIBUTES = (REST, COMPRESSION, RIM, AGE, SOLE, WATER, LAYER, PASSES, *OF_PLAYBACK, *OF_WEATHER)

RECORD = "softground_record"
SUMMARY = "softground_summary"
WARNINGS = "softground_warnings"
BUILD_STAMP = "softground_fingerprints"
"""What a bake was made from, as JSON."""
MADE = "softground_made"
"""Property of a mesh that carries a bake: the names of the attributes that the bake has made, in lines."""
FRAME = tuple(f"softground_place_{part}" for part in ("x", "y", "z", "from"))
"""Axes of the object's space in the frame of the bake, and its origin there [Blender units]: materials read them."""
PROPERTIES = (*FRAME, RECORD, SUMMARY, WARNINGS, BUILD_STAMP, MADE)
"""Properties of a mesh that carries a bake."""


def made(mesh: bpy.types.Mesh) -> set[str]:
    """Names of the attributes that a bake has made on a mesh, as far as they are still there."""
    return {name for name in _noted(mesh) if name in ATTRIBUTES and name in mesh.attributes}


def has_made(mesh: bpy.types.Mesh, name: str) -> bool:
    """True if a bake has made one of `ATTRIBUTES` on a mesh; asked at each redraw."""
    return name in _noted(mesh) and name in mesh.attributes


def _noted(mesh: bpy.types.Mesh) -> Sequence[str]:
    return str(mesh.get(MADE, "")).split("\n")


def users_own(ground: bpy.types.Object) -> list[str]:
    """Names on a ground that a bake would need for itself, and the user has taken."""
    mesh = mesh_of(ground)
    ours = made(mesh)
    present = {*mesh.attributes.keys(), *ground.vertex_groups.keys()}  # which may not be called alike
    attributes = [name for name in ATTRIBUTES if name in present and name not in ours]
    return attributes if ours else [*attributes, *(name for name in PROPERTIES if name in mesh.keys())]  # noqa: SIM118


def attribute(mesh: bpy.types.Mesh, name: str, kind: str) -> Any:
    """A point attribute, new unless there is one of that kind; the one that the user has active stays so."""
    ours = made(mesh)
    existing = mesh.attributes.get(name)
    if existing and (existing.domain, existing.data_type) == ("POINT", kind):
        return existing
    if existing:
        mesh.attributes.remove(existing)
    active = mesh.attributes.active_index
    mesh.attributes.new(name, cast("Any", kind), "POINT")
    mesh.attributes.active_index = active
    mesh[MADE] = "\n".join(sorted(ours | {name}))
    return mesh.attributes[name]


def remove(mesh: bpy.types.Mesh, names: Iterable[str]) -> None:
    """Take away attributes of these names that a bake has made."""
    for name in (unwanted := made(mesh).intersection(names)):
        mesh.attributes.remove(mesh.attributes[name])
    if unwanted:
        mesh[MADE] = "\n".join(sorted(made(mesh)))
