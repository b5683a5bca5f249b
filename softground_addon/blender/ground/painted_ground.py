"""Painted channels of a ground: vertex groups or float attributes that multiply its material."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.ground.variation import CHANNELS
from ...core.numerics.arrays import Array
from ..properties import SoftGroundPainted
from ..rigs.object_data import mesh_of

_SETTINGS = dict(zip(CHANNELS, ("stiffness", "layer_depth", "rim"), strict=True))
"""The setting that names what each channel is painted with."""

Names = tuple[str, ...]
"""Of what is painted, in the order of `CHANNELS`; empty where nothing is."""


def names_of(ground: bpy.types.Object, painted: Sequence[str]) -> Names:
    """The chosen names, in the order of `CHANNELS`, that the mesh of a ground is painted with.

    Raises
    ------
    InputError
        If a name that the user chose is not there, or is of another kind.
    """
    return tuple(_name(ground, *chosen) for chosen in zip(painted, _SETTINGS.values(), strict=True))


def _name(ground: bpy.types.Object, name: str, setting: str) -> str:
    attribute = mesh_of(ground).attributes.get(name) if name else None
    if attribute and (attribute.domain, attribute.data_type) != ("POINT", "FLOAT"):
        raise InputError(
            f"Attribute '{name}' of ground '{ground.name}' is not a float attribute on vertices: convert it in Object "
            "Data Properties > Attributes (domain Vertex, type Float)."
        )
    if is_there(ground, name):
        return name
    if name and name != cast("Any", SoftGroundPainted.bl_rna.properties[setting]).default:
        raise InputError(
            f"Ground '{ground.name}' has no vertex group or attribute '{name}': paint one of that name, or leave the "
            "field in Properties > Physics > Masks empty."
        )
    return ""


def is_there(ground: bpy.types.Object, name: str) -> bool:
    """True if a ground has a vertex group or an attribute of that name."""
    return bool(name) and (name in mesh_of(ground).attributes or name in ground.vertex_groups)


def factors(ground: bpy.types.Object, mesh: bpy.types.Mesh, names: Names) -> Array | None:
    """Factors on the material at the vertices of a mesh.

    Parameters
    ----------
    ground : bpy.types.Object
        Whose vertex groups they are.
    mesh : bpy.types.Mesh
        Its own mesh, or the evaluated one.

    Returns
    -------
    (V, 3) float array, or None where nothing is painted.
    """
    if not any(names):
        return None
    values = np.ones((len(mesh.vertices), len(CHANNELS)), np.float32)
    for channel, name in enumerate(names):
        attribute: Any = mesh.attributes.get(name) if name else None
        if attribute and (attribute.domain, attribute.data_type) == ("POINT", "FLOAT"):
            column = np.empty(len(mesh.vertices), np.float32)
            attribute.data.foreach_get("value", column)
            values[:, channel] = column
        elif name in ground.vertex_groups:
            group = ground.vertex_groups[name].index
            for number, vertex in enumerate(mesh.vertices):
                for member in vertex.groups:
                    if member.group == group:
                        values[number, channel] = member.weight
    return values.astype(np.float64)
