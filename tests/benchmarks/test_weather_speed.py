"""What weather costs in a frame over playback, by how much of it there is; in turns, on the walk's ground alone."""

import bpy
import pytest

from softground_addon.blender import compat
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.playback import weather_modifier
from softground_addon.blender.weather import ground_weather as weather
from tests.benchmarks.bars import below
from tests.benchmarks.test_playback_speed import in_turns, times
from tests.blender import shots

pytestmark = pytest.mark.benchmark

FRAMES = 170
SKIES = {
    "at nothing": {},
    "wind": {"Wind": 8.0},
    "rain": {"Rain": 30.0},
    "snow, rain and wind": {"Snowfall": 2.0, "Rain": 30.0, "Wind": 8.0},
}


def test_weather_costs_by_what_there_is_of_it(scene):
    shots.walker(scene, frames=FRAMES)
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name="Dry Sand")
    options = scene.softground
    options.frame_start, options.frame_end, options.cell_size = 1, FRAMES, 0.005
    bpy.ops.softground.bake()
    shown = baked_ground.display_mesh_of(options.ground)
    modifier = weather.add(options.ground)
    for obj in scene.objects:
        obj.hide_viewport = obj != shown

    def play(values=None):
        modifier.show_viewport = values is not None
        for name, identifier in weather_modifier.inputs_of(modifier).items():
            compat.write_input(
                modifier, identifier, {"Water Table": 100.0, "Time Scale": 60.0, **(values or {})}.get(name, 0.0)
            )
        shown.update_tag()
        bpy.context.view_layer.update()
        return times(scene, shown)

    rows = in_turns({"playback": play} | {name: lambda values=values: play(values) for name, values in SKIES.items()})
    playback = rows["playback"].frame
    cost = {name: row.frame - playback for name, row in rows.items()}
    whole = cost["snow, rain and wind"]
    below("a frame of snow, rain and wind over playback", whole / playback, 1.0)
    below("a frame of weather at nothing over all of it", cost["at nothing"] / whole, 0.25)
    below("a frame of wind over all weather", cost["wind"] / whole, 0.8)
