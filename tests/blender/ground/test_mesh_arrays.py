"""What is read of meshes in bulk is what Blender says of them element by element."""

from itertools import pairwise

import bpy
import numpy as np
import pytest

from softground_addon.blender import mesh_arrays

CONVEX = [(0, 0), (1, 0), (1, 1), (0, 1)]
INWARD = {0: (0.7, 0.7), 1: (0.3, 0.7), 2: (0.3, 0.3), 3: (0.7, 0.3)}
"""Where a corner lies that makes the square a dart."""


def faces_of(kind, generator):
    if kind == "dart":
        corner = int(generator.integers(4))
        outline = [INWARD[corner] if place == corner else point for place, point in enumerate(CONVEX)]
    elif kind == "triangle":
        outline = CONVEX[:3]
    elif kind == "polygon":
        angles = np.linspace(0, 2 * np.pi, 7)[:-1]
        outline = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    else:
        outline = CONVEX
    points = np.column_stack([outline, np.zeros(len(outline))])
    if kind == "bent":
        points[:, 2] = generator.normal(0, 0.1, len(points))
    turn, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    return points @ turn.T + generator.normal(size=3)


def mesh_of(kinds, seed=1):
    generator = np.random.default_rng(seed)
    faces = [faces_of(kind, generator) for kind in kinds]
    first = np.cumsum([0, *map(len, faces)])
    mesh = bpy.data.meshes.new("Faces")
    mesh.from_pydata(np.concatenate(faces), [], [range(a, b) for a, b in pairwise(first)])
    return mesh


def as_blender_says(mesh):
    mesh.calc_loop_triangles()
    triangles = mesh.loop_triangles
    return [tuple(triangle.loops) for triangle in triangles], [triangle.polygon_index for triangle in triangles]


@pytest.mark.parametrize(
    "kinds",
    [
        ["square"] * 5,
        ["triangle"] * 3,
        ["dart"] * 40,
        ["bent"] * 40,
        ["triangle", "square", "dart", "dart", "triangle", "bent"] * 5,
        ["square", "polygon", "triangle", "dart"],
    ],
    ids=["squares", "triangles", "darts", "bent", "mixed", "polygons"],
)
def test_triangles_are_blender_s_own(scene, kinds):
    mesh = mesh_of(kinds)
    faces = mesh_arrays.read_faces(mesh)
    corners = mesh_arrays.triangle_corners(faces)
    assert (list(map(tuple, corners.tolist())), faces.triangle_face.tolist()) == as_blender_says(mesh)
    vertices = np.array([tuple(triangle.vertices) for triangle in mesh.loop_triangles])
    assert (mesh_arrays.triangles(mesh) == vertices).all()


def test_positions_and_corners_are_those_of_the_elements(scene):
    mesh = mesh_of(["square", "triangle", "polygon"])
    assert mesh_arrays.positions(mesh).tolist() == [list(vertex.co) for vertex in mesh.vertices]
    assert mesh_arrays.corner_vertices(mesh).tolist() == [loop.vertex_index for loop in mesh.loops]


def test_a_mesh_of_nothing_has_none_of_them(scene):
    mesh = bpy.data.meshes.new("Nothing")
    assert mesh_arrays.positions(mesh).shape == (0, 3)
    assert mesh_arrays.triangles(mesh).shape == (0, 3)
