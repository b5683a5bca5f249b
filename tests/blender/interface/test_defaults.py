"""What two clicks give: a preset is the whole ground, and the first character of a scene gets the default one."""

import dataclasses

import bpy
import numpy as np
import pytest

from sample_scenes import demo, four_grounds
from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from softground_addon.blender import ground_presets, jobs, settings
from softground_addon.blender.baking import bake_job
from softground_addon.blender.characters import prop_setup
from softground_addon.blender.ground import ground_mesh
from softground_addon.blender.playback import own_data
from softground_addon.blender.setup import shot_setup as operators
from softground_addon.core.ground import presets
from softground_addon.core.motion.sole_motion import COARSER
from softground_addon.core.record import record
from softground_addon.core.settings import BakeSettings


@pytest.fixture
def walker(scene):
    """Somebody who walks, in a scene in which nothing was set."""
    armature = create_character("Walker", Body(), scene.collection, 4.0)
    write_action(armature, walk(Body(), Gait(), 16, 24), "Walk")
    bpy.context.view_layer.objects.active = armature
    return armature


GROUND = ("preset", "surface", "material", "pressure", "tread_m", "cell_size_m", "debris")
"""Inputs of a report that make a ground look as it does."""


def of_ground(inputs):
    return {key: inputs[key] for key in GROUND}


def of_a_walk_on(scene, walker, preset):
    """The inputs of the demo's bake."""
    lane = demo.bake_lane(scene, walker, preset, None)
    return record.load(lane.ground.data[ground_mesh.RECORD]).about["inputs"]


@pytest.mark.slow
def test_two_clicks_the_demo_and_the_gallery_bake_the_same_ground(scene, walker, monkeypatch):
    bpy.ops.softground.add_character()
    clicked = jobs.run(bake_job.bake(scene, write=False)).report["inputs"]
    assert (clicked["preset"], clicked["pressure"], clicked["tread_m"]) == ("Snow", "CENTRE_OF_PRESSURE", 0.003)
    assert clicked["cell_size_m"] == pytest.approx(0.005, abs=0.0005)
    assert of_ground(of_a_walk_on(scene, walker, "Snow")) == of_ground(clicked)
    sand = of_ground(of_a_walk_on(scene, walker, "Dry Sand"))

    bpy.ops.wm.read_factory_settings(use_empty=True)
    monkeypatch.setattr(four_grounds, "FRAMES", 16)
    monkeypatch.setattr(four_grounds, "PRESETS", ("Snow", "Dry Sand"))
    gallery = four_grounds.build(bpy.context.scene, options={"relief": "OFF"}).bakes
    for preset, inputs in (("Snow", of_ground(clicked)), ("Dry Sand", sand)):
        shown = of_ground(gallery[preset].report["inputs"])
        assert shown.pop("cell_size_m") == pytest.approx(inputs.pop("cell_size_m"), rel=0.1)  # a coarser figure
        assert shown == inputs


def test_steps_throw_in_new_scenes_and_not_on_the_papers_grounds(scene, walker):
    options = scene.softground
    bpy.ops.softground.add_character()
    assert options.debris
    for preset, throws in (("Paper Snow", False), ("Dry Sand", True), ("Paper Mud", False)):
        bpy.ops.softground.load_preset(name=preset)
        assert options.debris == throws


def test_what_was_set_before_the_first_character_stays(scene, walker):
    options = scene.softground
    options.cell_size, options.pressure, options.material.youngs_modulus = 0.03, "UNIFORM", 1e6
    bpy.ops.softground.add_character()
    assert (options.pressure, options.material.youngs_modulus) == ("UNIFORM", 1e6)
    assert options.cell_size == pytest.approx(0.03)
    assert options.tread == pytest.approx(0.003)
    bpy.ops.softground.load_preset(name="Mud")
    assert options.cell_size == pytest.approx(0.03)


def test_a_new_scene_is_set_to_what_its_first_character_sets(scene, walker):
    before = {field.name: getattr(settings.snapshot(scene), field.name) for field in dataclasses.fields(BakeSettings)}
    bpy.ops.softground.add_character()
    after = settings.snapshot(scene)
    others = {name for name, value in before.items() if getattr(after, name) != value}
    assert others == {"characters", "response", "frames", "cell_size_m"}  # the cells fit the soles


