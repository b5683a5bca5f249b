"""The ground as a mesh: its undisturbed surface in, the pressed ground out, and back to what it was.

While a bake is on a ground, its mesh carries: the undisturbed positions (attribute `softground_rest`), the raw heights
(shape key Basis), the blurred heights (shape key `SoftGround Display`), the shading attributes, and the record of
footprints (`mesh["softground_record"]`). `restore` takes all of it away again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, cast

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.ground.heightfield import Terrain
from ...core.ground.terrain import MeshTerrain
from ...core.numerics.slices import Slices, sliced
from ...core.record.footprints import NEVER
from ...core.record.pressed_ground import GroundSample
from .. import mesh_arrays
from ..compat import remove_scene
from ..playback import display_key, own_data, playback, weather_modifier
from ..playback.own_data import AGE, COMPRESSION, PROPERTIES, RECORD, REST, RIM, SUMMARY, WARNINGS
from . import painted_ground

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

SHOWN = ("steps", "max_depth_m", "typical_depth_m", "peak_force_n")
"""Numbers that every summary has."""

_BY_PARTS = ("BONE", "VERTEX", "VERTEX_3")
"""Ways in which an object hangs on a part of its parent, which may lie elsewhere than the parent."""

ON_SURFACE = 2e-3
"""Vertices deeper than this below the surface, such as the underside of a slab, do not move with it [m]."""


@dataclass(frozen=True)
class GroundSurface:
    """The undisturbed ground in world space.

    Attributes
    ----------
    name : str
        Of the object.
    vertices : (V, 3) float array
        World positions of the vertices that the bake moves [m].
    surface_vertices : (W, 3) float array
        World positions of the evaluated surface [m]: the same, unless modifiers add vertices.
    triangles : (T, 3) int array
        Triangles of the evaluated surface.
    factors : (W, 3) float array, optional
        What is painted on the evaluated surface; see `painted_ground`.
    """

    name: str
    vertices: Array
    surface_vertices: Array
    triangles: Indices
    factors: Array | None = None


@sliced
def terrain_of(surface: GroundSurface, bounds: Array | None = None) -> Slices[MeshTerrain]:
    """A ground's surface as a function of place, within bounds in the plane [m]."""
    mesh, name = (surface.surface_vertices, surface.triangles), f"Ground '{surface.name}'"
    return (yield from MeshTerrain.from_mesh.slices(*mesh, bounds, surface.factors, name=name))


AT_ONCE = 1 << 17
"""Vertices that are looked at together: of a large ground in a hundredth of a second."""


def parts_of(vertices: Array) -> list[Array]:
    """Vertices (V, 3) in parts that are looked at together; at least one."""
    return np.split(vertices, range(AT_ONCE, len(vertices), AT_ONCE))


@sliced
def pressed_vertices(
    vertices: Array, covers: Callable[[Array, Array], NDArray[np.bool_]], terrain: Terrain
) -> Slices[Indices]:
    """Which of the vertices (V, 3) lie on top of the surface at places (x, y) that are covered, (K,)."""
    pressed = []
    for number, part in enumerate(parts_of(vertices)):
        near = np.flatnonzero(covers(part[:, 0], part[:, 1]))
        yield
        x, y, z = part[near].T
        pressed.append(number * AT_ONCE + near[np.abs(z - terrain.heights(x, y)) < ON_SURFACE])
    return np.concatenate(pressed)


def mesh_of(ground: bpy.types.Object) -> bpy.types.Mesh:
    """The mesh of a mesh object."""
    return cast("bpy.types.Mesh", ground.data)


def users_modifiers(ground: bpy.types.Object) -> list[bpy.types.Modifier]:
    """The modifiers of the ground that play no bake and no weather over it."""
    ours = (playback.modifier_of(ground), weather_modifier.modifier_of(ground))
    return [item for item in ground.modifiers if item not in ours]


def is_baked(ground: bpy.types.Object) -> bool:
    """Return whether a bake is on this ground."""
    return has_remains(ground) and RECORD in mesh_of(ground).keys()  # noqa: SIM118  (an ID is no mapping)


def has_remains(ground: bpy.types.Object) -> bool:
    """Return whether a bake is on this ground, or at least what a bake would take away again."""
    return ground.type == "MESH" and own_data.has_made(mesh_of(ground), REST)


