"""Weather over a bake: the node group against the closed forms, and what it leaves alone."""

import subprocess
import sys
from dataclasses import replace
from functools import partial
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.output import exports
from softground_addon.blender.panels import weather_panel
from softground_addon.blender.playback import own_data, weather_inputs, weather_modifier, weather_table
from softground_addon.blender.playback import weather_nodes as nodes
from softground_addon.blender.weather import ground_weather as weather
from softground_addon.blender.weather import weather_keys, weather_result
from softground_addon.core.numerics.slices import sliced
from softground_addon.core.weather.weather import MOMENTS, matter_of, span_of
from softground_addon.core.weather.weather_course import Weather
from softground_addon.core.weather.weather_places import COVERED, NOT_YET, WeatherPlaces, section_of, weather_places
from tests.blender import shots, weathered_shots
from tests.core.weather.weathered_ground import weathered
from tests.tiers import slow_but_one

FRAMES = (1, 20, 34, 300)
SOME = weathered_shots.SOME | {"Water Table": 2.0, "Halo": 0.8}
DEFAULTS = {name: value for name, value, *_ in weather_inputs.INPUTS}
MAY_LACK = (*nodes.OF_WEATHER, nodes.WETNESS, nodes.FRESH, nodes.WATER, nodes.DRIED, nodes.BLOWN, nodes.RAISED)
"""What is not stored where the ground does not ask for it, and where there is no weather."""
HOUR = 3600.0


@pytest.fixture(scope="module")
def baked(addon, tmp_path_factory):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    weathered_shots.added_walker(scene)
    bpy.ops.softground.bake()
    path = tmp_path_factory.mktemp("weather") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def opened(baked, tmp_path, monkeypatch):
    """Opens a bake on snow, which weather may take for another surface."""

    def open_(surface="snow"):
        return weathered_shots.opened_as(surface, baked, tmp_path, monkeypatch)

    return open_


def carrier(scene):
    return baked_ground.display_mesh_of(scene.softground.ground)


def set_to(scene, **values):
    modifier = weather_modifier.modifier_of(carrier(scene))
    for name, identifier in weather_modifier.inputs_of(modifier).items():
        compat.write_input(modifier, identifier, float(values.get(name, DEFAULTS[name])))
    modifier.id_data.update_tag()


def in_core(values):
    """Sliders, each a number or one for each part of the time, as the core has them."""
    values = DEFAULTS | values
    return Weather(
        values["Snowfall"] * 0.01 / HOUR,
        values["Temperature"],
        values["Wind"],
        values["Rain"] * 1e-3 / HOUR,
        values["Drying"] * 1e-3 / HOUR,
        values["Time Scale"],
        values["Water Table"] * 0.01,
        values["Halo"],
    )


def read(mesh, name, width=1):
    kind = np.int32 if nodes.OF_WEATHER.get(name) == "INT" else np.float32
    if name in MAY_LACK and name not in mesh.attributes:
        return np.zeros((len(mesh.vertices), width), dtype=kind).squeeze()
    attribute = mesh.attributes[name]
    values = np.empty(len(attribute.data) * width, dtype=kind)
    attribute.data.foreach_get("value" if width == 1 else "vector", values)
    return values.reshape(-1, width) if width > 1 else values


def shown(scene, frame):
    scene.frame_set(frame)
    return carrier(scene).evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def positions_now(scene):
    return read(carrier(scene).evaluated_get(bpy.context.evaluated_depsgraph_get()).data, "position", 3)


def positions(scene, frame):
    scene.frame_set(frame)
    return positions_now(scene)


def contents(mesh):
    """All that a mesh holds, as bytes."""
    value = ("value", 1)
    kinds = {"FLOAT_VECTOR": ("vector", 3, np.float32), "FLOAT": (*value, np.float32), "INT": (*value, np.int32)}
    held = {}
    for attribute in mesh.attributes:
        if attribute.data_type in kinds:
            name, width, kind = kinds[attribute.data_type]
            values = np.empty(len(attribute.data) * width, dtype=kind)
            attribute.data.foreach_get(name, values)
            held[attribute.name] = values.tobytes()
    return held


@sliced
def trodden_twice(footprints, position, *rest, **known):
    """What a bake left, as if half of the places had been trodden before, and in another shape."""
    places = yield from weather_places.slices(footprints, position, *rest, **known)
    again, blur = places.again.copy(), places.blur_before.copy()
    again[::2], blur[::2] = (30.0, 10.0), 0.5 * places.blur[::2]
    return replace(places, again=again, blur_before=blur)


