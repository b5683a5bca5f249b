"""Displacement and masks under weather: those of the mesh that Blender shows at the same frame."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat, jobs, settings
from softground_addon.blender.baking import bake_job
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.mesh_arrays import positions
from softground_addon.blender.output import image_exports
from softground_addon.blender.playback import weather_modifier
from softground_addon.blender.playback import weather_nodes as nodes
from softground_addon.core.errors import InputError
from tests.blender import weathered_shots
from tests.blender.grounds import plane
from tests.blender.images import read_image
from tests.tiers import slow_but_one

SIDE = 128
"""Vertices and pixels along a side: a power of two, so that both lie at the same places to the last bit."""
KINDS = ("displacement", "mask", "weather")


@pytest.fixture(scope="module")
def baked(addon, tmp_path_factory):
    """A baked plane of whose UV map each vertex has a pixel of its own."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    weathered_shots.added_walker(scene)
    ground = scene.softground.ground = plane(scene, vertices=SIDE)
    layer = ground.data.uv_layers.new(name="UVMap")
    row, column = np.divmod([loop.vertex_index for loop in ground.data.loops], SIDE)
    layer.uv.foreach_set("vector", ((np.stack([column, row], axis=-1) + 0.5) / SIDE).astype(np.float32).ravel())
    bpy.context.view_layer.update()
    jobs.run(bake_job.bake(scene))
    path = tmp_path_factory.mktemp("images") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def opened(baked, tmp_path, monkeypatch):
    """Opens a bake on snow, with weather that may take it for another surface."""

    def open_(surface, **values):
        scene = weathered_shots.opened_as(surface, baked, tmp_path, monkeypatch)
        bpy.ops.softground.add_weather()
        modifier = weather_modifier.modifier_of(baked_ground.display_mesh_of(scene.softground.ground))
        for name, identifier in weather_modifier.inputs_of(modifier).items():
            if name in values:
                compat.write_input(modifier, identifier, values[name])
        modifier.id_data.update_tag()
        return scene

    return open_


def shown(scene, frame):
    """What Blender shows of the plane's own vertices at a frame: heights, and attributes by name."""
    scene.frame_set(frame)
    display_mesh = baked_ground.display_mesh_of(scene.softground.ground)
    mesh = display_mesh.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    attributes = {}
    for attribute in mesh.attributes:
        if attribute.domain == "POINT" and attribute.data_type == "FLOAT":
            values = np.empty(len(attribute.data), dtype=np.float32)
            attribute.data.foreach_get("value", values)
            attributes[attribute.name] = values[: SIDE**2].reshape(SIDE, SIDE)
    places = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", places)
    return places.reshape(-1, 3)[: SIDE**2, 2].reshape(SIDE, SIDE), attributes


def write(scene, folder, frame, resolution=SIDE):
    ground = scene.softground.ground
    paths = image_exports.export_images(
        ground, folder, frame, frame, units=settings.units_of(scene), resolution=resolution
    )
    return {path.stem.split("_")[1]: read_image(path)[..., :3] for path in paths}


@pytest.mark.slow
@pytest.mark.parametrize("surface", slow_but_one(["snow", "sand", "mud"]))
@pytest.mark.parametrize(("frame", "wind"), slow_but_one([(20, 8.0), (300, 0.0)]))  # which would have filled all prints
def test_images_are_those_of_the_evaluated_mesh(opened, tmp_path, surface, frame, wind):
    scene = opened(surface, **weathered_shots.SOME | {"Wind": wind})
    height, attributes = shown(scene, frame)
    scene.frame_set(7)
    images = write(scene, tmp_path, frame)
    assert tuple(images) == KINDS == image_exports.kinds_of(scene.softground.ground)
    assert scene.frame_current == 7
    none = np.zeros_like(height)
    seen = {
        "displacement": [height] * 3,
        "mask": [attributes[f"softground_{name}"] for name in ("compression", "rim", "age")],
        "weather": [attributes.get(name, none) for name in (nodes.WETNESS, nodes.FRESH, nodes.WATER)],
    }
    assert np.ptp(height) > 1e-3
    for kind, channels in seen.items():
        for number, values in enumerate(channels):
            np.testing.assert_allclose(images[kind][..., number], values, rtol=1e-5, atol=2e-6, err_msg=kind)