def summary_of(ground: bpy.types.Object) -> dict[str, float]:
    """What the bake that is on this ground came to, for display; empty if there is none, or something else there."""
    summary = mesh_of(ground).get(SUMMARY) if ground.type == "MESH" else None
    values = summary.to_dict() if hasattr(summary, "to_dict") else {}
    numbers = all(isinstance(value, int | float) and math.isfinite(value) for value in values.values())
    return values if numbers and values.keys() >= set(SHOWN) else {}


def note_warnings(ground: bpy.types.Object, warnings: Sequence[str]) -> None:
    """Keep with a bake what the user should know of it."""
    mesh_of(ground)[WARNINGS] = "\n".join(warnings)


def warnings_of(ground: bpy.types.Object) -> list[str]:
    """What the user should know of the bake that is on this ground."""
    return str(mesh_of(ground).get(WARNINGS, "")).splitlines() if ground.type == "MESH" else []


def rest_vertices(ground: bpy.types.Object, unit_scale: float) -> Array:
    """World positions of the mesh's vertices without any bake or modifier, (V, 3) [m].

    Raises
    ------
    InputError
        If some are no numbers.
    """
    vertices = _transform(to_world_of(ground, unit_scale), rest_positions(mesh_of(ground)))
    if not np.isfinite(vertices).all():
        raise InputError(f"Ground '{ground.name}' has vertices without a valid position (NaN): delete them first.")
    return vertices


@sliced
def undisturbed_surface(
    ground: bpy.types.Object, unit_scale: float, painted: painted_ground.Names = ()
) -> Slices[GroundSurface]:
    """The ground as it is without any bake, in world space and metres, with what is painted on it.

    Blender is asked for nothing after the first slice.

    Raises
    ------
    InputError
        If the surface has points that are no numbers.
    """
    mesh, name = mesh_of(ground), ground.name
    vertices = rest_vertices(ground, unit_scale)
    to_world = to_world_of(ground, unit_scale)
    if not any(modifier.show_viewport for modifier in ground.modifiers):
        surface, faces = vertices, mesh_arrays.read_faces(mesh)
        factors = painted_ground.factors(ground, mesh, painted)
    else:
        with undisturbed_copy(ground) as evaluated:
            faces = mesh_arrays.read_faces(evaluated)
            surface = _transform(to_world, faces.positions)
            factors = painted_ground.factors(ground, evaluated, painted)
        if len(surface) == len(vertices):
            vertices = surface
    yield
    triangles = yield from mesh_arrays.triangle_vertices.slices(faces)
    if np.linalg.det(to_world[:3, :3]) < 0:
        triangles = triangles[:, ::-1]
    return GroundSurface(name, vertices, surface, triangles, factors)


def to_world_of(ground: bpy.types.Object, unit_scale: float) -> Array:
    """Object space to world space in metres, (4, 4), whether the ground is visible or not."""
    placed = ground.matrix_world if ground.visible_get() else placed_by_parents(ground)
    if placed is None:
        with stand_in(ground) as evaluated:
            placed = evaluated.matrix_world.copy()
    matrix = np.array(placed, dtype=np.float64)
    matrix[:3] *= unit_scale
    return matrix


def placed_by_parents(obj: bpy.types.Object) -> Matrix | None:
    """Object space to world space by an object's own values and those of its parents, hidden or not.

    Blender keeps no world matrix of what is hidden. None where constraints, physics, bones or vertices have a say in
    it: only Blender can tell then, by evaluating the object in a scene that shows it.
    """
    parent, body = obj.parent, obj.rigid_body
    if any(not constraint.mute for constraint in obj.constraints) or (body and body.type == "ACTIVE"):
        return None
    if parent is None:
        return obj.matrix_basis
    if obj.parent_type in _BY_PARTS or (parent.type == "CURVE" and parent.data.use_path):
        return None
    above = placed_by_parents(parent)
    return None if above is None else above @ obj.matrix_parent_inverse @ obj.matrix_basis


