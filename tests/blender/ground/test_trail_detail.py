"""A fine copy of a coarse ground along the trail: what it carries, and that the original comes back."""

from contextlib import ExitStack

import bpy
import numpy as np
import pytest

from softground_addon.blender.ground import ground_surface, refined_mesh, trail_detail
from softground_addon.blender.settings import name_of, resolve
from softground_addon.core.ground.terrain import MeshTerrain
from softground_addon.core.meshing.refinement import refine
from softground_addon.core.meshing.region import Region
from softground_addon.core.numerics.cell_keys import keys_of
from tests.blender import fingerprints, grounds
from tests.blender.shots import walker


def region(cell_size=0.02):
    """Two prints of 30 by 12 cm around the origin."""
    i, j = np.meshgrid(np.arange(-15, 15), np.arange(-3, 3))
    columns = np.concatenate([i.ravel(), i.ravel() + 30])
    rows = np.concatenate([j.ravel(), j.ravel() + 10])
    return Region(np.unique(keys_of(np.stack([columns, rows], axis=-1))), cell_size)


def coarse_ground(scene, count=4, size=4.0):
    """A grid of a few quads with a slope, and one face of five corners beside it."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=count, y_subdivisions=count, size=size)
    ground = bpy.context.object
    ground.name = ground.data.name = "Field"
    mesh = ground.data
    points = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3)
    points[:, 2] = 0.1 * points[:, 0] + 0.03 * points[:, 1] ** 2
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.update()
    return ground


def dress(ground):
    """Everything that a mesh can carry."""
    mesh = ground.data
    rng = np.random.default_rng(1)
    for name in ("Snow", "Rock"):
        mesh.materials.append(bpy.data.materials.new(name))
    mesh.polygons.foreach_set("material_index", np.arange(len(mesh.polygons)) % 2)
    mesh.polygons.foreach_set("use_smooth", np.arange(len(mesh.polygons)) % 3 > 0)
    mesh.uv_layers.new(name="Second").active_render = True
    for layer in mesh.uv_layers:
        layer.uv.foreach_set("vector", rng.random(2 * len(mesh.loops)).astype(np.float32))
    for name, kind, domain, width in (
        ("wetness", "FLOAT", "POINT", 1),
        ("flow", "FLOAT_VECTOR", "POINT", 3),
        ("tint", "FLOAT_COLOR", "CORNER", 4),
        ("paint", "BYTE_COLOR", "POINT", 4),
        ("place", "INT", "FACE", 1),
        ("marked", "BOOLEAN", "EDGE", 1),
    ):
        attribute = mesh.attributes.new(name, kind, domain)
        values = rng.random(len(attribute.data) * width)
        field, _, dtype = refined_mesh.LAYOUT[kind]
        attribute.data.foreach_set(
            field, (values * (50 if kind == "INT" else 1) + (kind == "BOOLEAN") / 2).astype(dtype)
        )
    group = ground.vertex_groups.new(name="grass")
    for vertex in mesh.vertices:
        group.add([vertex.index], float(rng.random()), "REPLACE")
    for edge in mesh.edges:
        edge.use_seam = bool(rng.random() < 0.3)
        edge.use_edge_sharp = bool(rng.random() < 0.3)


def refined(ground, spacing=0.02, where=None):
    surface = trail_detail.surface_of(ground, 1.0)
    with ExitStack() as drafts:
        draft = trail_detail.draft(drafts, ground, surface, refine(surface, where or region(), spacing))
        return trail_detail.publish(ground, resolve(draft))


def triangles_of(mesh):
    mesh.calc_loop_triangles()
    values = np.empty(len(mesh.loop_triangles) * 3, dtype=np.int32)
    mesh.loop_triangles.foreach_get("loops", values)
    return values.reshape(-1, 3)


def corners_of(mesh, values, domain):
    """Values of any domain at each corner."""
    if domain == "CORNER":
        return values
    number = np.empty(len(mesh.loops), dtype=np.int32)
    if domain == "POINT":
        mesh.loops.foreach_get("vertex_index", number)
        return values[number]
    size = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_total", size)
    return np.repeat(values, size, axis=0)


def read(mesh, name):
    attribute = mesh.attributes[name]
    field, width, dtype = refined_mesh.LAYOUT[attribute.data_type]
    values = np.empty(len(attribute.data) * width, dtype=dtype)
    attribute.data.foreach_get(field, values)
    return corners_of(mesh, values.reshape(-1, width), attribute.domain)


def sample_in_source(original, fine, name):
    """For points inside the fine mesh's triangles: the values there in both meshes."""
    source, target = triangles_of(original), triangles_of(fine)
    place = corners_of(original, points(original), "POINT")[source][..., :2].astype(float)
    weights = np.random.default_rng(3).dirichlet([1, 1, 1], len(target))
    where = np.einsum("nk,nki->ni", weights, corners_of(fine, points(fine), "POINT")[target][..., :2].astype(float))
    a, b, c = (place[None, :, k] for k in range(3))
    p = where[:, None]

    def cross(u, v):
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    area = cross(b - a, c - a)
    w = np.stack([cross(b - p, c - p), cross(c - p, a - p), cross(a - p, b - p)], axis=-1) / area[..., None]
    inside = w.min(axis=-1).argmax(axis=1)
    w = w[np.arange(len(where)), inside]
    in_source = np.einsum("nk,nki->ni", w, read(original, name)[source[inside]].astype(float))
    in_target = np.einsum("nk,nki->ni", weights, read(fine, name)[target].astype(float))
    return in_source, in_target


