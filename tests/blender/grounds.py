"""Grounds to bake on in tests, and what a bake has made of them."""

import bpy
import numpy as np

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from softground_addon.blender.ground import ground_mesh


def heights(ground, key="Basis"):
    """World positions (V, 3) of the ground in one of its shapes."""
    mesh = ground.data
    points = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    (mesh.shape_keys.key_blocks[key].points if mesh.shape_keys else mesh.vertices).foreach_get("co", points)
    matrix = np.array(ground.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def rest(ground):
    points = np.empty(len(ground.data.vertices) * 3, dtype=np.float32)
    ground.data.attributes[ground_mesh.REST].data.foreach_get("vector", points)
    matrix = np.array(ground.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def bake(scene, **values):
    for name, value in values.items():
        setattr(scene.softground, name, value)
    return jobs.run(bake_job.bake(scene))


def plane(scene, size=7.0, vertices=240, height=lambda x, y: 0.0 * x):
    """The user's own ground: a grid of their making, larger than the walk."""
    axis = np.linspace(-size / 2, size / 2, vertices)
    x, y = np.meshgrid(axis, axis)
    points = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    corner = (np.arange(vertices - 1)[:, None] * vertices + np.arange(vertices - 1)).ravel()
    mesh = bpy.data.meshes.new("Field")
    mesh.from_pydata(points, [], (corner[:, None] + [0, 1, vertices + 1, vertices]).tolist())
    ground = bpy.data.objects.new("Field", mesh)
    scene.collection.objects.link(ground)
    return ground
