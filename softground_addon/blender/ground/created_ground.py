"""The ground that the add-on makes: wide around the walk, fine where feet come down, its edge soft."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace
from zlib import crc32

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.composers.ground_plan import GroundPlan
from ...core.composers.relief_plan import reach_of_relief
from ...core.ground.heightfield import FlatTerrain
from ...core.ground.material import GroundMaterial
from ...core.meshing.face_edges import face_edges
from ...core.meshing.graded_grid import Blocks, GradedGrid, graded_grid
from ...core.motion.ground_frame import GroundFrame
from ...core.numerics.arrays import Array
from ...core.numerics.slices import Slices, sliced
from ...core.settings import BakeSettings, ObjectName
from ..drafts import none_left_if_it_fails
from ..materials.materials import EDGE, drafted, ensure_material
from ..mesh_arrays import add_attributes, add_faces, positions
from ..placement import to_world
from ..settings import find, name_of, resolve
from .ground_mesh import discard, mesh_of, write_positions

MAX_GRID_VERTICES = 4_000_000
"""Most vertices that a created grid gets; a longer walk gets a coarser mesh (the physics keeps its cells)."""

COARSEST = 0.4
"""Side of the largest faces, far from the trail [m]: what follows vertices, such as paint, still has some. Larger only
where so many would exceed `MAX_GRID_VERTICES`, as between characters that are kilometres apart."""

AS_CREATED = "softground_as_created"
"""Property of a mesh that was made: the `made_shape` of its ground then."""

SOFT_EDGE = 0.5
"""Part of its margin over which a ground ends softly."""

BLUR_REACH = 3.0
"""Cut-off of the display blur [standard deviations]."""


@dataclass(frozen=True)
class Layout:
    """Plan of a created ground, before its mesh is made.

    Attributes
    ----------
    vertices : (V, 3) float array
        World positions [m].
    local : (V, 3) float32 array
        Positions in the object's own space and units.
    location : (3,) float32 array
        Of the object, in Blender units.
    frame : GroundFrame or None
        That all of these are in, instead of the world.
    corner_vertex, face_size : int arrays
        See `GradedGrid`.
    """

    vertices: Array
    local: NDArray[np.float32]
    location: NDArray[np.float32]
    corner_vertex: NDArray[np.intp]
    face_size: NDArray[np.intp]
    frame: GroundFrame | None = None

    @property
    def plane(self) -> FlatTerrain:
        """The terrain of a level one."""
        low, high = (tuple(corner(self.vertices[:, :2], axis=0).tolist()) for corner in (np.min, np.max))
        return FlatTerrain(float(self.vertices[0, 2]), low, high)


@sliced
def laid_out(wanted: BakeSettings, plan: GroundPlan) -> Slices[Layout]:
    """The layout of a ground for a plan: with its margin, and fine where the camera comes close."""
    layout = yield from lay_out.slices(
        plan.widened(wanted.margin_m, wanted.camera),
        wanted.cell_size_m,
        wanted.unit_scale_m,
        reach=max(reach_of(wanted.material), reach_of_relief(wanted.inputs())),
        close_up=_close_up(wanted, plan),
    )
    return replace(layout, frame=wanted.frame)


def created(drafts: ExitStack, wanted: BakeSettings, layout: Layout) -> Slices[ObjectName]:
    """A draft of a ground that is laid out; its material is there."""
    drafts.enter_context(drafted(wanted.surface))
    yield
    return (yield from draft.slices(drafts, layout, SOFT_EDGE * wanted.margin_m))


def reach_of(material: GroundMaterial) -> float:
    """Distance beyond the soles to which a material moves the ground [m]."""
    return material.rim_reach + BLUR_REACH * material.blur_sigma


@dataclass(frozen=True)
class CloseUp:
    """Part of a ground whose mesh is finer than its cells.

    Attributes
    ----------
    spacing : float
        Distance of the vertices there [m], at most that of the cells; doubled where there would be too many.
    near : (N,) bool array
        The plan's footfalls around which it is.
    vertices : int
        Most that there may be.
    """

    spacing: float
    near: NDArray[np.bool_]
    vertices: int


def _close_up(wanted: BakeSettings, plan: GroundPlan) -> CloseUp | None:
    """Part of a created ground that is finer than its cells, to show relief close up."""
    if wanted.relief != "CLOSE_UP" or plan.footfalls is None:
        return None
    near = np.ones(len(plan.footfalls), bool)
    if wanted.camera is not None:
        near = wanted.camera.is_near(plan.footfalls, wanted.spacing_m)
    return CloseUp(wanted.spacing_m, near, wanted.relief_vertices)


@sliced
def lay_out(
    plan: GroundPlan, cell_size: float, unit_scale: float, *, reach: float = 0.0, close_up: CloseUp | None = None
) -> Slices[Layout]:
    """A plane ground whose vertices sit on the centres of the cells.

    Parameters
    ----------
    plan : GroundPlan
        Without footfalls, the ground is equally fine everywhere.
    cell_size : float
        Size of the physics' cells [m]; the mesh takes a multiple of it where it would exceed `MAX_GRID_VERTICES`.
    unit_scale : float
        Metres per Blender unit.
    reach : float
        How far beyond the footfalls it is fine [m].
    close_up : CloseUp, optional
    """
    grid, spacing = yield from _graded(plan, cell_size, reach, close_up)
    yield
    place = (grid.vertices + 0.5) * spacing
    middle = (place.min(axis=0) + place.max(axis=0)) / 2
    centre = np.append(middle, plan.terrain.heights(*middle))
    yield
    local = ((np.column_stack([place, plan.terrain.heights(*place.T)]) - centre) / unit_scale).astype(np.float32)
    location = (centre / unit_scale).astype(np.float32)
    vertices = (local.astype(np.float64) + location) * unit_scale
    return Layout(vertices, local, location, grid.corner_vertex, grid.face_size)


@sliced
def draft(drafts: ExitStack, layout: Layout, edge: float = 0.0) -> Slices[ObjectName]:
    """The ground as an object that is in no scene yet; one that is in none as `drafts` close is taken away.

    Its material fades out over the width of its edge [m].
    """
    corner_vertex, face_start = layout.corner_vertex, np.cumsum(layout.face_size) - layout.face_size
    edges = yield from face_edges.slices(corner_vertex, face_start)
    yield
    with none_left_if_it_fails():
        mesh = bpy.data.meshes.new("SoftGround")
        mesh.vertices.add(len(layout.local))
        write_positions(mesh, layout.local)  # before there are faces, which it would look at
        add_faces(mesh, corner_vertex, face_start, *edges)
        ground = bpy.data.objects.new("SoftGround", mesh)
        ground.location = layout.location.tolist()
        if layout.frame:
            ground.matrix_basis = to_world(layout.frame, ground) @ ground.matrix_basis
        name = name_of(ground)
    drafts.callback(_discard_unpublished, name)
    del edges
    yield
    mesh = mesh_of(resolve(name))
    mesh.update()
    mesh.shade_smooth()
    yield
    uv = layout.local[:, :2] - layout.local[:, :2].min(axis=0)
    layer = mesh_of(resolve(name)).uv_layers.new(name="UVMap")  # over the whole ground, its longer side from 0 to 1
    layer.uv.foreach_set("vector", (uv / uv.max())[corner_vertex].ravel())
    yield
    if edge > 0:
        inward = np.minimum(*(np.minimum(axis - axis.min(), axis.max() - axis) for axis in layout.vertices.T[:2]))
        add_attributes(mesh_of(resolve(name)), [(EDGE, "FLOAT", np.clip(1.0 - inward / edge, 0.0, 1.0))])
    yield
    mesh_of(resolve(name))[AS_CREATED] = made_shape(resolve(name))
    return name


def made_shape(ground: bpy.types.Object) -> str:
    """Checksum of what a user may edit of a ground that was made: its place, vertices, UV maps and attributes."""
    mesh = mesh_of(ground)
    values = [positions(mesh), *(np.empty(2 * len(layer.uv), np.float32) for layer in mesh.uv_layers)]
    for layer, uv in zip(mesh.uv_layers, values[1:], strict=True):
        layer.uv.foreach_get("vector", uv)
    names = sorted(item.name for item in mesh.attributes if not item.name.startswith("."))
    said = repr(([tuple(row[:]) for row in ground.matrix_basis[:]], names, [crc32(each.tobytes()) for each in values]))
    return f"{crc32(said.encode()):08x}"


def _discard_unpublished(name: ObjectName) -> None:
    if (remaining := find(name)) is not None and not remaining.users_collection:
        discard(remaining)


def publish(scene: bpy.types.Scene, ground: bpy.types.Object, surface: str) -> None:
    """Put a draft into a scene as its ground, in the active collection, with the render material of some surface."""
    mesh_of(ground).materials.append(ensure_material(surface))
    active = _layer_of(scene).active_layer_collection
    shown = active is not None and active.is_visible and active.collection.is_editable
    (active.collection if active and shown else scene.collection).objects.link(ground)
    scene.softground.ground = ground
    for view_layer in scene.view_layers:
        view_layer.update()


def select(scene: bpy.types.Scene, ground: bpy.types.Object) -> None:
    """Select a ground alone, as what was made last, unless somebody edits or poses."""
    layer = _layer_of(scene)
    if layer.objects.active is None or layer.objects.active.mode == "OBJECT":
        for other in list(layer.objects.selected):
            other.select_set(False, view_layer=layer)
        ground.select_set(True, view_layer=layer)
        layer.objects.active = ground


def _layer_of(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    layer = bpy.context.view_layer if bpy.context.scene == scene else scene.view_layers[0]
    assert layer is not None
    return layer


def _graded(
    plan: GroundPlan, cell_size: float, reach: float, close_up: CloseUp | None
) -> Slices[tuple[GradedGrid, float]]:
    """The grid in whole spacings, its vertices in the middle of the cells, and the spacing [m]."""

    def corners(spacing: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        lower, upper = np.floor(plan.lower / spacing - 0.5), np.ceil(plan.upper / spacing - 0.5)
        return lower.astype(np.intp), upper.astype(np.intp)

    if plan.footfalls is None:
        cells = np.ceil((plan.upper - plan.lower) / cell_size).prod()
        spacing = cell_size * int(np.ceil(np.sqrt(max(1.0, cells / MAX_GRID_VERTICES))))
        return (yield from graded_grid.slices(np.zeros((0, 2), dtype=np.intp), 0, *corners(spacing), 0)), spacing
    if close_up is not None and close_up.near.any():
        spacing = close_up.spacing
        fine, level = plan.fine_blocks(spacing, reach, close_up.near)
        while len(fine) * 4**level > close_up.vertices and spacing * 2 < cell_size * 1.5:
            spacing *= 2
            fine, level = plan.fine_blocks(spacing, reach, close_up.near)
        if spacing < 0.75 * cell_size and len(fine) * 4**level <= close_up.vertices:
            coarser = int(np.rint(np.log2(cell_size / spacing)))
            further, its_level = plan.fine_blocks(spacing * 2**coarser, reach)
            coarsest = max(level, its_level + coarser, int(np.floor(np.log2(max(COARSEST / spacing, 1.0)))))
            far = Blocks(further, its_level + coarser, coarser)
            return (yield from graded_grid.slices(fine, level, *corners(spacing), coarsest, far)), spacing
    spacing = cell_size
    fine, level = plan.fine_blocks(spacing, reach)
    while len(fine) * 4**level > MAX_GRID_VERTICES:
        spacing *= 2
        fine, level = plan.fine_blocks(spacing, reach)
    lower, upper = corners(spacing)
    coarsest = max(level, int(np.floor(np.log2(max(COARSEST / spacing, 1.0)))))
    while np.prod((upper - lower) / 2.0**coarsest) > MAX_GRID_VERTICES:
        coarsest += 1
    return (yield from graded_grid.slices(fine, level, lower, upper, coarsest)), spacing