def points(mesh):
    values = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", values)
    return values.reshape(-1, 3)


@pytest.mark.parametrize("name", ["position", "UVMap", "Second", "wetness", "flow", "tint", "paint"])
def test_attributes_interpolate_those_of_the_original(scene, name):
    ground = coarse_ground(scene)
    dress(ground)
    fine = refined(ground).data
    in_source, in_target = sample_in_source(ground.data, fine, name)
    np.testing.assert_allclose(in_target, in_source, atol=1 / 255 if name == "paint" else 4e-5)


@pytest.mark.parametrize("name", ["material_index", "place"])
def test_faces_keep_what_they_are(scene, name):
    ground = coarse_ground(scene)
    dress(ground)
    in_source, in_target = sample_in_source(ground.data, refined(ground).data, name)
    np.testing.assert_allclose(in_target, in_source, atol=1e-9)


def edge_lengths(mesh, chosen):
    ends = np.empty(len(mesh.edges) * 2, dtype=np.int32)
    mesh.edges.foreach_get("vertices", ends)
    ends = points(mesh)[ends.reshape(-1, 2)[chosen]].astype(float)
    return np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum()


def test_edges_keep_what_they_are(scene):
    ground = coarse_ground(scene)
    dress(ground)
    fine = refined(ground).data
    for of in (
        lambda mesh: [edge.use_seam for edge in mesh.edges],
        lambda mesh: [edge.use_edge_sharp for edge in mesh.edges],
        lambda mesh: [item.value for item in mesh.attributes["marked"].data],
    ):
        before, after = edge_lengths(ground.data, np.array(of(ground.data))), edge_lengths(fine, np.array(of(fine)))
        assert after == pytest.approx(before, rel=1e-6)


def test_vertex_groups_and_choices_come_along(scene):
    ground = coarse_ground(scene)
    dress(ground)
    detail = refined(ground)
    assert [group.name for group in detail.vertex_groups] == ["grass"]
    for mesh, thing in ((ground.data, ground), (detail.data, detail)):
        weights = mesh.attributes.new("weights", "FLOAT", "POINT")
        weights.data.foreach_set("value", [thing.vertex_groups[0].weight(k) for k in range(len(mesh.vertices))])
    in_source, in_target = sample_in_source(ground.data, detail.data, "weights")
    np.testing.assert_allclose(in_target, in_source, atol=2e-6)
    assert [layer.name for layer in detail.data.uv_layers if layer.active_render] == ["Second"]
    assert [material.name for material in detail.data.materials] == ["Snow", "Rock"]
    smooth = [polygon.use_smooth for polygon in detail.data.polygons]
    assert any(smooth)
    assert not all(smooth)


def test_the_mesh_is_valid_and_its_original_vertices_are_untouched(scene):
    ground = coarse_ground(scene)
    detail = refined(ground)
    mesh = detail.data
    assert not mesh.validate(verbose=True), "Blender had to correct the mesh"
    count = len(ground.data.vertices)
    np.testing.assert_array_equal(points(mesh)[:count], points(ground.data))
    uses = np.zeros(len(mesh.edges), dtype=int)
    np.add.at(uses, [loop.edge_index for loop in mesh.loops], 1)
    assert set(uses) == {1, 2}
    border = edge_lengths(mesh, uses == 1)
    assert border == pytest.approx(edge_lengths(ground.data, np.array(border_of(ground.data))), rel=1e-6)


def border_of(mesh):
    uses = np.zeros(len(mesh.edges), dtype=int)
    np.add.at(uses, [loop.edge_index for loop in mesh.loops], 1)
    return uses == 1


