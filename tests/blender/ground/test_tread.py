"""The tread of shoes: marked on the mesh for the render material, taken off with the bake, absent unless asked for."""

import bpy
import numpy as np
import pytest

from sample_scenes.character import create_character
from sample_scenes.dog import Dog
from sample_scenes.four_legged import WALK, go_on_four_legs
from sample_scenes.keys import write_action
from softground_addon.blender import tread_images
from softground_addon.blender.baking import bake_report
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.playback import own_data
from softground_addon.blender.properties import setting_paths
from softground_addon.core.composers.relief_plan import asked_of
from softground_addon.core.errors import InputError
from tests.blender import shots
from tests.blender.grounds import bake, heights


@pytest.fixture
def ground(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    scene.softground.detail = "NEVER"
    scene.softground.tread = 0.002
    bake(scene)
    return scene.softground.ground


def vectors(mesh, name):
    values = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.attributes[name].data.foreach_get("vector", values)
    return values.reshape(-1, 3)


def numbers(mesh, name):
    values = np.empty(len(mesh.vertices), np.float32)
    mesh.attributes[name].data.foreach_get("value", values)
    return values


def test_prints_carry_the_place_under_the_sole_and_the_depth_of_the_tread(ground):
    mesh = ground.data
    marks, touched = vectors(mesh, own_data.SOLE), numbers(mesh, ground_mesh.AGE) >= 0
    assert marks[:, 2].max() == pytest.approx(0.002, rel=1e-6)
    assert (marks[~touched, 2] < 0.002).all()
    inside = marks[marks[:, 2] > 0.0019]
    assert np.abs(inside[:, 0]).max() < 0.30  # the length of the shoe
    assert np.ptp(inside[:, 0]) > 1.5 * np.ptp(inside[:, 1])


@pytest.mark.slow
def test_the_tread_goes_with_the_bake_and_where_it_is_not_asked_for(ground, scene):
    scene.softground.tread = 0.0
    bake(scene)
    assert own_data.SOLE not in ground.data.attributes
    scene.softground.tread = 0.002
    bake(scene)
    bpy.ops.softground.clear_bake()
    assert own_data.SOLE not in ground.data.attributes


@pytest.fixture
def prints_of_a_dog(scene):
    """It walks along -y, on feet and on limbs."""
    body = Dog()
    dog = create_character("Dog", body, scene.collection)
    write_action(dog, go_on_four_legs(body, WALK, 30, scene.render.fps), "Walk")
    bpy.context.view_layer.objects.active = dog
    scene.frame_end = 30
    bpy.ops.softground.add_character()
    scene.softground.tread = 0.002
    bake(scene, cell_size=0.02)
    footprints, _ = baked_ground.load(scene.softground.ground)
    assert {step.sole for step in footprints} == {"foot.L", "foot.R", "hand.L", "hand.R"}
    return footprints


@pytest.mark.slow
def test_a_dog_wears_no_shoes_whatever_the_bones_of_its_forelegs_are_called(prints_of_a_dog, scene):
    assert own_data.SOLE not in scene.softground.ground.data.attributes


@pytest.mark.slow
def test_prints_of_all_paws_head_where_their_toes_point(prints_of_a_dog):
    off = np.array([step.heading + np.pi / 2 for step in prints_of_a_dog])
    assert np.cos(off).min() > np.cos(np.radians(5.0))


@pytest.mark.slow
@pytest.mark.parametrize("pattern", ["BARE", "IMAGE", "SHOES"])
def test_soles_of_another_kind_are_not_shown_with_the_bars_of_shoes(ground, scene, pattern):
    scene.softground.tread_pattern = pattern
    bake(scene)
    assert own_data.SOLE not in ground.data.attributes


def picture(values, name="Sole"):
    """An image of grey values (rows, columns), the first row at the bottom."""
    rows, columns = values.shape
    image = bpy.data.images.new(name, columns, rows, float_buffer=True)
    paint(image, values)
    return image


def paint(image, values):
    pixels = np.ones((*values.shape, 4), np.float32)
    pixels[..., :3] = values[..., None]
    image.pixels.foreach_set(pixels.ravel())
    image.update()


@pytest.fixture
def shod(scene):
    """A walker whose soles have a pattern that shows from close by."""
    shots.walker(scene, frames=16)
    bpy.ops.softground.add_character()
    options = scene.softground
    options.relief, options.tread, options.material.surface = "CLOSE_UP", 0.003, "wet_sand"
    return scene


CHECKER = np.indices((6, 2)).sum(axis=0) % 2.0


def shown(scene):
    bake(scene, cell_size=0.01)
    return heights(baked_ground.display_mesh_of(scene.softground.ground), "SoftGround Display")


@pytest.mark.slow
def test_an_image_is_pressed_and_the_same_bytes_again_and_another_is_not_the_same(shod):
    options = shod.softground
    options.tread_pattern, options.tread_image = "IMAGE", picture(CHECKER)
    first = shown(shod)
    assert bake_report.stale_reasons(shod) == ()
    assert np.array_equal(first, shown(shod))
    paint(options.tread_image, 1.0 - CHECKER)
    bpy.context.view_layer.update()
    tread_images.forget()  # which the handler does, where images are painted in a window
    assert bake_report.stale_reasons(shod) == ("The settings have changed",)
    other = shown(shod)
    assert len(other) == len(first)
    assert np.abs(other - first).max() > 0.002


def test_steps_are_edited_and_exported_with_the_image_that_was_pressed(shod):
    options = shod.softground
    options.tread_pattern, options.tread_image = "IMAGE", picture(CHECKER)
    shown(shod)
    footprints, about = baked_ground.load(options.ground)
    treads = asked_of(about["inputs"], footprints).treads
    bpy.data.images.remove(options.tread_image)
    assert treads.keys() == {(step.character, step.sole) for step in footprints}
    assert {tread.is_mirrored for tread in treads.values()} == {False, True}


def missing():
    image = bpy.data.images.new("Gone", 1, 1)
    image.source, image.filepath = "FILE", "//not_there.png"
    return image


def wide():
    return bpy.data.images.new("Wide", tread_images.LARGEST + 1, 1)


@pytest.mark.parametrize(
    ("make", "named"),
    [(lambda: None, "none is chosen"), (missing, "'Gone'.*not_there.png"), (wide, "'Wide' is 4,097 x 1 pixels")],
)
def test_images_that_cannot_be_read_are_named_and_nothing_changes(shod, make, named):
    options = shod.softground
    options.tread_pattern, options.tread_image = "IMAGE", make()
    before = len(bpy.data.objects), len(bpy.data.meshes)
    with pytest.raises(InputError, match=named):
        bake(shod)
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == before
    options.relief = "OFF"  # then nobody asks for it
    bake(shod)


def test_off_has_the_same_heights_whatever_the_pattern(shod):
    shod.softground.relief = "OFF"
    first = shown(shod)
    shod.softground.tread_pattern, shod.softground.tread_image = "IMAGE", picture(CHECKER)
    assert np.array_equal(first, shown(shod))


def test_images_are_set_by_name_on_the_command_line(shod):
    image = picture(CHECKER, "My Sole")
    setting_paths.assign(shod.softground, "tread_pattern", "IMAGE")
    setting_paths.assign(shod.softground, "tread_image", "My Sole")
    assert shod.softground.tread_image == image
    with pytest.raises(InputError, match="no image of that name"):
        setting_paths.assign(shod.softground, "tread_image", "Another")


@pytest.mark.slow
def test_soles_press_the_grooves_of_their_own_mesh(shod):
    """The sample character's shoes have bars; from shoes without them nothing is taken, and the bake says so."""
    plain = shown(shod)
    shod.softground.tread_pattern = "SHOES"
    assert np.abs(shown(shod) - plain).max() > 0.002
    assert bake_report.stale_reasons(shod) == ()
    ground = shod.softground.ground
    maps = baked_ground.load(ground)[1]["inputs"]["shoe_treads"]
    assert {sole for _, sole, _ in maps} == {sole.name for sole in shod.softground.characters[0].soles}
    for obj in shod.objects:
        if obj.type == "MESH" and obj.parent == shod.softground.characters[0].armature:
            flatten(obj.data)
    with pytest.raises(InputError, match=r"soles of 'Walker' show no grooves.*choose another pattern"):
        bake(shod)


def flatten(mesh):
    """Take the grooves out of a figure that stands on z = 0."""
    for vertex in mesh.vertices:
        if vertex.co.z < 0.012:
            vertex.co.z = 0.0