@contextmanager
def stand_in(
    ground: bpy.types.Object,
    mesh: bpy.types.Mesh | None = None,
    *,
    weather_at: int | None = None,
    weather: bpy.types.NodeTree | None = None,
    with_users: bool = True,
) -> Iterator[bpy.types.Object]:
    """A visible copy of the ground with a mesh in a scene of its own, evaluated; without a mesh, with no modifiers.

    Modifiers that change over time are evaluated at the first frame of the bake, or at one at which the copy is to be
    under weather, its own or another group's. Those of the user may be left out.
    """
    scene = bpy.data.scenes.new("SoftGround Evaluation")
    for shown_in in ground.users_scene[:1]:
        scene.frame_current, render = shown_in.softground.frame_start, shown_in.render
        scene.render.frame_map_old, scene.render.frame_map_new = render.frame_map_old, render.frame_map_new
    if weather_at is not None:
        scene.frame_current = weather_at
    copy = ground.copy()
    try:
        copy.hide_viewport = False
        if mesh is None:
            copy.modifiers.clear()
        else:
            copy.data = mesh
            its_weather: Any = weather_modifier.modifier_of(copy)
            if weather is not None:
                its_weather.node_group = weather
            users = [] if with_users else users_modifiers(copy)
            for unwanted in (playback.modifier_of(copy), its_weather if weather_at is None else None, *users):
                if unwanted:
                    copy.modifiers.remove(unwanted)
        scene.collection.objects.link(copy)
        layer = scene.view_layers[0]
        layer.update()
        yield copy.evaluated_get(cast("bpy.types.Depsgraph", layer.depsgraph))
    finally:
        bpy.data.objects.remove(copy)
        remove_scene(scene)


@contextmanager
def undisturbed_copy(
    ground: bpy.types.Object, moved: Indices | None = None, by: Array | None = None
) -> Iterator[bpy.types.Mesh]:
    """The evaluated mesh of the ground, hidden or not, with its modifiers but without its bake.

    Vertices of its mesh (K,) may be moved, by as much (3,) in its own space and units.
    """
    mesh = mesh_of(ground).copy()
    try:
        rest = rest_positions(mesh)
        if moved is not None:
            rest[moved] += np.asarray(by, dtype=np.float32)
        display_key.drop_all(mesh)
        write_positions(mesh, rest)
        if any(modifier.show_viewport for modifier in users_modifiers(ground)):
            with stand_in(ground, mesh) as evaluated:
                yield mesh_of(evaluated)
        else:
            yield mesh
    finally:
        bpy.data.meshes.remove(mesh)


def write(
    ground: bpy.types.Object,
    index: Indices,
    pressed: GroundSample,
    record: bytes,
    unit_scale: float,
    *,
    shape_keys: bool = True,
) -> None:
    """Put a bake on the ground, in place of the one that may be there.

    The raw heights become the mesh's positions and Basis, the blurred ones the shape key of `display_key` at value 1.
    Without shape keys, the blurred heights are the mesh's positions.

    Parameters
    ----------
    ground : bpy.types.Object
    index : (K,) int array
        Vertices of its mesh that the bake moves.
    pressed : GroundSample
        What it does to each of them.
    record : bytes
        The footprints, from `core.record.record`.
    unit_scale : float
        Metres per Blender unit.
    shape_keys : bool
        Blender evaluates shape keys on the whole mesh at each frame that is played, which a dense ground feels.
    """
    mesh = mesh_of(ground)
    rest = rest_positions(mesh)
    rest_attribute = own_data.attribute(mesh, REST, "FLOAT_VECTOR")
    rest_attribute.data.foreach_set("vector", rest.ravel())
    up = up_of(ground, unit_scale)
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


def up_of(ground: bpy.types.Object, unit_scale: float) -> Array:
    """World up in the ground's own space and units, of the length of one metre, (3,)."""
    up: Array = np.linalg.inv(to_world_of(ground, unit_scale)[:3, :3])[:, 2]
    return up


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
    attribute = mesh.attributes[REST] if own_data.has_made(mesh, REST) else None
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
    mesh.attributes["position"].data.foreach_set("vector", positions.ravel())
    first = mesh.vertices[0]
    first.co = first.co  # refreshes the bounding box, which the bulk write leaves stale before 5.1
    mesh.update()


def _transform(matrix: Array, points: NDArray[np.float32]) -> Array:
    return points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
