"""Grounds to bake on in tests, and what a bake has made of them."""

import bpy
import numpy as np

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from softground_addon.blender.ground import baked_ground, ground_mesh


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


def steps_on(ground):
    """The steps of a ground's bake that left a print."""
    return [step for step in baked_ground.record_of(ground).steps if step.footprint]


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


def field(scene, vertices=4, **values):
    """A ground of a user's, coarse by default, that is the scene's."""
    ground = scene.softground.ground = plane(scene, vertices=vertices, **values)
    bpy.context.view_layer.objects.active = ground
    bpy.context.view_layer.update()
    return ground


def as_rendered(ground):
    """World positions of the ground's evaluated mesh, (V, 3), at the scene's frame."""
    shown = ground.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = np.empty(len(shown.data.vertices) * 3, dtype=np.float32)
    shown.data.vertices.foreach_get("co", points)
    matrix = np.array(shown.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def node_group():
    """An empty group of geometry nodes, with its input and output."""
    tree = bpy.data.node_groups.new("Theirs", "GeometryNodeTree")
    tree.is_modifier = True
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    return tree, tree.nodes.new("NodeGroupInput").outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0]


def mover(scene, name="Lift"):
    """An empty that goes up."""
    empty = bpy.data.objects.new(name, None)
    scene.collection.objects.link(empty)
    for frame, height in ((1, 0.0), (30, 1.0)):
        empty.location.z = height
        empty.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    return empty


def refusal(operator):
    """What an operator that refuses says."""
    said = ""
    try:
        operator()
    except RuntimeError as error:
        said = str(error)
    assert said, "nothing was refused"
    assert "Traceback" not in said
    return said