def test_a_preset_that_says_no_more_sets_the_material_alone(scene, walker, tmp_path):
    bpy.ops.softground.add_character()
    old = dataclasses.replace(presets.find("mud"), pressure=None, tread=None, cells_along_sole=None, debris=None)
    (tmp_path / "bog.json").write_text(presets.dump(old))
    scene.softground.pressure, scene.softground.debris = "UNIFORM", False
    bpy.ops.softground.load_preset(filepath=str(tmp_path / "bog.json"))
    assert not scene.softground.debris
    assert scene.softground.material.youngs_modulus == old.material.youngs_modulus
    assert scene.softground.pressure == "UNIFORM"
    assert scene.softground.tread == pytest.approx(0.003)


@pytest.mark.slow
def test_cells_fit_the_shortest_sole_and_things_have_a_centimetre_at_most(scene, walker):
    options = scene.softground
    bpy.ops.softground.add_character()
    fine = options.cell_size
    bpy.ops.mesh.primitive_uv_sphere_add(radius=5.0)
    bpy.ops.softground.add_character()
    assert options.cell_size == fine
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.08)
    bpy.ops.softground.add_character()
    assert options.cell_size == pytest.approx(0.16 / 55, rel=0.02)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.002)
    bpy.ops.softground.add_character()
    assert options.cell_size == pytest.approx(0.55 / 55 / COARSER, rel=0.02)
    options.characters.clear()
    bpy.ops.mesh.primitive_uv_sphere_add(radius=4.0)
    prop_setup.add_props(scene, [bpy.context.active_object])
    assert options.cell_size == pytest.approx(0.01)


def test_lengths_of_a_preset_fit_small_soles_unless_they_are_set(scene, walker):
    """A toy's print of 3 cm has no rim of 4 cm around it."""
    options, snow, mud = scene.softground, presets.find("snow"), presets.find("mud")
    material = options.material
    walker.scale = (0.1, 0.1, 0.1)
    bpy.ops.softground.add_character()
    small = options.characters[0].sole_length / ground_presets.SMALL_SOLE
    assert small < 0.4
    for preset in (snow, mud, snow):
        ground_presets.apply_preset(scene.softground, preset)
        assert material.rim_reach == pytest.approx(small * preset.material.rim_reach)
        assert material.blur_sigma == pytest.approx(small * preset.material.blur_sigma)
        assert ground_presets.holds(scene.softground, preset)
        said = ground_presets.as_preset(scene.softground, "again").material
        assert said == preset.material
    material.rim_reach = 0.02
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.005)
    bpy.ops.softground.add_character()
    assert material.rim_reach == pytest.approx(0.02)
    assert material.blur_sigma == pytest.approx(options.length_scale * snow.material.blur_sigma)
    assert options.length_scale < 0.9 * small


def test_lengths_of_a_preset_are_those_of_a_persons_soles(scene, walker):
    bpy.ops.softground.add_character()
    assert scene.softground.length_scale == 1.0
    assert ground_presets.holds(scene.softground, presets.find("snow"))


def test_leaving_add_character_leaves_the_ground_as_it_was(scene, walker):
    before = settings.snapshot(scene)
    unset = ground_presets.untouched(scene.softground)
    job = operators._added(scene, walker, [walker])
    while not scene.softground.characters:
        next(job)
    assert settings.snapshot(scene) != before
    job.close()
    assert settings.snapshot(scene) == before
    assert ground_presets.untouched(scene.softground) == unset


def test_shoes_have_a_tread_and_what_rolls_has_none(scene, walker):
    bpy.ops.softground.add_character()
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.15, location=(1.0, 0.0, 0.15))
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.01
    bpy.ops.softground.bake()
    mesh = scene.softground.ground.data
    marks, place = np.empty((len(mesh.vertices), 3), np.float32), np.empty((len(mesh.vertices), 3), np.float32)
    mesh.attributes[own_data.SOLE].data.foreach_get("vector", marks.ravel())
    mesh.attributes["position"].data.foreach_get("vector", place.ravel())
    place += np.array(scene.softground.ground.location, np.float32)
    under_ball = np.linalg.norm(place[:, :2] - (1.0, 0.0), axis=1) < 0.15
    assert marks[under_ball, 2].max() == 0.0
    assert marks[~under_ball, 2].max() == pytest.approx(0.003)