@pytest.mark.slow
@pytest.mark.parametrize("twice", [False, True])
@pytest.mark.parametrize("surface", slow_but_one(["snow", "sand", "mud", "wet_sand"]))
def test_the_nodes_do_what_the_closed_forms_say_at_any_frame(opened, surface, twice, monkeypatch):
    if twice:
        monkeypatch.setattr(weather, "weather_places", trodden_twice)
    scene = opened(surface)
    before = {frame: positions(scene, frame) for frame in FRAMES}
    trodden = {frame: read(shown(scene, frame), own_data.COMPRESSION) for frame in FRAMES}
    assert bpy.ops.softground.add_weather() == {"FINISHED"}
    ground = carrier(scene)
    mesh = ground.data
    footprints, about = baked_ground.load(scene.softground.ground)
    span = weather.span_of(*about["inputs"]["frames"], 24.0)
    places = held(scene, span)
    matter = matter_of(surface, about["inputs"]["material"]["layer_depth"], section_of(footprints))
    rest = ground_mesh.rest_positions(mesh)
    alone = [{name: value} for name, value in SOME.items() if name != "Time Scale"]
    for values in ({"Time Scale": 900.0, **each} for each in (*alone, SOME)):
        set_to(scene, **values)
        said = in_core(values)
        for frame in (*FRAMES[::2], *FRAMES[1::2]):
            wanted = weathered(
                places,
                (before[frame] - rest)[:, 2].astype(float),
                said,
                matter,
                frame=frame,
                span=span,
            )
            now = shown(scene, frame)
            moved = (read(now, "position", 3) - before[frame])[:, 2]
            scale = max(float(np.abs(wanted.height).max()), 1e-3)
            close = partial(np.testing.assert_allclose, rtol=0, equal_nan=False, err_msg=f"{values}, {frame}")
            close(moved, wanted.height, atol=1e-5 * scale + 1e-8)
            if not matter.wet or nodes.WETNESS in now.attributes:
                close(read(now, nodes.WETNESS), wanted.wetness, atol=1e-3)
            close(read(now, nodes.FRESH), wanted.fresh, atol=1e-3)
            covered = (1.0 - wanted.unfilled) * trodden[frame] / COVERED  # by what has been blown into prints
            close(read(now, nodes.BLOWN), np.clip(covered, 0.0, 1.0), atol=1e-3)
            if matter.wet:
                close(read(now, nodes.DRIED), wanted.dried, atol=1e-3)
            if matter.soaking and not about["inputs"].get("relief_look"):
                close(read(now, nodes.WATER), wanted.water, atol=1e-5)


def key(scene, name, values, interpolation="LINEAR"):
    """Key a slider: its values by frame."""
    ground = carrier(scene)
    modifier = weather_modifier.modifier_of(ground)
    path = compat.input_path(modifier, weather_modifier.inputs_of(modifier)[name])
    for frame, value in values.items():
        compat.write_input(modifier, weather_modifier.inputs_of(modifier)[name], float(value))
        ground.keyframe_insert(path, frame=frame)
    curves = compat.action_curves(ground.animation_data.action)
    curve = next(each for each in curves if each.data_path == path)
    for point in curve.keyframe_points:
        point.interpolation = interpolation
    curve.update()
    ground.animation_data.action.update_tag()
    bpy.context.view_layer.update()
    return curve


def held(scene, span):
    """What a bake has stored for weather, with the frames of the moments that it tells apart."""
    mesh = carrier(scene).data
    moments = np.append(NOT_YET, np.linspace(span.first, span.last, MOMENTS + 1))
    since, before = (moments[read(mesh, name)] for name in (nodes.MOMENT, nodes.BEFORE))
    pool = rise = np.zeros((len(since), 3))
    if nodes.HOLLOW in mesh.attributes:
        _, hollows = table_of(scene, weather_table.HOLLOWS)
        pool, rise = (read(hollows, name, 3)[read(mesh, nodes.HOLLOW)] for name in ("pool", "rise"))
    again = read(mesh, nodes.AGAIN) if nodes.AGAIN in mesh.attributes else np.full(len(since), -NOT_YET)
    return WeatherPlaces(
        read(mesh, nodes.BLUR, 3),
        read(mesh, nodes.TRODDEN, 3),
        np.stack([read(mesh, nodes.PRESSED), since, read(mesh, nodes.COMPACTED)], axis=1),
        np.column_stack([pool[:, 0], read(mesh, nodes.ABOVE), pool[:, 1]]),
        np.column_stack([rise, moments[pool[:, 2].astype(int)]]),
        read(mesh, nodes.BLUR_BEFORE, 3),
        np.stack([again, before], axis=1),
    )


