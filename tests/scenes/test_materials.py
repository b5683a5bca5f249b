"""The grounds' render materials: built on this Blender, driven by the attributes of a bake, the user's left alone."""

import numpy as np
import pytest

from softground_addon.core.errors import InputError
from softground_addon.core.ground.surfaces import SURFACES


@pytest.fixture
def ensure_material(scene):
    from softground_addon.blender.materials.materials import ensure_material

    return ensure_material


def upstream(socket):
    """Nodes that an input depends on."""
    kinds = set()
    waiting = [link.from_node for link in socket.links]
    while waiting:
        node = waiting.pop()
        if node not in kinds:
            kinds.add(node)
            waiting += [link.from_node for inlet in node.inputs for link in inlet.links]
    return kinds


def principled(material):
    return next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")


@pytest.mark.parametrize("surface", SURFACES)
def test_the_output_is_shaded_from_the_compression_of_the_bake(ensure_material, surface):
    shader = principled(ensure_material(surface))
    output = next(node for node in shader.id_data.nodes if node.type == "OUTPUT_MATERIAL")
    assert output.inputs["Surface"].links[0].from_node == shader
    for socket in (shader.inputs["Base Color"], output.inputs["Displacement"]):
        attributes = {node.attribute_name for node in upstream(socket) if node.type == "ATTRIBUTE"}
        assert "softground_compression" in attributes
    assert all(link.is_valid for link in shader.id_data.links)


@pytest.mark.parametrize("surface", SURFACES)
def test_textures_are_laid_out_in_the_world(ensure_material, surface):
    nodes = ensure_material(surface).node_tree.nodes
    for texture in (node for node in nodes if node.type in ("TEX_NOISE", "TEX_VORONOI")):
        assert any(node.type == "NEW_GEOMETRY" for node in upstream(texture.inputs["Vector"]))


@pytest.mark.parametrize("surface", SURFACES)
def test_open_ground_has_three_octaves_apart_and_none_of_them_repeats(ensure_material, surface):
    nodes = ensure_material(surface).node_tree.nodes
    assert not {node.type for node in nodes} & {"TEX_IMAGE", "TEX_WAVE", "TEX_CHECKER", "TEX_BRICK"}
    output = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
    relief = upstream(output.inputs["Displacement"]) | upstream(principled(ensure_material(surface)).inputs["Normal"])
    textures = [node for node in relief if node.type in ("TEX_NOISE", "TEX_VORONOI")]
    sizes = [1.0 / node.inputs["Scale"].default_value for node in textures]
    assert min(sizes) < 0.01  # seen at 0.3 m
    assert any(0.01 < size < 0.2 for size in sizes)  # at 2 m
    assert max(sizes) > 2.0  # at 20 m


@pytest.mark.parametrize("surface", SURFACES)
def test_what_is_wider_than_a_print_is_deep_varies_in_plan_alone_as_that_compiles_faster(ensure_material, surface):
    noises = [node for node in ensure_material(surface).node_tree.nodes if node.bl_idname == "ShaderNodeTexNoise"]
    assert {node.noise_dimensions for node in noises if node.inputs["Scale"].default_value < 9} == {"2D"}
    assert {node.noise_dimensions for node in noises if node.inputs["Scale"].default_value > 11} <= {"3D"}


@pytest.mark.parametrize("surface", ["sand", "soil"])
def test_what_rain_wets_shines_in_patches(ensure_material, surface):
    shader = principled(ensure_material(surface))
    for name in ("Roughness", "Specular IOR Level"):
        textures = [node for node in upstream(shader.inputs[name]) if node.type == "TEX_NOISE"]
        assert any(0.03 < 1.0 / node.inputs["Scale"].default_value < 0.3 for node in textures)


def test_only_dry_sand_has_ripples_and_prints_bury_them(ensure_material):
    for surface in SURFACES:
        nodes = ensure_material(surface).node_tree.nodes
        winds = [node for node in nodes if node.type == "VECT_MATH" and node.operation == "DOT_PRODUCT"]
        assert bool(winds) == (surface == "sand")