def is_corner(mesh):
    uses = np.zeros(len(mesh.vertices), dtype=int)
    np.add.at(uses, [loop.vertex_index for loop in mesh.loops], 1)
    return uses == 1


def test_the_surface_between_vertices_is_the_evaluated_one(scene):
    ground = coarse_ground(scene)
    modifier = ground.modifiers.new("Smooth", "SUBSURF")
    modifier.levels = 2
    bpy.context.view_layer.update()
    evaluated = ground.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    shown = bpy.data.meshes.new_from_object(ground.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    assert len(evaluated.vertices) == len(shown.vertices)
    detail = refined(ground)
    assert not detail.modifiers
    in_source, in_target = sample_in_source(shown, detail.data, "position")
    assert np.abs(in_target - in_source).max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("and_then", ["", "DISPLACE", "ROUNDED"])
def test_beside_the_trail_a_ground_is_subdivided_no_more_often_than_its_shape_needs(scene, and_then):
    ground = coarse_ground(scene)
    if and_then != "ROUNDED":
        creases = ground.data.attributes.new("crease_edge", "FLOAT", "EDGE")
        creases.data.foreach_set("value", border_of(ground.data).astype(np.float32))
        corners = ground.data.attributes.new("crease_vert", "FLOAT", "POINT")
        corners.data.foreach_set("value", is_corner(ground.data).astype(np.float32))
    ground.modifiers.new("Smooth", "SUBSURF").levels = 6
    if and_then == "DISPLACE":
        ground.modifiers.new("Rough", and_then).strength = 0.0
    seen = ground_surface.undisturbed_surface(ground, 1.0)
    surface, level = trail_detail.coarsest(name_of(ground), seen, 1.0, 0.02)
    assert level == (0 if and_then else 4)  # quads of 6 cm on a curve of 17 m leave it by 0.03 mm, of 12 cm by 0.12
    if not and_then:
        assert trail_detail.coarsest(name_of(ground), seen, 1.0, 1e-3)[1] in {5, 0}, "finer cells ask for more"
    with ExitStack() as drafts:
        draft = trail_detail.draft(drafts, ground, surface, refine(surface, region(), 0.02), level)
        detail = trail_detail.publish(ground, resolve(draft))
    assert ground.modifiers["Smooth"].levels == 6
    assert (len(detail.data.vertices) < len(seen.surface_vertices) / 6) == (not and_then)
    detail.data.calc_loop_triangles()
    corners = np.array([triangle.vertices for triangle in detail.data.loop_triangles])
    shown = MeshTerrain.from_mesh(points(detail.data).astype(float), corners)
    x, y, z = seen.surface_vertices.T
    off = np.abs(shown.heights(x, y) - z)
    assert np.isnan(off).mean() < 0.01  # along the outline, by rounding
    assert np.nanmax(off) < trail_detail.FLOOR
    outline = seen.surface_vertices[:, :2]
    for end in (np.min, np.max):
        np.testing.assert_allclose(end(points(detail.data)[:, :2], axis=0), end(outline, axis=0), atol=1e-4)
    diagonal = (points(detail.data)[:, :2].astype(float) @ (1.0, 1.0)).max()
    assert diagonal == pytest.approx((outline @ (1.0, 1.0)).max(), abs=1e-4), "its corners are as round"


def test_loose_edges_and_vertices_stay(scene):
    ground = coarse_ground(scene)
    mesh = ground.data
    count = len(mesh.vertices)
    mesh.vertices.add(3)
    mesh.vertices.foreach_set("co", np.concatenate([points(mesh)[:count].ravel(), np.arange(9)]).astype(np.float32))
    mesh.edges.add(1)
    mesh.edges[-1].vertices = (count, count + 1)
    mesh.update()
    fine = refined(ground).data
    assert any(tuple(sorted(edge.vertices)) == (count, count + 1) for edge in fine.edges)
    np.testing.assert_array_equal(points(fine)[: count + 3], points(mesh))


def test_the_original_is_hidden_and_comes_back(scene):
    ground = coarse_ground(scene)
    dress(ground)
    ground.hide_render = True
    collection = bpy.data.collections.new("Set")
    scene.collection.children.link(collection)
    collection.objects.link(ground)
    before = fingerprints.of_file()
    detail = refined(ground)
    assert (ground.hide_viewport, ground.hide_render) == (True, True)
    assert (detail.hide_viewport, detail.hide_render) == (False, True)
    assert set(detail.users_collection) == set(ground.users_collection)
    assert trail_detail.detail_of(ground) == detail
    trail_detail.remove(ground)
    assert fingerprints.of_file() == before


@pytest.mark.parametrize("selected", [True, False])
@pytest.mark.parametrize("active", [True, False])
def test_the_copy_is_selected_and_active_as_the_ground_was_and_gives_it_back(scene, selected, active):
    ground = coarse_ground(scene)
    other = bpy.data.objects.new("Other", None)
    scene.collection.objects.link(other)
    layers = scene.view_layers[0], scene.view_layers.new("Second")
    for layer in layers:
        layer.update()
    ground.select_set(selected, view_layer=layers[0])
    ground.select_set(not selected, view_layer=layers[1])
    layers[0].objects.active = ground if active else other

    def state(thing):
        return [(thing.select_get(view_layer=layer), layer.objects.active == thing) for layer in layers]

    before = state(ground)
    detail = refined(ground)
    assert state(detail) == before
    assert refined(ground, 0.04, region(0.04)) == detail
    assert state(detail) == before
    trail_detail.remove(ground)
    for layer in layers:
        layer.update()
    assert state(ground) == before


def test_a_bake_on_a_fine_copy_and_its_end_leave_selection_and_active_object(scene):
    walker(scene, frames=48)
    bpy.ops.softground.add_character()
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    ground = scene.softground.ground = bpy.context.object
    scene.objects["Walker"].select_set(True)
    chosen = set(bpy.context.selected_objects)
    bpy.ops.softground.bake()
    copy = trail_detail.detail_of(ground)
    assert bpy.context.active_object == copy
    assert set(bpy.context.selected_objects) == chosen - {ground} | {copy}
    bpy.ops.softground.clear_bake()
    bpy.context.view_layer.update()
    assert bpy.context.active_object == ground
    assert set(bpy.context.selected_objects) == chosen


def test_another_trail_reuses_the_copy(scene):
    ground = coarse_ground(scene)
    detail = refined(ground)
    bevel = detail.modifiers.new("Mine", "BEVEL")
    mine = [bpy.data.materials.new(name) for name in ("Ice", "Slush")]
    for material in mine:
        detail.data.materials.append(material)
    first = len(detail.data.vertices)
    again = refined(ground, 0.04, region(0.04))
    assert again == detail
    assert bevel.name in detail.modifiers
    assert list(detail.data.materials) == mine
    assert len(detail.data.vertices) < first
    assert [mesh.name for mesh in bpy.data.meshes] == ["Field", "Field Trail"]
    assert (ground.hide_viewport, ground.hide_render) == (True, True)


@pytest.mark.parametrize("renamed", [False, True])
def test_a_duplicate_of_the_copy_is_not_taken_for_it(scene, renamed):
    ground = coarse_ground(scene)
    detail = refined(ground)
    if renamed:
        detail.name = "Hero"
    duplicate = detail.copy()
    duplicate.data = detail.data.copy()
    duplicate.name = "A Look of My Own"
    scene.collection.objects.link(duplicate)
    assert trail_detail.detail_of(ground) == detail
    trail_detail.remove(ground)
    assert duplicate.name in scene.objects
    assert trail_detail.detail_of(ground) is None


def test_a_second_bake_on_the_fine_copy_plays_like_the_first(scene):
    walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    field = scene.softground.ground = grounds.plane(scene, vertices=2)
    bpy.context.view_layer.update()

    def played(frame):
        scene.frame_set(frame)
        shown = trail_detail.detail_of(field).evaluated_get(bpy.context.evaluated_depsgraph_get())
        return points(shown.data)[:, 2]

    bpy.ops.softground.bake()
    first = {frame: played(frame) for frame in (1, 15, 30)}
    bpy.ops.softground.bake()
    assert np.ptp(first[1]) < 1e-6
    assert np.ptp(first[30]) > 0.02
    assert all(np.array_equal(played(frame), heights) for frame, heights in first.items())


def test_a_transformed_ground_is_cut_where_the_trail_is_in_the_world(scene):
    ground = coarse_ground(scene, count=6)
    ground.location, ground.rotation_euler, ground.scale = (1.0, -0.5, 0.2), (0.0, 0.0, 0.8), (2.0, 0.5, 1.0)
    bpy.context.view_layer.update()
    detail = refined(ground)
    matrix = np.array(ground.matrix_world)
    world = points(detail.data) @ matrix[:3, :3].T + matrix[:3, 3]
    new = world[len(ground.data.vertices) :, :2]
    near = (new > [-0.6, -0.4]).all(axis=1) & (new < [1.2, 0.6]).all(axis=1)
    assert near.mean() > 0.9
    assert ground_surface.undisturbed_surface(detail, 1.0).vertices == pytest.approx(world, abs=1e-6)
