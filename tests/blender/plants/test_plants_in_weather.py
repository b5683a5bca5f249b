"""Plants under the weather of their ground: wind sways what stands, snow covers what is low."""

import subprocess
import sys

import bpy
import numpy as np
import pytest

from softground_addon.blender import compat, mesh_arrays
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.nodes.node_modifiers import inputs_of
from softground_addon.blender.plants import trampling_table
from softground_addon.blender.playback import weather_modifier
from softground_addon.core.plants.swaying import swayed
from tests.blender.grounds import node_group
from tests.blender.plants.test_give_way import (
    HEIGHT,
    RATE,
    angles,
    blades,
    give_way,
    go_to,
    hair,
    scattered,
    state,
    walked,
)
from tests.blender.plants.test_give_way import roots as roots_on_the_trail

WIND = 8.0


@pytest.fixture
def shot(opened_as):
    scene = opened_as(walked)
    scene.frame_set(1)
    return scene


def roots(count=200):
    """Roots far from the trail and, after the first hundred, on it."""
    place = roots_on_the_trail(count)
    place[: count // 2, 0] += 5.0
    return place


def blow(wind=WIND, **others):
    """Weather on the ground with a wind."""
    assert bpy.ops.softground.add_weather(preset="SNOWFALL") == {"FINISHED"}
    ground = baked_ground.display_mesh_of(bpy.context.scene.softground.ground)
    modifier = weather_modifier.modifier_of(ground)
    for name, identifier in weather_modifier.inputs_of(modifier).items():
        value = {"Wind": wind, "Time Scale": 1.0, **others}.get(name.replace("_", " "), 0.0)
        compat.write_input(modifier, identifier, value)
    ground.update_tag()
    bpy.context.view_layer.update()
    return modifier


@pytest.mark.parametrize("first", ["weather", "give way"])
@pytest.mark.parametrize("make", [hair, scattered])
def test_what_stands_sways_by_the_law_whichever_comes_first(shot, make, first):
    plants = make(roots())
    if first == "weather":
        blow()
    give_way(plants)
    if first == "give way":
        blow()
    shot.frame_set(-50)  # before the first step
    lean = angles(plants) / 90.0
    chances = np.array([0.0, 1.0])
    table = trampling_table.of(shot.softground.ground)
    ahead = roots()[:, 0] - table.matrix_world.translation.x
    low, high = (
        np.array([swayed(WIND, HEIGHT, 1.0, -50 / RATE, place, chance) for place in ahead]) for chance in chances
    )
    everyone = np.array([swayed(WIND, HEIGHT, 1.0, -50 / RATE, ahead, chance) for chance in np.linspace(0, 1, 101)])
    assert (lean > everyone.min(axis=0) - 1e-3).all()
    assert (lean < everyone.max(axis=0) + 1e-3).all()
    assert np.abs(low - high).max() > 0.01
    root, tip = blades(plants)
    np.testing.assert_allclose(np.linalg.norm(tip - root, axis=1), HEIGHT, rtol=1e-4)
    assert (tip - root)[:, 0].min() > 0.0
    np.testing.assert_allclose((tip - root)[:, 1], 0.0, atol=1e-5)


def test_frames_play_in_any_order_with_sub_frames_and_wind_follows_its_keys(shot):
    grass = hair(roots())
    give_way(grass)
    weather = blow()
    path = compat.input_path(weather, inputs_of(weather)["Wind"])
    for frame, wind in ((1, 0.0), (100, 10.0)):
        compat.write_input(weather, inputs_of(weather)["Wind"], wind)
        weather.id_data.keyframe_insert(path, frame=frame)
    frames = [1.0, 20.25, 20.5, 60.0, 100.0]
    forward = {}
    for frame in frames:
        go_to(shot, frame)
        forward[frame] = state(grass), angles(grass)[:100].mean()
    for frame in reversed(frames):
        go_to(shot, frame)
        assert state(grass) == forward[frame][0]
    leans = [forward[frame][1] for frame in frames]
    assert leans[0] == 0.0
    assert leans[1] < leans[3] < leans[4]
    assert leans[4] == pytest.approx(90.0 * 0.6 * (1.0 - np.exp(-((10.0 / 15.0) ** 2))), rel=0.7)


@pytest.mark.slow
def test_what_lies_under_a_sole_does_not_sway_and_without_wind_all_is_as_before(shot):
    grass = hair(roots())
    give_way(grass)
    shot.frame_set(40)
    calm, lying = state(grass), angles(grass)
    blow(0.0)
    assert state(grass) == calm
    blow()
    shot.frame_set(40)
    flat = lying > 85.0
    assert flat.any()
    np.testing.assert_allclose(angles(grass)[flat], lying[flat], atol=4.0)
    assert bpy.ops.softground.remove_weather() == {"FINISHED"}
    shot.frame_set(40)
    assert state(grass) == calm
    weather = blow()
    weather.id_data.modifiers.remove(weather)  # by the user
    bpy.context.view_layer.update()
    shot.frame_set(40)
    assert state(grass) == calm
    assert bpy.ops.softground.bake() == {"FINISHED"}
    shot.frame_set(40)
    np.testing.assert_allclose(angles(grass), lying, atol=1e-3)


@pytest.mark.slow
def test_the_wind_goes_with_the_bake_and_comes_with_the_next_weather(shot):
    grass = hair(roots())
    upright = state(grass)
    give_way(grass)
    blow()
    shot.frame_set(40)
    assert angles(grass)[:100].min() > 1.0
    assert bpy.ops.softground.bake() == {"FINISHED"}  # weather stays
    shot.frame_set(40)
    assert angles(grass)[:100].min() > 1.0
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    shot.frame_set(40)
    assert state(grass) == upright


def test_leaves_do_not_sway(shot):
    leaves = scattered(roots())
    give_way(leaves, kind="LITTER")
    shot.frame_set(40)
    calm = state(leaves)
    blow()
    shot.frame_set(40)
    assert state(leaves) == calm


PLAY = """
import bpy, sys, numpy as np
bpy.ops.wm.open_mainfile(filepath=sys.argv[1], use_scripts=False)
assert not hasattr(bpy.types.Scene, "softground")
bpy.context.scene.frame_set(30, subframe=0.5)
grass = bpy.data.objects["Grass"].evaluated_get(bpy.context.evaluated_depsgraph_get())
flat = np.empty(3 * len(grass.data.points), np.float32)
grass.data.attributes["position"].data.foreach_get("vector", flat)
np.save(sys.argv[2], flat)
"""


@pytest.mark.slow
def test_it_plays_without_the_add_on_and_without_scripts(shot, tmp_path):
    grass = hair(roots())
    give_way(grass)
    blow()
    go_to(shot, 30.5)
    expected = grass.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.attributes["position"].data
    flat = np.empty(3 * len(expected), np.float32)
    expected.foreach_get("vector", flat)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"), copy=True)
    args = [sys.executable, "-c", PLAY, str(tmp_path / "shot.blend"), str(tmp_path / "played.npy")]
    subprocess.run(args, check=True, capture_output=True)
    assert np.load(tmp_path / "played.npy").tobytes() == flat.tobytes()


@pytest.mark.slow
def test_snow_covers_what_is_low_and_lifts_nothing(shot):
    place = roots()
    leaves, grass = scattered(place), hair(place)
    give_way(leaves, kind="LITTER")
    give_way(grass)
    shot.frame_set(48)
    before = state(leaves), state(grass)
    blow(0.0, Snowfall=100.0, **{"Time Scale": 7200.0})
    shot.frame_set(48)
    assert (state(leaves), state(grass)) == before
    shown = baked_ground.display_mesh_of(shot.softground.ground).evaluated_get(bpy.context.evaluated_depsgraph_get())
    top = np.array([shown.matrix_world @ vertex.co for vertex in shown.data.vertices])[:, 2]
    assert np.median(top) > 0.05
    assert np.median(top) > blades(leaves)[0][:, 2].max()


def on_the_ground(scatter):
    """The scatter on the vertices of the ground that shows the prints, in place of its own."""
    tree = scatter.modifiers[0].node_group
    info = tree.nodes.new("GeometryNodeObjectInfo")
    info.inputs["Object"].default_value = baked_ground.display_mesh_of(bpy.context.scene.softground.ground)
    on = next(node for node in tree.nodes if node.bl_idname == "GeometryNodeInstanceOnPoints")
    tree.links.new(info.outputs["Geometry"], on.inputs["Points"])
    return scatter


def attached():
    """Hair curves on vertices of the ground along the trail, which is their surface and deforms them."""
    ground = baked_ground.display_mesh_of(bpy.context.scene.softground.ground)
    mesh, local = ground.data, mesh_arrays.positions(ground.data)
    flat = (local[:, :2] - local[:, :2].min(axis=0)) / np.ptp(local[:, :2], axis=0)
    vertex = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    mesh.uv_layers.new(name="Map").data.foreach_set("uv", flat[vertex].astype(np.float32).ravel())
    ground.add_rest_position_attribute = True
    place = local + np.array(ground.matrix_world.translation)
    chosen = np.flatnonzero((np.abs(place[:, 0]) < 0.3) & (np.abs(place[:, 1] + 1.0) < 1.0))[::50]
    grass = hair(place[chosen])
    grass.data.surface, grass.data.surface_uv_map = ground, "Map"
    at = grass.data.attributes.new("surface_uv_coordinate", "FLOAT2", "CURVE").data
    at.foreach_set("vector", flat[chosen].astype(np.float32).ravel())
    tree, given, result = node_group()
    deform = tree.nodes.new("GeometryNodeDeformCurvesOnSurface")
    tree.links.new(given, deform.inputs["Curves"])
    tree.links.new(deform.outputs["Curves"], result)
    grass.modifiers.new("Surface Deform", "NODES").node_group = tree
    return grass


FOLLOWING = {
    "instances on its vertices": (lambda: on_the_ground(scattered(roots())), "MEADOW"),
    "litter on its vertices": (lambda: on_the_ground(scattered(roots())), "LITTER"),
    "hair curves on its surface": (attached, "MEADOW"),
}


@pytest.mark.slow
@pytest.mark.parametrize(("make", "kind"), FOLLOWING.values(), ids=FOLLOWING)
def test_snow_lifts_no_scatter_that_follows_the_ground(shot, make, kind):
    scatter = make()
    modifier = give_way(scatter, kind=kind)
    assert compat.read_input(modifier, inputs_of(modifier)["Sinks"]) is False
    before = {}
    for frame in (-20, 48):
        shot.frame_set(frame)
        before[frame] = blades(scatter)
    blow(0.0, Snowfall=100.0, **{"Time Scale": 7200.0})
    for frame in (-20, 48):
        shot.frame_set(frame)
        for was, now in zip(before[frame], blades(scatter), strict=True):
            np.testing.assert_allclose(now, was, atol=1e-5)
            if make is attached:  # whose tips turn with their surface
                break
    modifier.show_viewport = False
    bpy.context.view_layer.update()
    assert np.median(blades(scatter)[0][:, 2] - before[48][0][:, 2]) > 0.05
