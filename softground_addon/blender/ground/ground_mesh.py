"""The mesh of the ground: pressed heights, shading and record on it, and back to what it was.

While a bake is on a ground, its mesh carries: the undisturbed positions (attribute `softground_rest`), the raw heights
(shape key Basis), the blurred heights (shape key `SoftGround Display`), the shading attributes, and the record of
footprints (`mesh["softground_record"]`). `restore` takes all of it away again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.numerics.arrays import Array, Indices
from ...core.record.footprints import NEVER
from ...core.record.pressed_ground import GroundSample
from .. import mesh_arrays
from ..plants import trampling_table
from ..playback import display_key, own_data, playback, weather_modifier
from ..playback.own_data import AGE, COMPRESSION, FRAME, PROPERTIES, RECORD, REST, RIM, SUMMARY, WARNINGS
from ..rigs.object_data import mesh_of

SHOWN = ("steps", "max_depth_m", "typical_depth_m", "peak_force_n")
"""Numbers that every summary has."""


def users_modifiers(ground: bpy.types.Object) -> list[bpy.types.Modifier]:
    """The modifiers of the ground that play no bake, no weather over it, and no plants that give way."""
    ours = (playback.modifier_of(ground), weather_modifier.modifier_of(ground), trampling_table.modifier_of(ground))
    return [item for item in ground.modifiers if item not in ours]


def is_baked(ground: bpy.types.Object) -> bool:
    """True if a bake is on this ground."""
    return has_remains(ground) and RECORD in mesh_of(ground).keys()  # noqa: SIM118  (an ID is no mapping)


def has_remains(ground: bpy.types.Object) -> bool:
    """True if a bake is on this ground, or at least what a bake would take away again."""
    return ground.type == "MESH" and own_data.has_made(mesh_of(ground), REST)


def summary_of(ground: bpy.types.Object) -> dict[str, float]:
    """Stored summary of the bake on a ground; empty if it has none, or an unreadable one."""
    summary: Any = mesh_of(ground).get(SUMMARY) if ground.type == "MESH" else None
    values = summary.to_dict() if hasattr(summary, "to_dict") else {}
    numbers = all(isinstance(value, int | float) and math.isfinite(value) for value in values.values())
    return values if numbers and values.keys() >= set(SHOWN) else {}


def note_warnings(ground: bpy.types.Object, warnings: Sequence[str]) -> None:
    """Keep with a bake what the user should know of it."""
    mesh_of(ground)[WARNINGS] = "\n".join(warnings)


def warnings_of(ground: bpy.types.Object) -> list[str]:
    """Stored warnings about the bake on a ground."""
    return str(mesh_of(ground).get(WARNINGS, "")).splitlines() if ground.type == "MESH" else []


def write(
    ground: bpy.types.Object,
    index: Indices,
    pressed: GroundSample,
    record: bytes,
    up: Array,
    *,
    shape_keys: bool = True,
) -> None:
    """Put a bake on the ground, in place of the one that may be there.

    The raw heights become the mesh's positions and Basis, the blurred ones the shape key of `display_key` at value 1.
    Without shape keys, the blurred heights are the mesh's positions.

    Parameters
    ----------
    index : (K,) int array
        Vertices of its mesh that the bake moves.
    pressed : GroundSample
        What it does to each of them.
    record : bytes
        The footprints, from `core.record.record`.
    up : (3,) float array
        One metre upward in the ground's own space and units: `ground_surface.up_of`.
    shape_keys : bool
        Blender evaluates shape keys on the whole mesh at each frame that is played, which a dense ground feels.
    """
    mesh = mesh_of(ground)
    rest = rest_positions(mesh)
    rest_attribute = own_data.attribute(mesh, REST, "FLOAT_VECTOR")
    rest_attribute.data.foreach_set("vector", rest.ravel())
    raw, display = rest.copy(), rest.copy()
    raw[index] += (pressed.raw[:, None] * up).astype(np.float32)
    display[index] += (pressed.display[:, None] * up).astype(np.float32)

    if shape_keys:
        display_key.put(ground, raw, display)
    else:
        display_key.take_off(ground, display)
    for name, values, default in (
        (COMPRESSION, pressed.compression, 0.0),
        (RIM, pressed.rim, 0.0),
        (AGE, pressed.age, NEVER),
    ):
        whole = np.full(len(mesh.vertices), default, dtype=np.float32)
        whole[index] = values
        attribute = own_data.attribute(mesh, name, "FLOAT")
        attribute.data.foreach_set("value", whole)
    # Numbers, not bytes: Blender's Alembic exporter ends the program on bytes that hold a zero.
    mesh.pop(RECORD, None)  # an array that is there would keep its length
    mesh[RECORD] = np.frombuffer(record + bytes(-len(record) % 4), dtype=np.int32)
    write_positions(mesh, raw if shape_keys else display)


def note_frame(ground: bpy.types.Object, matrix: Array | None) -> None:
    """Have materials take places in a frame, by a matrix (4, 4) from the object's space to it; None is the world."""
    mesh = mesh_of(ground)
    for name, column in zip(FRAME, (None,) * 4 if matrix is None else matrix[:3].T, strict=True):
        mesh.pop(name, None)
        if column is not None:
            mesh[name] = column.tolist()