def everything(scene, frame):
    """Positions and what weather stores at a frame, side by side."""
    now = shown(scene, frame)
    names = (nodes.WETNESS, nodes.FRESH, nodes.WATER, nodes.DRIED, nodes.BLOWN)
    stored = [read(now, name)[:, None] for name in names]
    return np.hstack([read(now, "position", 3), *stored])


def table_of(scene, name=weather_table.TABLE):
    """The nodes and a table of a shot's weather."""
    inner = nodes.within(weather_modifier.modifier_of(carrier(scene)).node_group)
    return inner.nodes, weather_table.named(inner, name).data


@pytest.mark.slow
@pytest.mark.parametrize("surface", slow_but_one(["snow", "sand", "mud", "wet_sand"]))
def test_steady_weather_is_looked_up_and_as_it_would_be_worked_out(opened, surface, monkeypatch):
    scene = opened(surface)
    bpy.ops.softground.add_weather()
    alone = [{name: value} for name, value in SOME.items() if name != "Time Scale"]
    for values in ({"Time Scale": 900.0, **each} for each in (*alone, SOME)):
        set_to(scene, **values)
        bpy.context.view_layer.update()
        tree, _ = table_of(scene)
        looked_up = [everything(scene, frame) for frame in (34, 1, 20, 300)]
        ages = tree[weather_table.AGES].outputs[0]
        assert ages.default_value > 34 * 4
        with monkeypatch.context() as alone:
            alone.setattr(weather_keys, "follow", lambda display_mesh: None)
            ages.default_value = -1.0
            worked_out = [everything(scene, frame) for frame in (34, 1, 20, 300)]
            assert ages.default_value == -1.0
        for first, other in zip(looked_up, worked_out, strict=True):
            assert first == pytest.approx(other, abs=2e-6 * max(1.0, float(np.abs(other).max()))), values


@pytest.mark.slow
def test_the_table_of_steady_weather_counts_only_for_the_sliders_and_frames_that_it_is_for(opened, monkeypatch):
    scene = opened("sand")
    bpy.ops.softground.add_weather()
    set_to(scene, Snowfall=3.0, **{"Time Scale": 900.0})
    bpy.context.view_layer.update()
    _, table = table_of(scene)
    steady = {frame: positions(scene, frame) for frame in (20, 34)}
    scene.frame_set(20, subframe=0.1)
    between = positions_now(scene)
    look = table.attributes["position"].data
    values = np.empty(3 * len(look), np.float32)
    look.foreach_get("vector", values)
    look.foreach_set("vector", 2.0 * values)
    table.update_tag()
    monkeypatch.setattr(weather_keys, "follow", lambda display_mesh: None)  # as without the add-on
    assert np.abs(positions(scene, 34) - steady[34]).max() > 1e-3
    scene.frame_set(20, subframe=0.1)
    assert positions_now(scene).tobytes() == between.tobytes()
    set_to(scene, Snowfall=3.000001, **{"Time Scale": 900.0})
    assert positions(scene, 34) == pytest.approx(steady[34], abs=1e-5)
    set_to(scene, Snowfall=3.0, **{"Time Scale": 900.0})
    key(scene, "Rain", {1: 0.0, 34: 0.0})
    monkeypatch.undo()
    weather_keys.follow(carrier(scene))
    assert positions(scene, 34) == pytest.approx(steady[34], abs=1e-5)


KEYS = {
    "Snowfall": {1: 0.0, 60: 4.0, 61: 0.0, 200: 0.0, 280: 6.0},
    "Temperature": {1: -6.0, 90: 8.0, 150: -3.0, 400: 3.0},
    "Wind": {1: 0.0, 100: 9.0},
    "Rain": {1: 30.0, 120: 0.0},
    "Time Scale": {1: 600.0, 200: 1800.0},
}