@pytest.mark.slow
def test_ripples_end_where_a_foot_was(spot, ensure_material):
    """Two pictures of the same pressed ground under other winds differ on open ground alone."""
    ground, seen = spot
    material = ensure_material("sand")
    ground.data.materials.append(material)
    before = seen()
    wind = next(
        node for node in material.node_tree.nodes if node.type == "VECT_MATH" and node.operation == "DOT_PRODUCT"
    )
    wind.inputs[1].default_value = (0.0, 1.0, 0.0)
    change = np.abs(seen() - before).mean(axis=(0, 2))
    assert change[:14].mean() > 0.004
    assert change[-10:].mean() < 0.25 * change[:14].mean()


@pytest.mark.slow
@pytest.mark.parametrize("surface", ["sand", "snow"])
def test_prints_that_wind_has_covered_look_like_open_ground(spot, ensure_material, surface):
    ground, seen = spot
    ground.data.materials.append(ensure_material(surface))
    pressed = seen()
    ground.data.attributes.new("softground_blown", "FLOAT", "POINT").data.foreach_set("value", np.ones(6))
    covered = seen()
    ground.data.attributes.remove(ground.data.attributes["softground_compression"])
    assert np.array_equal(covered, seen())
    assert np.abs(covered - pressed)[:, -16:].mean() > 0.01


def test_a_surface_has_one_material_however_often_it_is_asked_for(ensure_material):
    first = ensure_material("snow")
    first.node_tree.nodes.clear()  # the user is free to change it
    assert ensure_material("snow") == first
    assert not first.node_tree.nodes
    assert ensure_material("mud") != first


def test_a_users_material_of_the_same_name_is_left_alone(ensure_material):
    import bpy

    theirs = bpy.data.materials.new("SoftGround Snow")
    theirs.diffuse_color = (1, 0, 0, 1)
    ours = ensure_material("snow")
    assert ours != theirs
    assert tuple(theirs.diffuse_color) == (1, 0, 0, 1)


def test_an_unknown_surface_is_refused_with_the_known_ones(ensure_material):
    with pytest.raises(InputError, match="snow, sand, wet_sand, mud, soil"):
        ensure_material("lava")


def test_the_landscape_shows_snow_and_sand_by_what_is_painted(scene):
    from sample_scenes import landscape

    material = landscape.snow_to_sand()
    mix = next(node for node in material.node_tree.nodes if node.type == "MIX_SHADER")
    assert {link.from_node.type for inlet in mix.inputs[1:] for link in inlet.links} == {"BSDF_PRINCIPLED"}
    assert landscape.SAND in {node.attribute_name for node in upstream(mix.inputs[0]) if node.type == "ATTRIBUTE"}
    output = material.node_tree.get_output_node("ALL")
    assert output.inputs["Surface"].links[0].from_node == mix
    shaders = [link.from_node for inlet in mix.inputs[1:] for link in inlet.links]
    heights = upstream(output.inputs["Displacement"])
    assert len(set(shaders)) == 2
    assert {"ATTRIBUTE", "MIX"} <= {node.type for node in heights}


@pytest.fixture
def spot(scene, tmp_path):
    """Two faces, of which the right one is pressed, and what is seen of them from above."""
    import bpy

    bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=1, size=0.2)
    ground = bpy.context.object
    pressed = ground.data.attributes.new("softground_compression", "FLOAT", "POINT")
    pressed.data.foreach_set("value", [0.02 if vertex.co.x > 0.01 else 0.0 for vertex in ground.data.vertices])
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location.z = "ORTHO", 0.18, 1.0
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler.x = 3.0, 0.9
    for thing in (camera, sun):
        scene.collection.objects.link(thing)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 16
    scene.render.resolution_x = scene.render.resolution_y = 48
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = str(tmp_path / "spot.png")

    def seen():
        bpy.ops.render.render(write_still=True)
        picture = bpy.data.images.load(scene.render.filepath)
        pixels = np.empty(48 * 48 * 4, dtype=np.float32)
        picture.pixels.foreach_get(pixels)
        bpy.data.images.remove(picture)
        return pixels.reshape(48, 48, 4)[..., :3]

    return ground, seen


