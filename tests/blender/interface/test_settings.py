"""All that a bake depends on is in one snapshot, taken as it begins."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs, settings
from softground_addon.blender.baking import bake_job, bake_report
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.reading import analysis
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.record import record
from softground_addon.core.settings import Acts
from tests.blender import shots
from tests.blender.grounds import plane

SAMPLES = sorted((Path(__file__).parents[3] / "sample_scenes").glob("*.blend"))

NO_INPUT = {
    "cells_along_sole": "sets the cell size",
    "characters.sole_length": "sets the cell size",
    "length_scale": "sets the rim's reach and the smoothing",
    "snow_cm": "sets the weather",
    "weather_hours": "sets the weather",
    "grounding.by_button": "what Clear Bake switches off again",
    "has_layers": "noted by the response, for panels",
    "active_character": "which one the list shows",
    "active_ground": "which one the list shows",
    "active_hard_ground": "which one the list shows",
    "characters.active_hold": "which one the list shows",
    "characters.active_joint": "which one the list shows",
    "characters.active_sole": "which one the list shows",
    "characters.root_motion_strength": "how much of a layer shows, which counts as the rig's movement",
    "characters.clean_feet_strength": "how much of a layer shows, which counts as the rig's movement",
    "characters.response_strength": "how much of a baked layer shows; moves the layer itself",
    "animated_frames": "why the panel says that Start and End are what they are",
    "tilt.own_strength": "what As Animated gives back",
    "own_time": "what Slow Down gives back",
    "slowed_time": "what Slow Down has set",
}
"""Settings of which a bake asks nothing, and why."""


def all_on(scene):
    """A walker and a ball on a plane, with everything switched on."""
    shots.walker(scene, frames=40)
    bpy.ops.softground.add_character()
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, location=(0, 1, 0.1))
    bpy.ops.softground.add_character()
    options = scene.softground
    options.ground, options.frame_end = plane(scene), 40
    options.hard_grounds.add().object = plane(scene, size=0.5, vertices=2)
    options.hard_grounds[0].object.location.x = 20.0
    options.grounds.add().object = plane(scene, size=0.5, vertices=2)
    options.grounds[0].object.location.x = 30.0
    options.grounds[0].material.preset = "Mine"  # and no more as the first
    options.tread_pattern, options.tread_image = "IMAGE", bpy.data.images.new("Sole", 4, 8)
    options.tilt.use = options.grounding.use = True
    options.characters[0].holds.add().foot = "foot.L"
    bpy.context.view_layer.update()


@pytest.fixture
def shot(opened_as):
    return opened_as(all_on)


def groups_of(owner, path=""):
    """All groups of settings with the paths of their kinds, those in lists one by one."""
    yield path, owner
    for name, setting in owner.bl_rna.properties.items():
        value = None if name == "rna_type" else getattr(owner, name)
        if setting.type == "COLLECTION":
            for item in value:
                yield from groups_of(item, f"{path}{name}.")
        elif isinstance(value, bpy.types.PropertyGroup):
            yield from groups_of(value, f"{path}{name}.")


def change(owner, name, scene):
    """Give a setting another value."""
    setting, value = owner.bl_rna.properties[name], getattr(owner, name)
    if setting.type == "POINTER" and setting.fixed_type.identifier == "Image":
        setattr(owner, name, None)
    elif setting.type == "POINTER":
        kind = "ARMATURE" if name == "armature" else "MESH"
        other = next((obj for obj in scene.objects if obj.type == kind and obj != value), None)
        setattr(owner, name, other if value is None else None)
    elif setting.type == "ENUM":
        setattr(owner, name, next(item.identifier for item in setting.enum_items if item.identifier != value))
    elif setting.type == "BOOLEAN":
        setattr(owner, name, not value)
    elif setting.type == "STRING":
        setattr(owner, name, f"{value} or another")
    elif setting.is_array:
        setattr(owner, name, [part + 1 for part in value])
    else:
        low, high = setting.hard_min, min(setting.hard_max, value + 1)
        setattr(owner, name, value + 1 if setting.type == "INT" else low + 0.37 * (high - low))


@pytest.mark.slow
def test_every_setting_that_is_registered_is_in_the_snapshot_or_named_here(shot):
    changing, seen = set(), set()
    before = settings.snapshot(shot)
    for path, owner in groups_of(shot.softground):
        for name, setting in owner.bl_rna.properties.items():
            if name == "rna_type" or setting.type == "COLLECTION":
                continue
            value = getattr(owner, name)
            if isinstance(value, bpy.types.PropertyGroup):
                continue
            value = tuple(value) if getattr(setting, "is_array", False) else value
            change(owner, name, shot)
            seen.add(path + name)
            if settings.snapshot(shot) != before:
                changing.add(path + name)
            setattr(owner, name, value)
            if name in {"depth_cm", *(surface.control for surface in SURFACES.values())}:  # they set the material
                for field, number in vars(before.material).items():
                    setattr(shot.softground.material, field, number)
            assert settings.snapshot(shot) == before, path + name
    assert {"ground", "material.hardening", "characters.soles.bone", "characters.joints.end", "tilt.damping"} <= seen
    unused = {
        "name",
        "material.name",
        "painted.name",
        "tilt.name",
        "grounding.name",
        "characters.holds.name",
        "hard_grounds.name",
        "grounds.name",
        "grounds.material.name",
        "grounds.painted.name",
    }  # groups that have no list
    assert seen - changing - unused == set(NO_INPUT)


def test_what_says_nothing_of_itself_acts_on_everything():
    from dataclasses import make_dataclass

    from softground_addon.core.settings import BakeSettings

    grown = make_dataclass("Grown", [("newest", int)], bases=(), frozen=True)
    assert BakeSettings.between(grown(3), Acts.READING, Acts.READING) == {"newest": 3}


def tread(options):
    options.tread = 0.004


def detail(options):
    options.detail = "ALWAYS"


def shape_keys(options):
    options.shape_keys = not options.shape_keys


def rolling(options):
    options.pressure = "CENTRE_OF_PRESSURE"


def cell_size(options):
    options.cell_size = 0.02


def bake_on_a_plane(scene):
    shots.walker(scene, frames=24)
    bpy.ops.softground.add_character()
    scene.softground.frame_end = 24
    scene.softground.ground = plane(scene)
    bpy.context.view_layer.update()
    bpy.ops.softground.bake()


@pytest.fixture
def baked(opened_as):
    return opened_as(bake_on_a_plane)


@pytest.mark.parametrize("change", [tread, detail, shape_keys, rolling, cell_size])
def test_a_bake_is_outdated_by_whatever_it_was_made_with(baked, change):
    assert bake_report.stale_reasons(baked) == ()
    change(baked.softground)
    assert bake_report.stale_reasons(baked) == ("The settings have changed",)


def test_a_bake_is_not_outdated_by_where_its_results_go(baked):
    options = baked.softground
    options.keep_forces, options.output, options.material.surface = True, "RESPONSE", "mud"
    assert bake_report.stale_reasons(baked) == ()


def test_a_prediction_is_worked_out_anew_for_other_cells(scene):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.25, location=(0, 0, 0.25))
    bpy.ops.softground.add_character()
    scene.softground.ground, scene.softground.frame_end = plane(scene), 10
    bpy.context.view_layer.update()
    before = analysis.read(scene)
    scene.softground.cell_size *= 3
    after = jobs.run(analysis.refreshing(settings.snapshot(scene)))
    analysis.forget()
    assert after.contacts.typical == analysis.read(scene).contacts.typical != before.contacts.typical > 0


def other_settings(scene):
    """Change whatever a bake could ask for."""
    options = scene.softground
    options.material.youngs_modulus /= 3
    options.material.blur_sigma *= 2
    options.pressure, options.cell_size, options.tread = "CENTRE_OF_PRESSURE", 0.02, 0.003
    options.frame_start, options.frame_end = 3, 17
    options.detail, options.shape_keys, options.output = "ALWAYS", False, "RESPONSE"
    options.keep_forces = options.tilt.use = True
    options.painted.stiffness = "nowhere"
    options.ground = plane(scene)
    options.characters[0].mass *= 2
    options.characters[0].force_model = "IMPULSE"
    options.characters[0].joints.clear()
    options.characters[0].soles.clear()


@pytest.mark.slow
@pytest.mark.parametrize("given", [False, True])
def test_a_bake_is_made_of_the_settings_that_it_began_with_and_says_so(scene, given):
    shots.walker(scene, frames=24)
    bpy.ops.softground.add_character()
    scene.softground.frame_end = 24
    if given:
        scene.softground.ground = plane(scene)
    bpy.context.view_layer.update()
    undisturbed = jobs.run(bake_job.bake(scene, write=False))
    job, result = bake_job.bake(scene), None
    next(job)
    began_with = settings.snapshot(scene)
    other_settings(scene)
    other = scene.softground.ground
    try:
        while True:
            next(job)
    except StopIteration as finished:
        result = finished.value
    assert record.dump(record.BakeRecord(result.footprints, {})) == record.dump(
        record.BakeRecord(undisturbed.footprints, {})
    )
    assert result.report["input_hash"] == undisturbed.report["input_hash"]
    assert not baked_ground.is_baked(other)
    ground = settings.resolve(began_with.ground) if given else scene.softground.ground
    _, about = baked_ground.load(ground)
    assert about["inputs"] == result.report["inputs"]
    assert about["inputs"]["material"]["youngs_modulus"] == began_with.material.youngs_modulus
    scene.softground.ground = ground
    assert "The settings have changed" in bake_report.stale_reasons(scene)


def finished(job):
    """The result of a bake that is under way."""
    while True:
        try:
            next(job)
        except StopIteration as end:
            return end.value


def test_a_created_ground_is_what_the_camera_saw_as_the_bake_began(scene):
    shots.walker(scene, frames=24)
    bpy.ops.softground.add_character()
    scene.softground.frame_end, scene.softground.ground_margin = 24, 1.0
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera, camera.data.type, camera.data.ortho_scale, camera.location.z = camera, "ORTHO", 14.0, 12.0
    bpy.context.view_layer.update()
    job = bake_job.bake(scene)
    next(job)
    scene.camera = None
    finished(job)
    across = np.array([corner[0] for corner in scene.softground.ground.bound_box])
    assert np.ptp(across) >= 14.0


@pytest.mark.slow
def test_what_prints_in_a_bake_may_become_the_ground_of_the_next_one_meanwhile(scene):
    all_on(scene)
    scene.softground.tread_pattern = "BARE"
    ground, ball = scene.softground.ground, scene.objects["Sphere"]
    job = bake_job.bake(scene)
    next(job)
    scene.softground.ground = ball
    finished(job)
    assert baked_ground.is_baked(ground)
    assert not baked_ground.is_baked(ball)


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_the_bakes_of_the_sample_files_are_up_to_date_until_something_changes(addon, path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    options = bpy.context.scene.softground
    assert bake_report.stale_reasons(bpy.context.scene) == ()
    options.detail = "NEVER"
    assert bake_report.stale_reasons(bpy.context.scene) == ("The settings have changed",)
    options.detail = "AUTO"
    options.material.poisson_ratio = 0.2
    assert bake_report.stale_reasons(bpy.context.scene) == ("The settings have changed",)


def test_an_object_is_found_under_another_name(scene):
    ground = plane(scene)
    name = settings.name_of(ground)
    ground.name, plane(scene).name = "Meadow", name.name
    assert settings.resolve(name) == ground
    assert np.array(ground.matrix_world).shape == (4, 4)