@pytest.mark.slow
@pytest.mark.parametrize("surface", slow_but_one(["snow", "sand", "mud"]))
def test_keyed_weather_is_what_its_keys_add_up_to_in_any_order_and_without_the_add_on(opened, surface, tmp_path):
    scene = opened(surface)
    before = {frame: positions(scene, frame) for frame in FRAMES}
    bpy.ops.softground.add_weather()
    set_to(scene, Drying=0.3)  # which is not keyed
    for name, values in KEYS.items():
        key(scene, name, values, "CONSTANT" if name == "Wind" else "LINEAR")
    mesh = carrier(scene).data
    footprints, about = baked_ground.load(scene.softground.ground)
    span = weather.span_of(about["inputs"]["frames"][0], 400, 24.0)
    assert span.step == 2.0
    frames = np.arange(span.first, span.last + 1)
    parts = (frames[:-1] + 0.5).reshape(-1, 2)
    sliders = {}
    for name, keys in KEYS.items():  # by hand, not by Blender's curves
        at = list(keys)
        linear = np.interp(parts, at, list(keys.values()))
        values = np.where(parts < 100, 0.0, 9.0) if name == "Wind" else linear
        sliders[name] = np.append(values.mean(axis=1), list(keys.values())[-1])
    matter = matter_of(surface, about["inputs"]["material"]["layer_depth"], section_of(footprints))
    rest, places = ground_mesh.rest_positions(mesh), held(scene, weather.span_of(*about["inputs"]["frames"], 24.0))
    seen = {}
    for frame in (300, 1, 34, 20, 300):
        wanted = weathered(
            places,
            (before[frame] - rest)[:, 2].astype(float),
            in_core(sliders | {"Drying": 0.3}),
            matter,
            frame=frame,
            span=span,
        )
        now = positions(scene, frame)
        assert (now - before[frame])[:, 2] == pytest.approx(wanted.height, abs=1e-4 * max(wanted.height.max(), 1e-3))
        assert seen.setdefault(frame, now.tobytes()) == now.tobytes()
    assert alone(scene, tmp_path, 300) == seen[300]


@pytest.mark.slow
def test_a_changed_and_a_removed_key_count_at_once(opened):
    scene = opened()
    bpy.ops.softground.add_weather()
    set_to(scene, **{"Snowfall": 3.0, "Temperature": -5.0, "Time Scale": 900.0})
    steady = positions(scene, 300)
    curve = key(scene, "Snowfall", {1: 0.0, 150: 0.0, 151: 3.0}, "CONSTANT")
    late = positions(scene, 300)
    assert 0.4 < late[:, 2].max() / steady[:, 2].max() < 0.6
    for point in curve.keyframe_points:
        point.co[1] = 3.0
    curve.update()
    carrier(scene).animation_data.action.update_tag()
    bpy.context.view_layer.update()
    assert positions(scene, 300) == pytest.approx(steady, abs=1e-5)
    carrier(scene).animation_data_clear()
    set_to(scene)
    bpy.context.view_layer.update()
    assert positions(scene, 300)[:, 2].max() < 0.1 * steady[:, 2].max()


@pytest.mark.slow
@pytest.mark.parametrize("has_keys", [False, True])
def test_a_copy_of_the_ground_has_weather_of_its_own(opened, has_keys):
    scene = opened()
    bpy.ops.softground.add_weather(preset="SNOWFALL")
    if has_keys:
        key(scene, "Snowfall", {1: 0.0, 150: 3.0})
    ground = carrier(scene)
    bpy.ops.object.select_all(action="DESELECT")
    ground.select_set(True)
    bpy.ops.object.duplicate()
    (copy,) = bpy.context.selected_objects
    bpy.context.view_layer.update()

    def heights_of(obj):
        scene.frame_set(300)
        return read(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data, "position", 3)[:, 2]

    as_copied = heights_of(copy)
    assert np.array_equal(heights_of(ground), as_copied)
    key(scene, "Snowfall", {1: 0.0, 250: 0.0, 251: 9.0, 300: 9.0}, "CONSTANT")
    assert np.array_equal(heights_of(copy), as_copied)
    keyed = heights_of(ground)
    assert np.abs(keyed - as_copied).max() > 0.01
    copy.animation_data_clear()
    modifier = weather_modifier.modifier_of(copy)
    compat.write_input(modifier, weather_modifier.inputs_of(modifier)["Snowfall"], 0.0)
    copy.update_tag()
    bpy.context.view_layer.update()
    bare = heights_of(copy)
    assert bare.max() < 0.1 * as_copied.max()
    assert np.array_equal(heights_of(ground), keyed)
    scene.softground.material.youngs_modulus *= 3.0
    bpy.ops.softground.bake()
    assert np.array_equal(heights_of(copy), bare)


@pytest.mark.slow
def test_keys_stay_through_a_bake(opened):
    scene = opened()
    bpy.ops.softground.add_weather(preset="SNOWFALL")
    key(scene, "Snowfall", {1: 0.0, 34: 5.0})
    before = positions(scene, 300)
    bpy.ops.softground.bake()
    assert positions(scene, 300).tobytes() == before.tobytes()


def test_at_nothing_each_frame_is_the_bakes_bit_for_bit(opened):
    scene = opened()
    before = {frame: positions(scene, frame).tobytes() for frame in FRAMES}
    stored = contents(carrier(scene).data)
    bpy.ops.softground.add_weather()
    assert {frame: positions(scene, frame).tobytes() for frame in FRAMES} == before
    set_to(scene, Temperature=-20.0)  # cold alone is no weather
    assert positions(scene, 34).tobytes() == before[34]
    now = contents(carrier(scene).data)
    assert {name: now[name] for name in stored} == stored
    bpy.ops.softground.remove_weather()
    assert contents(carrier(scene).data) == stored
    assert not [group for group in bpy.data.node_groups if group.name.startswith(weather_inputs.GROUP)]


