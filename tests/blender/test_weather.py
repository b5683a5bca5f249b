"""Weather over a bake: the node group against the closed forms, and what it leaves alone."""

import subprocess
import sys

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat
from softground_addon.blender.ground import baked_ground, ground_mesh, weather, weather_modifier
from softground_addon.blender.ground import weather_nodes as nodes
from softground_addon.core.after.weather_places import section_of
from softground_addon.core.after.weathered_ground import Weather, WeatherPlaces, matter_of, weathered
from tests.blender import shots

FRAMES = (1, 20, 34, 300)
SOME = {"Snowfall": 2.0, "Temperature": 1.5, "Wind": 8.0, "Rain": 30.0, "Drying": 0.4, "Time Scale": 900.0}
HOUR = 3600.0


@pytest.fixture(scope="module")
def baked(addon, tmp_path_factory):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    shots.walker(scene, frames=34)
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name="Snow")
    scene.softground.cell_size = 0.02
    bpy.ops.softground.bake()
    path = tmp_path_factory.mktemp("weather") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def opened(baked, tmp_path, monkeypatch):
    """Opens a bake on snow, which weather may take for another surface."""

    def open_(surface="snow"):
        path = tmp_path / "shot.blend"
        path.write_bytes(baked.read_bytes())
        bpy.ops.wm.open_mainfile(filepath=str(path))
        monkeypatch.setattr(weather, "matter_of", lambda _, *of_bake: matter_of(surface, *of_bake))
        return bpy.context.scene

    return open_


def carrier(scene):
    return baked_ground.display_mesh_of(scene.softground.ground)


def set_to(scene, **values):
    modifier = weather_modifier.modifier_of(carrier(scene))
    for name, identifier in weather.inputs_of(modifier).items():
        compat.write_input(modifier, identifier, float(values.get(name, 1.0 if name == "Time Scale" else 0.0)))
    modifier.id_data.update_tag()


def read(mesh, name, width=1):
    if name in nodes.OF_HOLLOWS and name not in mesh.attributes:  # no water stands there
        return np.zeros((len(mesh.vertices), width))
    attribute = mesh.attributes[name]
    values = np.empty(len(attribute.data) * width, dtype=np.float32)
    attribute.data.foreach_get("value" if width == 1 else "vector", values)
    return values.reshape(-1, width) if width > 1 else values


def shown(scene, frame):
    scene.frame_set(frame)
    return carrier(scene).evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def positions(scene, frame):
    return read(shown(scene, frame), "position", 3)


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


@pytest.mark.parametrize("surface", ["snow", "sand", "mud"])
def test_the_nodes_do_what_the_closed_forms_say_at_any_frame(opened, surface):
    scene = opened(surface)
    before = {frame: positions(scene, frame) for frame in FRAMES}
    assert bpy.ops.softground.add_weather() == {"FINISHED"}
    ground = carrier(scene)
    mesh = ground.data
    footprints, about = baked_ground.load(scene.softground.ground)
    places = WeatherPlaces(
        read(mesh, nodes.BLUR, 3),
        read(mesh, nodes.TRODDEN, 3),
        read(mesh, nodes.TIMES, 3),
        read(mesh, nodes.POOL, 3),
        np.concatenate([read(mesh, name, 3) for name in nodes.LEVELS], axis=1),
    )
    matter = matter_of(surface, about["inputs"]["material"]["layer_depth"], section_of(footprints))
    rest = ground_mesh.rest_positions(mesh)
    alone = [{name: value} for name, value in SOME.items() if name != "Time Scale"]
    for values in ({"Time Scale": 900.0, **one} for one in (*alone, SOME)):
        set_to(scene, **values)
        said = Weather(
            values.get("Snowfall", 0.0) * 0.01 / HOUR,
            values.get("Temperature", 0.0),
            values.get("Wind", 0.0),
            values.get("Rain", 0.0) * 1e-3 / HOUR,
            values.get("Drying", 0.0) * 1e-3 / HOUR,
            values["Time Scale"],
        )
        for frame in (*FRAMES[::2], *FRAMES[1::2]):
            wanted = weathered(
                places,
                (before[frame] - rest)[:, 2].astype(float),
                said,
                matter,
                frame=frame,
                first_frame=about["inputs"]["frames"][0],
                frame_rate=24.0,
            )
            now = shown(scene, frame)
            moved = (read(now, "position", 3) - before[frame])[:, 2]
            scale = max(float(np.abs(wanted.height).max()), 1e-3)
            assert moved == pytest.approx(wanted.height, abs=1e-5 * scale + 1e-8), (values, frame)
            assert read(now, nodes.WETNESS) == pytest.approx(wanted.wetness, abs=1e-3)
            assert read(now, nodes.FRESH) == pytest.approx(wanted.fresh, abs=1e-3)
            assert not set(nodes.NOW) & set(now.attributes.keys())
            if matter.soaking and not about["inputs"].get("relief_look"):
                assert read(now, nodes.WATER) == pytest.approx(wanted.water, abs=1e-5)


