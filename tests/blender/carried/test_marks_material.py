"""The material of marks in a render: it ages them by the law of `core.carried.ageing`, from the clock of the nodes."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat
from softground_addon.blender.carried import marks_material
from softground_addon.blender.carried import marks_nodes as nodes
from softground_addon.blender.nodes.shader_graph import Graph
from softground_addon.core.carried.ageing import aged
from softground_addon.core.ground import surfaces

BIRTHS, MASSES = (0.0, 30.0, 59.0), (0.01, 0.1, 0.3)
FRAME, SECONDS = 60.0, 600.0 / 24.0
"""Frame of the render, and time by which marks age in a frame."""


def squares(count):
    """A row of squares, each with vertices of its own."""
    corner = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])
    places = np.concatenate([corner + np.array((number, 0.0, 0.0)) for number in range(count)])
    mesh = bpy.data.meshes.new("Squares")
    mesh.from_pydata(places.tolist(), [], np.arange(4 * count).reshape(-1, 4).tolist())
    obj = bpy.data.objects.new("Squares", mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def store(mesh, name, domain, kind, values):
    attribute = mesh.attributes.new(name, kind, domain)
    attribute.data.foreach_set("value" if kind == "FLOAT" else "vector", np.ravel(values).astype(np.float32))


def rendered(count, path):
    """Colours of the middles of squares in a row, (count, 3)."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.data.type, camera.data.ortho_scale = (count / 2, 0.5, 2.0), "ORTHO", count
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 1, False, 0
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 4 * count, 4, 100
    scene.render.filepath, scene.render.image_settings.file_format = str(path), "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels[:], np.float32).reshape(4, 4 * count, 4)
    return pixels[2, 2::4, :3]


@pytest.mark.parametrize(("kind", "rain"), [("mud", 0.0), ("mud", 0.3), ("snow", 0.0)])
def test_the_material_ages_marks_as_the_law_does(addon, tmp_path, kind, rain):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    surface, drying, warmth = surfaces.sticking(kind), 0.5, 4.0
    birth, mass = (values.ravel() for values in np.meshgrid(BIRTHS, MASSES))
    obj = squares(len(birth))
    mesh = obj.data
    for name, values in ((nodes.BIRTH, birth), (nodes.MASS, mass)):
        store(mesh, name, "POINT", "FLOAT", np.repeat(values, 4))
    clock = np.tile((FRAME, drying * SECONDS, rain * SECONDS), (len(birth), 1))
    store(mesh, nodes.CLOCK, "FACE", "FLOAT_VECTOR", clock)
    store(mesh, nodes.WARMTH, "FACE", "FLOAT", np.full(len(birth), warmth * SECONDS))
    material = bpy.data.materials.new("Aged")
    tree = compat.shader_tree(material)
    tree.nodes.clear()
    graph = Graph(tree)
    now = marks_material.now_by_clock(graph, surface)
    colour = graph.node("ShaderNodeCombineXYZ", {0: now.wetness, 1: now.mass, 2: now.melted})
    light = graph.node("ShaderNodeEmission", {0: graph.out(colour)})
    graph.node("ShaderNodeOutputMaterial", {"Surface": graph.out(light)})
    mesh.materials.append(material)
    law = aged(mass, (FRAME - birth) * SECONDS, surface, drying, rain, warmth)
    expected = np.stack([law.wetness, law.mass, np.broadcast_to(law.melted, mass.shape)], axis=-1)
    assert np.ptp(expected[:, 0]) > 0.1
    assert rendered(len(birth), tmp_path / "aged.exr") == pytest.approx(expected, abs=2e-3)