@pytest.mark.slow
def test_sliders_change_nothing_that_is_stored(opened):
    scene = opened("sand")
    bpy.ops.softground.add_weather()
    record = bytes(baked_ground.stored_record(scene.softground.ground))
    before = contents(carrier(scene).data)
    still = positions(scene, 300)
    set_to(scene, **SOME)
    assert positions(scene, 300).tobytes() != still.tobytes()
    assert bytes(baked_ground.stored_record(scene.softground.ground)) == record
    assert contents(carrier(scene).data) == before


@pytest.mark.slow
def test_weather_comes_behind_the_playback_and_before_what_is_the_users(opened):
    scene = opened()
    ground = carrier(scene)
    mine = ground.modifiers.new("Mine", "SUBSURF")
    mine.levels = mine.render_levels = 0
    ground.modifiers.active = mine
    bpy.ops.softground.add_weather(preset="SNOWFALL")
    bpy.ops.softground.add_weather()  # renews, and leaves the sliders alone
    assert [modifier.name for modifier in ground.modifiers] == ["SoftGround Playback", "SoftGround Weather", "Mine"]
    assert ground.modifiers.active == mine
    values = weather.values_of(scene.softground.ground)
    assert values["Snowfall"] == pytest.approx(3.0)
    modifier = weather_modifier.modifier_of(ground)
    for name, identifier in weather_modifier.inputs_of(modifier).items():  # as the panel shows them
        holder, path = compat.input_field(modifier, identifier)
        assert holder.path_resolve(path) == values[name]


@pytest.mark.slow
def test_the_final_mesh_stands_under_the_weather_of_the_last_frame(opened):
    scene = opened()
    scene.frame_end = 200
    without = exports.final_mesh(scene.softground.ground).data
    bpy.ops.softground.add_weather(preset="SNOWFALL")
    wanted = positions(scene, 200)
    scene.frame_set(5)
    still = exports.final_mesh(scene.softground.ground).data
    # The playback adds a height to the place at rest, the mesh holds where that led: they differ by a rounding.
    assert read(still, "position", 3) == pytest.approx(wanted, abs=1e-6)
    assert scene.frame_current == 5
    assert set(still.attributes.keys()) == {*without.attributes.keys(), nodes.WETNESS, nodes.FRESH, nodes.RAISED}
    weather_modifier.modifier_of(carrier(scene)).show_viewport = False
    plain = exports.final_mesh(scene.softground.ground).data
    assert contents(plain) == contents(without)


def test_the_final_mesh_of_a_slowed_down_scene_stands_under_the_weather_of_its_last_frame(opened):
    scene = opened()
    bpy.ops.softground.clear_bake()
    scene.render.frame_map_old, scene.render.frame_map_new, scene.frame_end = 100, 200, 100
    bpy.ops.softground.bake()
    bpy.ops.softground.add_weather(preset="SNOWFALL")
    wanted = positions(scene, 100)
    still = exports.final_mesh(scene.softground.ground).data
    assert read(still, "position", 3) == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("kind", ["abc", "usdc"])
def test_alembic_and_usd_carry_the_weather(opened, tmp_path, kind):
    scene, path = opened(), tmp_path / f"ground.{kind}"
    bpy.ops.softground.add_weather(preset="SNOWFALL")
    wanted, fresh = positions(scene, 200), read(shown(scene, 200), nodes.FRESH)
    objects = set(bpy.data.objects)
    if kind == "abc":
        exports.export_alembic(scene.softground.ground, path, 200, 201)
        bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False)
    else:
        exports.export_usd(scene.softground.ground, path, 200, 201)
        bpy.ops.wm.usd_import(filepath=str(path))
    scene.frame_set(200)
    meshes = [obj for obj in set(bpy.data.objects) - objects if obj.type == "MESH"]
    imported = max(meshes, key=lambda obj: len(obj.data.polygons))  # the other is debris
    mesh = imported.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    world = read(mesh, "position", 3) @ np.array(imported.matrix_world.to_3x3()).T
    assert np.sort(world[:, 2]) == pytest.approx(np.sort(wanted[:, 2]), abs=1e-5)
    if kind == "usdc":  # Alembic holds no such numbers of a mesh
        assert np.sort(read(mesh, nodes.FRESH)) == pytest.approx(np.sort(fresh), abs=1e-5)


