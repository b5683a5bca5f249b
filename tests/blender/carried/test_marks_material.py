"""The material of marks in a render: it ages them by the law of `core.carried.ageing`, from the clock of the nodes."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat
from softground_addon.blender.carried import marks_material
from softground_addon.blender.carried import marks_nodes as nodes
from softground_addon.blender.materials import materials
from softground_addon.blender.nodes.shader_graph import Graph
from softground_addon.blender.playback.playback_nodes import COMPRESSION
from softground_addon.blender.playback.weather_nodes import DRIED
from softground_addon.core.carried.ageing import aged
from softground_addon.core.ground import surfaces

BIRTHS, MASSES = (0.0, 30.0, 59.0), (0.01, 0.1, 0.3)
LUMINANCE = np.array((0.2126, 0.7152, 0.0722))
FRAME, SECONDS = 60.0, 600.0 / 24.0
"""Frame of the render, and time by which marks age in a frame."""


def squares(count, size=1.0):
    """A row of squares, each with vertices of its own."""
    corner = size * np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])
    places = np.concatenate([corner + np.array((number * size, 0.0, 0.0)) for number in range(count)])
    mesh = bpy.data.meshes.new("Squares")
    mesh.from_pydata(places.tolist(), [], np.arange(4 * count).reshape(-1, 4).tolist())
    obj = bpy.data.objects.new("Squares", mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def store(mesh, name, domain, kind, values):
    attribute = mesh.attributes.new(name, kind, domain)
    attribute.data.foreach_set("value" if kind == "FLOAT" else "vector", np.ravel(values).astype(np.float32))


def shown(material, name):
    """Have a material show an input of its shader as light."""
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    light = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(shader.inputs[name].links[0].from_socket, light.inputs["Color"])
    tree.links.new(light.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    return material


def rendered(count, path, across=4, size=1.0):
    """Colours of squares in a row, (across, across·count, 3)."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.data.type = (count * size / 2, size / 2, 2.0), "ORTHO"
    camera.data.ortho_scale = count * size
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 1, False, 0
    scene.render.resolution_x, scene.render.resolution_y = across * count, across
    scene.render.resolution_percentage = 100
    scene.render.filepath, scene.render.image_settings.file_format = str(path), "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    return np.array(image.pixels[:], np.float32).reshape(across, across * count, 4)[..., :3]


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
    assert rendered(len(birth), tmp_path / "aged.exr")[2, 2::4] == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("dried", [0.0, 1.0], ids=["wet", "dried"])
@pytest.mark.parametrize("kind", ["mud", "wet_sand"])
def test_marks_have_the_colour_of_the_ground_that_they_come_from(addon, tmp_path, kind, dried):
    """Between trodden and open ground, as light and of the same hue."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = squares(3, size=8.0).data  # open and trodden ground, and a mark
    surface = surfaces.sticking(kind)
    of_squares = {COMPRESSION: (0.0, 0.02, 0.0), DRIED: (dried, dried, 0.0), nodes.MASS: (0.0, 0.0, 4.0)}
    for name, values in of_squares.items():
        store(mesh, name, "POINT", "FLOAT", np.repeat(values, 4))
    store(mesh, nodes.SOLE, "POINT", "FLOAT_VECTOR", np.tile((0.1, 0.0, -1.0), (12, 1)))
    store(mesh, nodes.CLOCK, "FACE", "FLOAT_VECTOR", np.tile((1e6 * dried, 100.0, 0.0), (3, 1)))
    for material in (materials.ensure_material(kind), marks_material.material_for(surface)):
        mesh.materials.append(shown(material, "Base Color"))
    mesh.polygons[2].material_index = 1
    seen = rendered(3, tmp_path / "colours.exr", 64, size=8.0).reshape(64, 3, 64, 3).mean(axis=(0, 2))
    opened, trodden, mark = np.hstack([seen @ LUMINANCE[:, None], seen[:, 1:] / seen[:, :1]])
    assert (mark > 0.95 * np.minimum(opened, trodden)).all(), (opened, trodden, mark)
    assert (mark < 1.05 * np.maximum(opened, trodden)).all(), (opened, trodden, mark)


def test_a_boot_parts_heel_and_sole_and_a_wheel_does_not(addon, tmp_path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = squares(4).data
    for name, values in ((nodes.MASS, np.full(16, 1.0)), (nodes.TREAD, np.full(16, 0.004))):
        store(mesh, name, "POINT", "FLOAT", values)
    zone = mesh.attributes.new(nodes.ZONE, "INT8", "POINT")
    zone.data.foreach_set("value", np.repeat((0, 0, 1, 2), 4) + np.tile((0, 1, 1, 0), 4) * np.repeat((0, 1, 0, 0), 4))
    store(mesh, nodes.SOLE, "POINT", "FLOAT_VECTOR", np.tile((0.1, 0.0, -1.0), (16, 1)))
    store(mesh, nodes.CLOCK, "FACE", "FLOAT_VECTOR", np.zeros((4, 3)))
    mesh.materials.append(shown(marks_material.material_for(surfaces.sticking("mud")), "Alpha"))
    seen = rendered(4, tmp_path / "heel.exr", 64)[..., 0].mean(axis=0)
    heel, between, arch, ball = seen.reshape(4, 64)
    assert between[28:36].max() < 0.05
    assert heel.mean() > 0.5 < ball.mean()
    assert 0.2 * ball.mean() < arch.mean() < 0.9 * ball.mean()
