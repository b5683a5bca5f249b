"""The undisturbed ground as a surface in world space, without any bake: as Blender evaluates it, hidden or not."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, cast

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...core.errors import InputError
from ...core.ground.heightfield import Terrain
from ...core.ground.regions import HARD
from ...core.ground.terrain import MeshTerrain
from ...core.motion.ground_frame import GroundFrame
from ...core.numerics.arrays import Array, Indices
from ...core.numerics.slices import Slices, sliced
from .. import ground_slots, mesh_arrays
from ..compat import remove_scene
from ..placement import matrix_in
from ..playback import display_key, playback, weather_modifier
from . import painted_ground
from .ground_mesh import mesh_of, rest_positions, users_modifiers, write_positions

_BY_PARTS = ("BONE", "VERTEX", "VERTEX_3")
"""Ways in which an object hangs on a part of its parent, which may lie elsewhere than the parent."""

ON_SURFACE = 2e-3
"""Vertices deeper than this below the surface, such as the underside of a slab, do not move with it [m]."""

AT_ONCE = 1 << 17
"""Vertices that are looked at together: of a large ground in a hundredth of a second."""


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
    kinds : (T,) float array, optional
        Number of the kind of ground of each triangle, where there are several; see `core.ground.regions.numbered`.
    """

    name: str
    vertices: Array
    surface_vertices: Array
    triangles: Indices
    factors: Array | None = None
    kinds: Array | None = None


@sliced
def terrain_of(
    surface: GroundSurface, bounds: Array | None = None, *, is_one_of_several: bool = False
) -> Slices[MeshTerrain]:
    """A ground's surface where it is not hard as a function of place, within bounds in the plane [m].

    One of several may lie beside the bounds, where nobody walks: then it is looked up as a whole.
    """
    triangles, kinds, name = surface.triangles, surface.kinds, f"Ground '{surface.name}'"
    is_soft = np.True_ if kinds is None else kinds != HARD
    if kinds is not None and not is_soft.all():
        triangles, kinds = triangles[is_soft], kinds[is_soft]
    mesh = surface.surface_vertices, triangles, bounds, surface.factors
    try:
        return (yield from MeshTerrain.from_mesh.slices(*mesh, of_faces=kinds, name=name))
    except InputError:
        if is_one_of_several:
            return (yield from terrain_of.slices(surface))
        if is_soft.all():
            raise
    raise InputError(
        f"{name} is nothing but hard floor under the character's path: choose a preset for a material there, in "
        "Properties > Physics > Ground by Material."
    )


@sliced
def hard_part(surface: GroundSurface | None, bounds: Array | None) -> Slices[list[MeshTerrain]]:
    """A ground's surface where it is hard; none where it is not, within bounds in the plane [m]."""
    if surface is None or surface.kinds is None or not (hard := surface.kinds == HARD).any():
        return []
    with suppress(InputError):  # nobody walks there
        return [(yield from MeshTerrain.from_mesh.slices(surface.surface_vertices, surface.triangles[hard], bounds))]
    return []


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


def rest_vertices(ground: bpy.types.Object, unit_scale: float, frame: GroundFrame | None = None) -> Array:
    """Positions, in the world or in a frame, of the mesh's vertices without any bake or modifier, (V, 3) [m].

    Raises
    ------
    InputError
        If some are no numbers.
    """
    vertices = _transform(to_world_of(ground, unit_scale, frame), rest_positions(mesh_of(ground)))
    if not np.isfinite(vertices).all():
        raise InputError(f"Ground '{ground.name}' has vertices without a valid position (NaN): delete them first.")
    return vertices


@sliced
def undisturbed_surface(
    ground: bpy.types.Object,
    unit_scale: float,
    painted: painted_ground.Names = (),
    regions: Mapping[int, float] = MappingProxyType({}),
    frame: GroundFrame | None = None,
) -> Slices[GroundSurface]:
    """The ground as it is without any bake, in the world or in a frame, in metres, with what is painted on it.

    `regions` has the number of the kind of ground of each material slot that names one.

    Blender is asked for nothing after the first slice.

    Raises
    ------
    InputError
        If the surface has points that are no numbers, or modifiers leave it none.
    """
    mesh, name = mesh_of(ground), ground.name
    vertices = rest_vertices(ground, unit_scale, frame)
    to_world = to_world_of(ground, unit_scale, frame)
    if not any(modifier.show_viewport for modifier in ground.modifiers):
        surface, faces, slots = vertices, mesh_arrays.read_faces(mesh), ground_slots.of_faces(mesh)
        factors = painted_ground.factors(ground, mesh, painted)
    else:
        with undisturbed_copy(ground) as evaluated:
            faces = mesh_arrays.read_faces(evaluated)
            surface, slots = _transform(to_world, faces.positions), ground_slots.of_faces(evaluated)
            factors = painted_ground.factors(ground, evaluated, painted)
        if not len(faces.triangle_face):
            remedy = "if they show instances, let Realize Instances follow, or apply them."
            raise InputError(f"The modifiers of ground '{name}' give it no faces to print on: {remedy}")
        if len(surface) == len(vertices):
            vertices = surface
    yield
    triangles = yield from mesh_arrays.triangle_vertices.slices(faces)
    if np.linalg.det(to_world[:3, :3]) < 0:
        triangles = triangles[:, ::-1]
    kinds = numbers_of(slots[faces.triangle_face], regions)
    return GroundSurface(name, vertices, surface, triangles, factors, kinds if kinds.any() else None)