@pytest.mark.parametrize(
    ("values", "stored"),
    [
        ({"Wind": 8.0}, ()),
        ({"Snowfall": 2.0}, (nodes.FRESH, nodes.RAISED)),
        ({"Drying": 0.4}, (nodes.DRIED,)),
        ({"Halo": 0.5}, (nodes.DRIED,)),
        ({"Rain": 30.0}, (nodes.WATER,)),
        ({"Water Table": 2.0}, (nodes.WATER,)),
    ],
)
@pytest.mark.slow
def test_only_what_the_sliders_ask_for_is_stored(opened, values, stored):
    scene = opened("wet_sand")
    names = set(shown(scene, 300).attributes.keys())
    bpy.ops.softground.add_weather()
    set_to(scene, **values)
    anywhere = set() if "Wind" in values else {nodes.WETNESS}  # no wind blows wet sand
    named = {
        attribute.name for attribute in shown(scene, 300).attributes if not attribute.name.startswith(".a_")
    }  # not what is captured
    assert named - names - set(nodes.OF_WEATHER) == {*stored, *anywhere}


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["Snow", "Dry Sand", "Wet Sand", "Mud"])
def test_weather_makes_a_file_at_most_a_quarter_larger(scene, tmp_path, preset):
    shots.walker(scene, frames=120)
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name=preset)
    scene.softground.frame_start, scene.softground.frame_end = 1, 120
    bpy.ops.softground.bake()
    size = []
    for name in ("without", "with"):
        path = tmp_path / f"{name}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
        size.append(path.stat().st_size)
        bpy.ops.softground.add_weather(preset="SHOWER")
    print(f"{preset}: {size[0]:,} bytes, {size[1] / size[0] - 1:+.1%} with weather")
    assert size[1] <= 1.25 * size[0]


@pytest.mark.slow
def test_weather_stores_no_more_than_forty_bytes_of_a_vertex(opened):
    scene = opened("sand")
    bpy.ops.softground.add_weather()
    size = {"FLOAT_VECTOR": 12, "FLOAT": 4, "INT": 4}
    stored = [size[kind] for name, kind in nodes.OF_WEATHER.items() if name in carrier(scene).data.attributes]
    assert sum(stored) <= 40


@pytest.mark.slow
def test_what_is_blown_full_looks_trodden_no_more(opened):
    scene = opened("sand")
    before = read(shown(scene, 300), "softground_compression").max()
    bpy.ops.softground.add_weather()
    set_to(scene, **{"Wind": 10.0, "Time Scale": 600.0})
    assert read(shown(scene, 300), "softground_compression").max() < 0.1 * before
    assert read(carrier(scene).data, "softground_compression").max() == before


@pytest.mark.parametrize("seconds", [45.0, 600.0])
def test_materials_see_the_edges_that_wind_has_left_and_no_sharper_ones(opened, seconds):
    scene = opened("sand")
    rest = ground_mesh.rest_positions(carrier(scene).data)
    bpy.ops.softground.add_weather()
    set_to(scene, **{"Wind": 9.0, "Time Scale": seconds * scene.render.fps / (300 - FRAMES[-2])})
    now = shown(scene, 300)
    compression, rim = (read(now, f"softground_{name}") for name in ("compression", "rim"))
    np.testing.assert_allclose(rim - compression, (read(now, "position", 3) - rest)[:, 2], rtol=0, atol=1e-5)
    assert min(compression.min(), rim.min()) >= 0.0


@pytest.mark.slow
def test_a_beach_turns_pale_as_it_dries(opened):
    scene = opened("wet_sand")
    bpy.ops.softground.add_weather(preset="DRYING_BEACH")
    pale = [read(shown(scene, frame), nodes.DRIED) for frame in (1, 100, 300)]
    assert pale[0].max() == 0.0
    assert (pale[0] < pale[1]).all()
    assert (pale[1] < pale[2]).all()


@pytest.mark.parametrize("preset", slow_but_one(weather.PRESETS))
def test_each_preset_has_something_to_show(opened, preset):
    scene = opened({"THAW": "snow", "SNOWFALL": "snow", "WINDY_DUNES": "sand"}.get(preset, "mud"))
    before = positions(scene, 300)
    bpy.ops.softground.add_weather(preset=preset)
    now = shown(scene, 300)
    changed = np.abs(read(now, "position", 3) - before).max()
    assert changed > 5e-3 or read(now, nodes.WETNESS).min() < 0.6


