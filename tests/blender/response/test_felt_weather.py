"""Bakes that depend on the weather over them."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat, jobs
from softground_addon.blender.baking import bake_report, step_edits
from softground_addon.blender.debris import debris_object
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.mesh_arrays import positions
from softground_addon.blender.playback import weather_modifier
from softground_addon.blender.weather import weather_keys
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit, step_id
from softground_addon.core.record.footprints import recompose
from softground_addon.core.weather.felt_weather import felt_in, weathering_of
from tests.blender import weathered_shots


@pytest.fixture(scope="module")
def baked(addon, tmp_path_factory):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    weathered_shots.added_walker(scene)
    scene.softground.sink_feet = False
    bpy.ops.softground.bake()  # makes the ground
    bpy.ops.softground.bake()
    bpy.ops.softground.add_weather()
    path = tmp_path_factory.mktemp("felt") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def opened(baked):
    bpy.ops.wm.open_mainfile(filepath=str(baked))
    return bpy.context.scene


def modifier_of(scene):
    return weather_modifier.modifier_of(baked_ground.display_mesh_of(scene.softground.ground))


def set_to(scene, **values):
    modifier = modifier_of(scene)
    for name, identifier in weather_modifier.inputs_of(modifier).items():
        if name.replace(" ", "_") in values:
            compat.write_input(modifier, identifier, float(values[name.replace(" ", "_")]))
    modifier.id_data.update_tag()


def footprints(scene):
    return record.load(bytes(baked_ground.stored_record(scene.softground.ground))).footprints


def same(first, other):
    return record.dump(record.BakeRecord(tuple(first), {})) == record.dump(record.BakeRecord(tuple(other), {}))


def shown(scene, frame):
    """World positions of the vertices that are shown."""
    scene.frame_set(frame)
    carrier = baked_ground.display_mesh_of(scene.softground.ground)
    local = positions(carrier.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)
    return local @ np.array(carrier.matrix_world)[:3, :3].T + np.array(carrier.matrix_world)[:3, 3]


SNOWFALL = {"Snowfall": 3.0, "Temperature": -5.0, "Time_Scale": 21_600.0}
"""18 cm in a second."""


def fallen(scene, frame):
    return 3e-2 / 3600 * 21_600 * (frame - scene.softground.frame_start) / 24


@pytest.mark.slow
def test_what_is_thrown_lies_on_the_new_snow_of_its_time(opened):
    opened.softground.steps_feel_weather = opened.softground.debris = True
    set_to(opened, **SNOWFALL)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    ground = opened.softground.ground
    loaded = record.load(bytes(baked_ground.stored_record(ground)))
    obj = debris_object.of(ground)
    lies = positions(obj.data) + np.array(obj.matrix_world.translation)
    born = np.empty(len(obj.data.vertices), np.float32)
    obj.data.attributes["softground_birth"].data.foreach_get("value", born)
    away = np.min([np.linalg.norm(lies[:, :2] - each.position[:2], axis=1) for each in loaded.edited], axis=0) > 0.3
    weathering = weathering_of(felt_in(loaded.about["inputs"]), opened.softground.material.layer_depth)
    level = np.array([weathering.level(frame) for frame in np.floor(born[away])])
    assert away.sum() > 5
    assert level.max() > 0.05
    assert np.mean(np.abs(lies[away, 2] - level) < 1e-3) > 0.95  # some lie at the tips of prints
    pieces = positions(obj.data)
    bake = jobs.run(step_edits.reading(opened))  # an edit throws in the same weather
    jobs.run(step_edits.editing(bake, {step_id(loaded.footprints[0]): StepEdit(mute=True)}))
    jobs.run(step_edits.editing(bake, {}))
    assert np.array_equal(positions(debris_object.of(ground).data), pieces)


@pytest.mark.slow
def test_without_weather_steps_that_feel_it_leave_the_same_bits(opened):
    before = footprints(opened)
    opened.softground.steps_feel_weather = True
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert same(footprints(opened), before)
    opened.softground.steps_feel_weather = False
    set_to(opened, **SNOWFALL)
    bpy.ops.softground.bake()
    assert same(footprints(opened), before)


@pytest.mark.slow
def test_steps_stand_on_the_snow_that_has_fallen(opened):
    set_to(opened, **SNOWFALL)
    before = footprints(opened)
    opened.softground.steps_feel_weather = True
    assert bake_report.stale_reasons(opened) == ("The settings have changed",)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert not bake_report.stale_reasons(opened)
    after = footprints(opened)
    assert after[0].end_frame < 30
    last = max(after, key=lambda footprint: footprint.start_frame)
    deep = recompose([last]).read(last.window)[0]
    assert deep.min() < -0.1
    plain = next(each for each in before if each.start_frame == last.start_frame)
    depth = recompose([plain]).read(plain.window)[0].max()
    # It lies that much below the snow that it was stepped on, from which on more fell beside it.
    surface = shown(opened, int(last.end_frame))
    far = np.hypot(*(surface[:, :2] - last.position[:2]).T)
    snow, floor = fallen(opened, last.start_frame), surface[far < 0.15, 2].min()
    assert np.median(surface[(far > 0.4) & (far < 0.6), 2]) == pytest.approx(fallen(opened, last.end_frame), rel=0.1)
    thicker = 1.0 + snow / opened.softground.material.layer_depth
    assert snow - floor == pytest.approx(depth * thicker, rel=0.25)
    assert last.max_depth_m == pytest.approx(depth * thicker, rel=0.1)
    # And materials see it as pressed.
    mesh = (
        baked_ground.display_mesh_of(opened.softground.ground).evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    )
    compression = np.empty(len(mesh.vertices), np.float32)
    mesh.attributes["softground_compression"].data.foreach_get("value", compression)
    assert compression.min() > -1e-3
    assert compression[far < 0.15].max() == pytest.approx(last.max_depth_m, rel=0.25)


@pytest.mark.slow
def test_a_slider_that_moves_makes_such_a_bake_outdated_and_no_other(opened):
    bpy.ops.softground.bake()
    set_to(opened, **SNOWFALL)
    assert not bake_report.stale_reasons(opened)
    opened.softground.steps_feel_weather = True
    bpy.ops.softground.bake()
    assert not bake_report.stale_reasons(opened)
    set_to(opened, Snowfall=2.0)
    assert bake_report.stale_reasons(opened) == ("The settings have changed",)
    set_to(opened, Snowfall=3.0, Halo=0.5)  # which is for the looks alone
    assert not bake_report.stale_reasons(opened)


def keyed(scene, name, *keys):
    modifier = modifier_of(scene)
    path = compat.input_path(modifier, weather_modifier.inputs_of(modifier)[name])
    for frame, value in keys:
        compat.write_input(modifier, weather_modifier.inputs_of(modifier)[name], float(value))
        modifier.id_data.keyframe_insert(path, frame=frame)
    weather_keys.follow(modifier.id_data)


@pytest.mark.slow
def test_keyed_weather_is_felt_as_it_is_at_the_time_of_each_step(opened):
    before = footprints(opened)
    set_to(opened, **SNOWFALL)
    middle = sorted(each.start_frame for each in before)[-1] - 2
    keyed(opened, "Snowfall", (1, 0.0), (middle - 1, 0.0), (middle, 3.0))
    opened.softground.steps_feel_weather = True
    bpy.ops.softground.bake()
    inputs = baked_ground.load(opened.softground.ground)[1]["inputs"]["weather"]
    assert len(inputs["snowfall"]) == 257
    assert not [reason for reason in bake_report.stale_reasons(opened) if "settings" in reason]
    for footprint, other in zip(before, footprints(opened), strict=True):
        assert same([footprint], [other]) == (footprint.start_frame < middle)
    keyed(opened, "Snowfall", (middle, 2.0))
    assert "The settings have changed" in bake_report.stale_reasons(opened)


@pytest.mark.slow
def test_an_edit_presses_again_in_the_weather_of_the_bake(opened):
    set_to(opened, **SNOWFALL)
    opened.softground.steps_feel_weather = True
    bpy.ops.softground.bake()
    after = footprints(opened)
    opened.softground.steps_feel_weather = False
    set_to(opened, Snowfall=0.0)
    bake = jobs.run(step_edits.reading(opened))
    again = bake.with_edits({step_id(after[-1]): StepEdit(turn_deg=1e-9)})
    ((number, footprint),) = again.pressed_again.items()
    difference = recompose([footprint], cell_size=footprint.cell_size).read(footprint.window) - recompose(
        [after[number]]
    ).read(footprint.window)
    assert np.abs(difference).max() < 1e-4
    assert recompose([footprint]).read(footprint.window)[0].min() < -0.1


@pytest.mark.slow
def test_feet_stand_on_the_weathered_ground(opened):
    options, height = opened.softground, {}
    options.sink_feet = True
    for felt in (False, True):
        options.steps_feel_weather = felt
        set_to(opened, **SNOWFALL)
        assert bpy.ops.softground.bake() == {"FINISHED"}
        step = max(footprints(opened), key=lambda footprint: footprint.start_frame)
        frame = int((step.start_frame + step.end_frame) / 2)
        opened.frame_set(frame)
        rig = options.characters[0].armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
        height[felt] = (rig.matrix_world @ rig.pose.bones[options.characters[0].soles[step.sole].bone].head).z
    assert height[True] - height[False] == pytest.approx(fallen(opened, step.start_frame), rel=0.15)