def numbers_of(slots: NDArray[np.int32], regions: Mapping[int, float]) -> Array:
    """Numbers of the kinds of ground, by those of slots (T,), 0 where these name none."""
    number_of = np.zeros(int(slots.max(initial=0)) + 1)
    for slot, number in regions.items():
        number_of[slot : slot + 1] = number
    return np.asarray(number_of[slots])


def to_world_of(ground: bpy.types.Object, unit_scale: float, frame: GroundFrame | None = None) -> Array:
    """Object space to world space in metres, or to a frame, (4, 4), whether the ground is visible or not."""
    if frame is not None and (frame.moves or placed_by_parents(ground) is not None):
        matrix = matrix_in(frame, ground)
    else:
        placed = ground.matrix_world if ground.visible_get() else placed_by_parents(ground)
        if placed is None:
            with stand_in(ground) as evaluated:
                placed = evaluated.matrix_world.copy()
        matrix = np.array(placed, dtype=np.float64)
        if frame is not None:
            matrix = np.array(frame.matrix) @ matrix
    matrix[:3] *= unit_scale
    return matrix


def up_of(ground: bpy.types.Object, unit_scale: float, frame: GroundFrame | None = None) -> Array:
    """Up in the ground's own space and units, of the length of one metre, (3,)."""
    up: Array = np.linalg.inv(to_world_of(ground, unit_scale, frame)[:3, :3])[:, 2]
    return up


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
    if obj.parent_type in _BY_PARTS or (parent.type == "CURVE" and getattr(parent.data, "use_path", False)):
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
    level: int = 0,
) -> Iterator[bpy.types.Object]:
    """A visible copy of the ground with a mesh in a scene of its own, evaluated; without a mesh, with no modifiers.

    Modifiers that change over time are evaluated at the first frame of the bake, or at one at which the copy is to be
    under weather, its own or another group's. Those of the user may be left out. Where a level is given, the last
    of them subdivides so often (see `subdivision`).
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
            if level:
                subdivision(copy).levels = level
        scene.collection.objects.link(copy)
        layer = scene.view_layers[0]
        layer.update()
        yield copy.evaluated_get(cast("bpy.types.Depsgraph", layer.depsgraph))
    finally:
        bpy.data.objects.remove(copy)
        remove_scene(scene)


def subdivision(ground: bpy.types.Object) -> Any:
    """The modifier that subdivides the ground; None where others come after it, which may need its vertices."""
    shown = [modifier for modifier in users_modifiers(ground) if modifier.show_viewport]
    return shown[-1] if shown and shown[-1].type == "SUBSURF" else None


@contextmanager
def undisturbed_copy(
    ground: bpy.types.Object, moved: Indices | None = None, by: Array | None = None, *, level: int = 0
) -> Iterator[bpy.types.Mesh]:
    """The evaluated mesh of the ground, hidden or not, with its modifiers but without its bake.

    Vertices of its mesh (K,) may be moved, by as much (3,) in its own space and units. `level` as of `stand_in`.
    """
    mesh = mesh_of(ground).copy()
    try:
        rest = rest_positions(mesh)
        if moved is not None:
            rest[moved] += np.asarray(by, dtype=np.float32)
        display_key.drop_all(mesh)
        write_positions(mesh, rest)
        if any(modifier.show_viewport for modifier in users_modifiers(ground)):
            with stand_in(ground, mesh, level=level) as evaluated:
                yield mesh_of(evaluated)
        else:
            yield mesh
    finally:
        bpy.data.meshes.remove(mesh)


def _transform(matrix: Array, points: NDArray[np.float32]) -> Array:
    return points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