def content_of(tree):
    """All that a node group is: its nodes with their properties and values, and its links."""
    names = {node: number for number, node in enumerate(tree.nodes)}

    def value_of(socket):
        value = getattr(socket, "default_value", None)
        if isinstance(value, bpy.types.Object):  # each has a table of its own
            return value.type
        return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value

    held = [
        (
            node.bl_idname,
            tuple(getattr(node, name, None) for name in ("operation", "data_type", "domain", "mode", "input_type")),
            [value_of(socket) for socket in (*node.inputs, *node.outputs)],
            tuple(node.location),
        )
        for node in tree.nodes
    ]
    links = {
        (names[link.from_node], link.from_socket.identifier, names[link.to_node], link.to_socket.identifier)
        for link in tree.links
    }
    return held, links


def changed_value(tree):
    next(node for node in tree.nodes if node.bl_idname == "ShaderNodeMath").operation = "TANGENT"


CHANGES = {
    "as it was": lambda tree: None,
    "a value": changed_value,
    "a node less": lambda tree: tree.nodes.remove(tree.nodes[40]),
    "a node more": lambda tree: tree.nodes.new("NodeFrame"),
    "a link less": lambda tree: tree.links.remove(tree.links[100]),
    "a muted node": lambda tree: setattr(tree.nodes[50], "mute", True),
}


@pytest.mark.slow
def test_a_group_that_is_filled_again_is_as_one_that_is_new(addon):
    about = {"up": (0.0, 0.0, 1.0), "span": span_of(1.0, 60.0, 24.0)}
    kinds = [
        {"parts": [(matter_of("sand", 0.2, section), soaking)], **about}
        for section, soaking in ((0.005, (0.3, 0.9)), (0.008, (0.2, 0.8)))
    ]
    groups = [weather_inputs.new() for _ in kinds]
    for group, kind in zip(groups, kinds, strict=True):
        nodes.build(group, **kind)
    fresh = [(content_of(group), content_of(nodes.within(group))) for group in groups]
    group, inner = groups[0], nodes.within(groups[0])
    for number, (change, make) in enumerate(CHANGES.items(), 1):
        make(inner)
        nodes.build(group, **kinds[number % 2])
        assert nodes.within(group) == inner, change
        assert (content_of(group), content_of(inner)) == fresh[number % 2], change
    assert fresh[0] != fresh[1]


@pytest.mark.slow
def test_clear_takes_the_weather_along_and_a_bake_again_keeps_its_sliders(opened):
    scene = opened()
    bpy.ops.softground.clear_bake()
    ground = scene.softground.ground
    clear = contents(ground.data)
    bpy.ops.softground.bake()
    bpy.ops.softground.add_weather(preset="SHOWER")
    bpy.ops.softground.bake()
    values = weather.values_of(scene.softground.ground)
    assert values["Rain"] == pytest.approx(40.0)
    assert values["Time Scale"] == pytest.approx(180.0)
    assert not bpy.context.window_manager.softground.stale
    bpy.ops.softground.clear_bake()
    assert contents(scene.softground.ground.data) == clear
    assert not scene.softground.ground.modifiers
    assert not [group for group in bpy.data.node_groups if group.name.startswith(weather_inputs.GROUP)]


@pytest.mark.slow
@pytest.mark.parametrize("felt", [False, True])
def test_a_bake_gives_its_weather_what_it_would_find_in_the_stored_record(opened, felt):
    scene = opened("sand")
    bpy.ops.softground.add_weather(preset="SHOWER")
    key(scene, "Rain", {1: 10.0, 200: 40.0})
    scene.softground.steps_feel_weather = felt
    bpy.ops.softground.bake()
    baked = contents(carrier(scene).data)
    bpy.ops.softground.add_weather()
    assert contents(carrier(scene).data) == baked
    assert np.frombuffer(baked[nodes.HOLLOW], np.int32).any()


def test_an_attribute_of_the_users_is_left_alone(opened):
    scene = opened()
    carrier(scene).data.attributes.new(nodes.PRESSED, "FLOAT", "POINT")
    with pytest.raises(RuntimeError, match=r"rename it"):
        bpy.ops.softground.add_weather()
    assert weather_modifier.modifier_of(carrier(scene)) is None
    assert not [group for group in bpy.data.node_groups if weather_inputs.is_weather(group)]


@pytest.mark.slow
def test_the_panel_says_that_weather_only_covers_prints_where_there_is_some(opened):
    opened()
    panel = MagicMock()
    for has_weather in (False, True):
        weather_panel.SOFTGROUND_PT_weather.draw(panel, bpy.context)
        assert ("Tick the box above, and bake again" in str(panel.mock_calls)) == has_weather
        assert ("steps_feel_weather" in str(panel.mock_calls)) == has_weather
        bpy.ops.softground.add_weather()