@pytest.mark.slow
def test_images_of_a_ground_with_regions_have_the_weather_of_each(opened, tmp_path, monkeypatch):
    scene = opened("snow", **weathered_shots.SOME)
    monkeypatch.undo()  # each surface is what it is
    mesh = scene.softground.ground.data
    for name, preset in (("White", ""), ("Brown", "mud"), ("Grey", "none")):
        mesh.materials.append(bpy.data.materials.new(name))
        mesh.materials[-1].softground_preset = preset
    y = np.array([face.center.y for face in mesh.polygons])
    borders = (-0.4, -1.4)
    mesh.polygons.foreach_set("material_index", np.searchsorted(-np.array(borders), -y).astype(np.int32))
    mesh.update()
    scene.softground.detail = "NEVER"
    jobs.run(bake_job.bake(scene))
    height, attributes = shown(scene, 30)
    images = write(scene, tmp_path, 30)
    places = positions(mesh)[: SIDE**2, 1].reshape(SIDE, SIDE)
    inside = np.all([np.abs(places - border) > 0.1 for border in borders], axis=0)
    for name, values, image in (
        ("height", height, images["displacement"][..., 0]),
        ("wetness", attributes[nodes.WETNESS], images["weather"][..., 0]),
        ("fresh", attributes[nodes.FRESH], images["weather"][..., 1]),
        ("water", attributes[nodes.WATER], images["weather"][..., 2]),
    ):
        np.testing.assert_allclose(image[inside], values[inside], rtol=1e-5, atol=2e-6, err_msg=name)
    water, in_mud = attributes[nodes.WATER], (places < borders[0]) & (places > borders[1])
    assert water[in_mud].max() > 1e-3
    assert not water[inside & ~in_mud].any()


@pytest.mark.slow
def test_the_images_of_a_linked_ground_have_its_water(opened, tmp_path):
    scene = opened("mud", **weathered_shots.SOME)
    (tmp_path / "own").mkdir()
    weathered = write(scene, tmp_path / "own", 30)
    library, name = tmp_path / "library.blend", scene.softground.ground.name
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(library), link=True) as (_, linked):
        linked.objects = [name]
    scene = bpy.context.scene
    scene.collection.objects.link(linked.objects[0])
    scene.softground.ground = linked.objects[0]
    (tmp_path / "linked").mkdir()
    of_linked = write(scene, tmp_path / "linked", 30)
    assert weathered["weather"][..., 2].max() > 1e-3
    for kind in KINDS:
        np.testing.assert_allclose(of_linked[kind], weathered[kind], atol=1e-6)


@pytest.mark.slow
def test_keyed_weather_and_remapped_time_are_those_of_the_scene(opened, tmp_path):
    scene = opened("snow", **{"Time Scale": 900.0, "Temperature": -5.0})
    display_mesh = baked_ground.display_mesh_of(scene.softground.ground)
    modifier = weather_modifier.modifier_of(display_mesh)
    identifier = weather_modifier.inputs_of(modifier)["Snowfall"]
    for frame, value in ((1, 0.0), (300, 5.0)):
        compat.write_input(modifier, identifier, value)
        display_mesh.keyframe_insert(compat.input_path(modifier, identifier), frame=frame)
    display_mesh.animation_data.action.update_tag()
    scene.render.frame_map_old, scene.render.frame_map_new = 100, 150
    bpy.context.view_layer.update()
    height, _ = shown(scene, 200)
    assert height.max() > 0.01
    np.testing.assert_allclose(write(scene, tmp_path, 200)["displacement"][..., 0], height, atol=1e-6)


@pytest.mark.slow
def test_hidden_weather_and_none_write_the_bake_alone(opened, tmp_path):
    scene = opened("snow", **weathered_shots.SOME)
    ground = scene.softground.ground
    weather_modifier.modifier_of(baked_ground.display_mesh_of(ground)).show_viewport = False
    hidden = write(scene, tmp_path, 30)
    bpy.ops.softground.remove_weather()
    none = write(scene, tmp_path, 30)
    assert tuple(hidden) == tuple(none) == KINDS[:2] == image_exports.kinds_of(ground)
    for kind in KINDS[:2]:
        np.testing.assert_array_equal(hidden[kind], none[kind])


@pytest.mark.slow
def test_an_export_leaves_nothing_behind(opened, tmp_path):
    scene = opened("mud", **weathered_shots.SOME)

    def existing():
        return {kind: {each.name for each in getattr(bpy.data, kind)} for kind in ("meshes", "objects", "scenes")}

    before = existing()
    image_exports.export_images(
        scene.softground.ground, tmp_path, 30, 31, units=settings.units_of(scene), resolution=32
    )
    assert existing() == before
    assert len(list(tmp_path.glob("*_weather_*.exr"))) == 2


@pytest.mark.slow
@pytest.mark.parametrize("damage", [{"material": None}, {"time_stretch": 10**400}, {"frame_rate": 0.0}])
def test_a_bake_whose_inputs_are_damaged_is_named(opened, tmp_path, monkeypatch, damage):
    scene = opened("snow", Snowfall=2.0)
    footprints, about = baked_ground.load(scene.softground.ground)
    forged = footprints, about | {"inputs": about["inputs"] | damage}
    monkeypatch.setattr(baked_ground, "load", lambda _: forged)
    with pytest.raises(InputError, match=r"bake again"):
        write(scene, tmp_path, 20)
    assert not list(tmp_path.glob("*.exr"))