@pytest.fixture
def relief(spot):
    """What a material displaces [m], seen from above on a spot of 18 m."""
    ground, seen = spot
    ground.scale = (100.0, 100.0, 1.0)
    scene = ground.users_scene[0]
    scene.camera.data.ortho_scale, scene.view_settings.view_transform = 18.0, "Raw"

    def heights(material):
        ground.data.materials.append(material)
        tree = material.node_tree
        output = tree.get_output_node("ALL")
        height = output.inputs["Displacement"].links[0].from_node.inputs["Height"].links[0].from_socket
        shown = tree.nodes.new("ShaderNodeEmission")
        grey = tree.nodes.new("ShaderNodeMath")
        grey.operation, grey.inputs[1].default_value, grey.inputs[2].default_value = "MULTIPLY_ADD", 4.0, 0.5
        tree.links.new(height, grey.inputs[0])
        tree.links.new(grey.outputs[0], shown.inputs["Color"])
        tree.links.new(shown.outputs[0], output.inputs["Surface"])
        return (seen() - 0.5)[..., 0] / 4.0

    return heights


@pytest.mark.slow
@pytest.mark.parametrize("surface", SURFACES)
def test_pieces_have_the_colour_of_the_ground_that_they_are_of(spot, ensure_material, surface):
    """As light as its look on the average, between trodden and open."""
    ground, seen = spot
    ground.scale = (100.0, 100.0, 1.0)
    scene = ground.users_scene[0]
    scene.camera.data.ortho_scale, scene.view_settings.view_transform = 8.0, "Raw"
    material = ensure_material(surface)
    ground.data.materials.append(material)
    tree, shown = material.node_tree, material.node_tree.nodes.new("ShaderNodeEmission")
    tree.links.new(principled(material).inputs["Base Color"].links[0].from_socket, shown.inputs["Color"])
    tree.links.new(shown.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    luminance, light = np.array([0.2126, 0.7152, 0.0722]), []
    for compression in (0.02, 0.0):
        ground.data.attributes["softground_compression"].data.foreach_set("value", np.full(6, compression))
        light.append(seen().mean(axis=(0, 1)) @ luminance)
    assert 0.95 * light[0] < np.dot(SURFACES[surface].colour, luminance) < 1.1 * light[1]


@pytest.mark.parametrize("surface", SURFACES)
def test_what_is_displaced_is_low(relief, ensure_material, surface):
    """EEVEE draws stripes where the mesh bends, the stronger the higher the displacement stands from 0."""
    assert 0.001 < np.abs(relief(ensure_material(surface))).max() < 0.05


@pytest.mark.parametrize("surface", SURFACES)
def test_no_ridge_runs_along_the_edge_of_a_print(relief, ensure_material, surface):
    """What breaks the edge lies as much below as above the ground on both sides, or it is a hairline on the crest."""
    across = relief(ensure_material(surface)).mean(axis=0)
    open_ground, edge, print_floor = across[10:20].mean(), across[26:28].mean(), across[-10:].mean()
    assert edge < max(open_ground, print_floor) + 0.0008


@pytest.mark.parametrize(("tilt", "least", "most"), [(0, 0.03, 0.2), (70, 0.0, 0.015)], ids=["floor", "wall"])
def test_no_border_of_what_is_pressed_crosses_a_wall_of_snow(spot, ensure_material, tilt, least, most):
    """Relief sets walls beside where the sole pressed: two tones would meet half-way down."""
    ground, seen = spot
    ground.rotation_euler.x = np.radians(tilt)
    material = ensure_material("snow")
    ground.data.materials.append(material)
    tree, shown = material.node_tree, material.node_tree.nodes.new("ShaderNodeEmission")
    tree.links.new(principled(material).inputs["Base Color"].links[0].from_socket, shown.inputs["Color"])
    tree.links.new(shown.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    ground.users_scene[0].view_settings.view_transform = "Raw"
    across = seen()[20:28].mean(axis=(0, 2))
    assert least <= np.abs(across[4:20].mean() - across[-20:-4].mean()) < most


def test_glints_of_snow_mirror_the_sky(spot, ensure_material):
    """At a grazing angle, EEVEE draws a facet that mirrors the ground or looks away as a dark dot."""
    ground, seen = spot
    material = ensure_material("snow")
    ground.data.materials.append(material)
    scene, tree, coat = ground.users_scene[0], material.node_tree, principled(material).inputs
    scene.view_settings.view_transform = "Raw"
    scene.camera.location, scene.camera.rotation_euler.x = (0.0, -1.0, 0.2), 1.37
    scene.camera.data.ortho_scale = 0.03
    eye = tree.nodes.new("ShaderNodeNewGeometry").outputs["Incoming"]
    light = tree.nodes.new("ShaderNodeVectorMath")
    light.operation = "REFLECT"
    height = tree.nodes.new("ShaderNodeSeparateXYZ")
    dark = tree.nodes.new("ShaderNodeMath")
    dark.operation = "GREATER_THAN"
    dark.inputs[1].default_value = 0.1
    both = tree.nodes.new("ShaderNodeMath")
    both.operation = "MULTIPLY"
    shown = tree.nodes.new("ShaderNodeCombineXYZ")
    emission = tree.nodes.new("ShaderNodeEmission")
    for socket, into in (
        (eye, light.inputs[0]),
        (coat["Coat Normal"].links[0].from_socket, light.inputs[1]),
        (light.outputs[0], height.inputs[0]),
        (coat["Coat Weight"].links[0].from_socket, shown.inputs["X"]),
        (height.outputs["Z"], dark.inputs[0]),
        (dark.outputs[0], both.inputs[0]),
        (coat["Coat Weight"].links[0].from_socket, both.inputs[1]),
        (dark.outputs[0], shown.inputs["Y"]),
        (both.outputs[0], shown.inputs["Z"]),
        (shown.outputs[0], emission.inputs["Color"]),
        (emission.outputs[0], tree.get_output_node("ALL").inputs["Surface"]),
    ):
        tree.links.new(socket, into)
    glints, downward, dots = seen().max(axis=(0, 1))
    assert min(glints, downward) > 0.5
    assert dots < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("surface", SURFACES)
def test_a_pressed_spot_renders_differently_from_an_untouched_one(spot, ensure_material, surface):
    ground, seen = spot
    ground.data.materials.append(ensure_material(surface))
    rgb = seen()
    left, right = rgb[:, 4:16].mean(axis=(0, 1)), rgb[:, -16:-4].mean(axis=(0, 1))
    assert rgb.max() > 0.05
    assert rgb.mean(axis=(0, 1))[1] > 0.3 * rgb.mean(axis=(0, 1))[0]  # not the pink of a broken shader
    assert np.abs(left - right).max() > 0.01


@pytest.mark.slow
def test_what_lies_below_is_seen_where_little_of_a_thin_layer_is_left(spot, ensure_material):
    """On the right 6 to 15 mm are pressed: through a layer of 5 mm is earth, in one of 1 m or of no depth snow."""
    ground, seen = spot
    ground.data.materials.append(ensure_material("snow"))
    as_without = seen()
    layer = ground.data.attributes.new("softground_layer", "FLOAT", "POINT")
    pictures = {}
    for depth in (0.005, 1.0):
        layer.data.foreach_set("value", np.full(len(ground.data.vertices), depth, np.float32))
        ground.data.update()
        pictures[depth] = seen()
    left, right = (slice(None), slice(4, 16)), (slice(None), slice(-16, -4))
    assert pictures[1.0] == pytest.approx(as_without, abs=0.02)
    assert pictures[0.005][left] == pytest.approx(as_without[left], abs=0.02)
    earth = pictures[0.005][right].mean(axis=(0, 1))
    assert earth[2] < 0.5 * as_without[right].mean(axis=(0, 1))[2]
    assert earth[0] > 1.2 * earth[2]


@pytest.mark.slow
@pytest.mark.parametrize("surface", SURFACES)
def test_a_tread_is_seen_where_a_sole_has_pressed_and_not_before(spot, ensure_material, surface):
    ground, seen = spot
    ground.data.materials.append(ensure_material(surface))
    without = seen()
    marks = ground.data.attributes.new("softground_sole", "FLOAT_VECTOR", "POINT")
    places = [(vertex.co.y, 0.0, 0.004) for vertex in ground.data.vertices]
    marks.data.foreach_set("vector", np.ravel(places))
    change = np.abs(seen() - without).mean(axis=(0, 2))
    assert change[-16:].mean() > 0.01
    assert change[:20].mean() < 0.2 * change[-16:].mean()  # light below the snow's surface goes astray