@pytest.mark.slow
def test_it_plays_without_the_add_on(opened, tmp_path):
    scene = opened()
    bpy.ops.softground.add_weather(preset="SNOWFALL")
    assert alone(scene, tmp_path, 300) == positions(scene, 300).tobytes()


def alone(scene, tmp_path, frame):
    """Positions at a frame in a Blender that does not know the add-on, as bytes."""
    name, path = carrier(scene).name, tmp_path / "alone.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    script = (
        "import bpy, numpy as np\n"
        f"bpy.ops.wm.open_mainfile(filepath={str(path)!r}, use_scripts=False)\n"
        f"bpy.context.scene.frame_set({frame})\n"
        f"mesh = bpy.data.objects[{name!r}].evaluated_get(bpy.context.evaluated_depsgraph_get()).data\n"
        "values = np.empty(len(mesh.vertices) * 3, dtype=np.float32)\n"
        "mesh.attributes['position'].data.foreach_get('vector', values)\n"
        f"np.save({str(tmp_path / 'alone.npy')!r}, values)\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, cwd=tmp_path)
    return np.load(tmp_path / "alone.npy").tobytes()


@pytest.mark.parametrize(("densest", "deepest"), [(None, 0.25), (0.4, 0.1)])
def test_hollows_read_compression_against_what_can_be_packed(densest, deepest):
    material = {"blur_sigma": 0.005, "layer_depth": 0.25} | ({"densest": densest} if densest else {})
    units = dict.fromkeys(("frame_rate", "time_stretch", "gravity_m_s2", "unit_scale_m", "cell_size_m"), 1.0)
    _, regions = weather.of_bake([], {"inputs": {**units, "surface": "soil", "material": material, "weather": None}})
    assert regions.pressable[0] == pytest.approx(deepest)


@pytest.mark.slow
def test_a_night_of_snow_is_one_slider(opened):
    scene = opened()
    bpy.ops.softground.add_weather()
    options = scene.softground
    assert options.weather_hours == pytest.approx(weather_result.NIGHT)
    untouched = positions(scene, scene.frame_end)[:, 2]
    options.snow_cm = 20.0
    assert options.snow_cm == pytest.approx(20.0, abs=1e-4)
    risen = positions(scene, scene.frame_end)[:, 2] - untouched
    assert np.median(risen) == pytest.approx(0.20, rel=0.01)

    options.weather_hours = 24.0
    assert options.weather_hours == pytest.approx(24.0)
    assert options.snow_cm == pytest.approx(20.0, abs=1e-4)
    assert weather.values_of(options.ground)["Snowfall"] < 2.5  # cm/h
    options.snow_cm = 0.0
    assert (positions(scene, scene.frame_end)[:, 2] == untouched).all()
    bpy.ops.softground.add_weather()  # which keeps what is set
    assert options.weather_hours == pytest.approx(24.0)


@pytest.mark.slow
@pytest.mark.parametrize("warm", [-10.0, 3.0])
def test_snow_that_cannot_lie_is_as_much_as_can_fall(opened, warm):
    scene = opened()
    bpy.ops.softground.add_weather()
    set_to(scene, Temperature=warm, **{"Time Scale": 1.0})
    scene.softground.snow_cm = 500.0
    assert weather.values_of(scene.softground.ground)["Snowfall"] == pytest.approx(weather_result.MOST_SNOW)
    assert 0.0 <= scene.softground.snow_cm < 500.0


@pytest.mark.slow
@pytest.mark.parametrize("detail", ["NEVER", "ALWAYS"])
def test_keys_go_over_to_the_mesh_that_carries_the_next_bake(opened, detail):
    scene = opened()
    options = scene.softground
    options.detail = "ALWAYS" if detail == "NEVER" else "NEVER"
    bpy.ops.softground.bake()
    first = carrier(scene)
    bpy.ops.softground.add_weather(preset="SNOWFALL")
    weather_modifier.modifier_of(first).name = "Night"
    key(scene, "Snowfall", {1: 0.0, 34: 5.0}, interpolation="CONSTANT")
    options.detail = detail
    bpy.ops.softground.bake()
    assert carrier(scene) != first
    modifier = weather_modifier.modifier_of(carrier(scene))
    assert weather_keys.is_keyed(modifier, "Snowfall")
    (curve,) = compat.action_curves(carrier(scene).animation_data.action)
    assert curve.data_path == compat.input_path(modifier, weather_modifier.inputs_of(modifier)["Snowfall"])
    assert [tuple(point.co) for point in curve.keyframe_points] == [(1.0, 0.0), (34.0, 5.0)]
    assert {point.interpolation for point in curve.keyframe_points} == {"CONSTANT"}