def test_at_nothing_each_frame_is_the_bakes_bit_for_bit(opened):
    scene = opened()
    before = {frame: positions(scene, frame).tobytes() for frame in FRAMES}
    kept = contents(carrier(scene).data)
    bpy.ops.softground.add_weather()
    assert {frame: positions(scene, frame).tobytes() for frame in FRAMES} == before
    set_to(scene, Temperature=-20.0)  # cold alone is no weather
    assert positions(scene, 34).tobytes() == before[34]
    now = contents(carrier(scene).data)
    assert {name: now[name] for name in kept} == kept
    bpy.ops.softground.remove_weather()
    assert contents(carrier(scene).data) == kept
    assert not [group for group in bpy.data.node_groups if nodes.is_weather(group)]


def test_weather_comes_behind_the_playback_and_before_what_is_the_users(opened):
    scene = opened()
    ground = carrier(scene)
    mine = ground.modifiers.new("Mine", "SUBSURF")
    mine.levels = mine.render_levels = 0
    ground.modifiers.active = mine
    bpy.ops.softground.add_weather(preset="SNOWFALL")
    bpy.ops.softground.add_weather()  # renews, and leaves the sliders alone
    assert [one.name for one in ground.modifiers] == ["SoftGround Playback", "SoftGround Weather", "Mine"]
    assert ground.modifiers.active == mine
    values = weather.values_of(scene.softground.ground)
    assert values["Snowfall"] == pytest.approx(3.0)
    modifier = weather_modifier.modifier_of(ground)
    for name, identifier in weather.inputs_of(modifier).items():  # as the panel shows them
        holder, path = compat.input_field(modifier, identifier)
        assert holder.path_resolve(path) == values[name]


def test_what_is_blown_full_looks_trodden_no_more(opened):
    scene = opened("sand")
    before = read(shown(scene, 300), "softground_compression").max()
    bpy.ops.softground.add_weather()
    set_to(scene, **{"Wind": 10.0, "Time Scale": 600.0})
    assert read(shown(scene, 300), "softground_compression").max() < 0.1 * before
    assert read(carrier(scene).data, "softground_compression").max() == before


def test_a_beach_turns_pale_as_it_dries(opened):
    scene = opened("wet_sand")
    bpy.ops.softground.add_weather(preset="DRYING_BEACH")
    pale = [read(shown(scene, frame), nodes.DRIED) for frame in (1, 100, 300)]
    assert pale[0].max() == 0.0
    assert (pale[0] < pale[1]).all()
    assert (pale[1] < pale[2]).all()


@pytest.mark.parametrize("preset", weather.PRESETS)
def test_each_preset_has_something_to_show(opened, preset):
    scene = opened({"THAW": "snow", "SNOWFALL": "snow", "WINDY_DUNES": "sand"}.get(preset, "mud"))
    before = positions(scene, 300)
    bpy.ops.softground.add_weather(preset=preset)
    now = shown(scene, 300)
    changed = np.abs(read(now, "position", 3) - before).max()
    assert changed > 5e-3 or read(now, nodes.WETNESS).min() < 0.6


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
    assert not [group for group in bpy.data.node_groups if nodes.is_weather(group)]


def test_an_attribute_of_the_users_is_left_alone(opened):
    scene = opened()
    carrier(scene).data.attributes.new(nodes.TIMES, "FLOAT", "POINT")
    with pytest.raises(RuntimeError, match=r"rename it"):
        bpy.ops.softground.add_weather()
    assert weather_modifier.modifier_of(carrier(scene)) is None
    assert not [group for group in bpy.data.node_groups if nodes.is_weather(group)]


def test_it_plays_without_the_add_on(opened, tmp_path):
    scene = opened()
    bpy.ops.softground.add_weather(preset="SNOWFALL")
    with_it = positions(scene, 300)
    name = carrier(scene).name
    path = tmp_path / "alone.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    script = (
        "import bpy, numpy as np\n"
        f"bpy.ops.wm.open_mainfile(filepath={str(path)!r}, use_scripts=False)\n"
        "bpy.context.scene.frame_set(300)\n"
        f"mesh = bpy.data.objects[{name!r}].evaluated_get(bpy.context.evaluated_depsgraph_get()).data\n"
        "values = np.empty(len(mesh.vertices) * 3, dtype=np.float32)\n"
        "mesh.attributes['position'].data.foreach_get('vector', values)\n"
        f"np.save({str(tmp_path / 'alone.npy')!r}, values)\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, cwd=tmp_path)
    assert np.load(tmp_path / "alone.npy").tobytes() == with_it.tobytes()