def write_shading(ground: bpy.types.Object, name: str, index: Indices, values: Array | None) -> None:
    """Say of vertices (K,) what they are, (K,) or (K, 3), in an attribute that is 0 at all others; None removes it."""
    mesh = mesh_of(ground)
    if values is None:
        own_data.remove(mesh, [name])
        return
    whole = np.zeros((len(mesh.vertices), *values.shape[1:]), dtype=np.float32)
    whole[index] = values
    kind, field = ("FLOAT", "value") if values.ndim == 1 else ("FLOAT_VECTOR", "vector")
    own_data.attribute(mesh, name, kind).data.foreach_set(field, whole.ravel())


def displayed_positions(ground: bpy.types.Object) -> NDArray[np.float32]:
    """Positions of the finished ground as it is shown, (V, 3) in the object's own space and units."""
    return _shown_positions(mesh_of(ground))


def _shown_positions(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    shown = display_key.positions(mesh)
    return mesh_arrays.positions(mesh) if shown is None else shown


def restore(ground: bpy.types.Object) -> None:
    """Take the bake off the ground: its mesh is what it was before, bit for bit. Without a bake nothing happens.

    Shape keys that the user has made on the baked ground stay.
    """
    if not has_remains(ground):
        return
    mesh = mesh_of(ground)
    rest = rest_positions(mesh)
    weather_modifier.remove(ground)
    playback.remove(ground)
    display_key.take_off(ground, rest)
    own_data.remove(mesh, own_data.ATTRIBUTES)
    for key in PROPERTIES:
        mesh.pop(key, None)
    write_positions(mesh, rest)


def discard(ground: bpy.types.Object) -> None:
    """Remove a ground that the add-on made, with its mesh and playback, unless another object has taken those over."""
    mesh = mesh_of(ground)
    if mesh.users - mesh.use_fake_user == 1:
        weather_modifier.remove(ground)
        playback.remove(ground)
    bpy.data.objects.remove(ground)
    if not mesh.users:
        bpy.data.meshes.remove(mesh)


def remove_mesh(mesh: bpy.types.Mesh) -> None:
    """Remove a mesh that nobody shows, with its shape keys."""
    display_key.drop_all(mesh)
    bpy.data.meshes.remove(mesh)


def rest_positions(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    """Positions without the bake, (V, 3) in the object's own space and units.

    Vertices that the bake does not move are where they are now, so that what the user has modelled since stays.
    """
    attribute: Any = mesh.attributes[REST] if own_data.has_made(mesh, REST) else None
    if attribute is None or (attribute.domain, attribute.data_type) != ("POINT", "FLOAT_VECTOR"):
        return mesh_arrays.positions(mesh)
    flat = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    attribute.data.foreach_get("vector", flat)
    rest = flat.reshape(-1, 3)
    moves = playback.moves(mesh)
    if moves is not None:
        shown = _shown_positions(mesh)
        edited = ~moves & (shown != rest).any(axis=1)  # keeps the sign of zeros
        rest[edited] = shown[edited]
    return rest


def write_positions(mesh: bpy.types.Mesh, positions: NDArray[np.float32]) -> None:
    if not len(positions):
        return
    place: Any = mesh.attributes["position"]
    place.data.foreach_set("vector", positions.ravel())
    first = mesh.vertices[0]
    first.co = first.co  # refreshes the bounding box, which the bulk write leaves stale before 5.1
    mesh.update()
