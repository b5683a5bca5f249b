"""The node group of weather over a bake: `core.after.weathered_ground` as nodes, behind the playback's.

Native Blender data that needs nothing of this add-on. What is the same everywhere is worked out once, the rest for each
vertex, from what `core.after.weather_places` found and the group's own inputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import bpy

from ...core.after import weather as w
from ...core.after.weathered_ground import BOUNDS, COVERED, KNOTS, Matter
from ..node_graph import NodeGraph, Number, new_group
from .playback_nodes import COMPRESSION, MOVED, REST, RIM

GROUP = "SoftGround Weather"
MARK = "softground_weather"
"""Custom property of the group, whatever the user calls it."""

BLUR, TRODDEN = "softground_weather_blur", "softground_weather_trodden"
TIMES, POOL = "softground_weather_times", "softground_weather_pool"
LEVELS = ("softground_weather_level_1", "softground_weather_level_2")
"""Vectors; see `core.after.weathered_ground.WeatherPlaces`. The levels are three and three."""
OF_HOLLOWS = (POOL, *LEVELS)
OF_WEATHER = (BLUR, TRODDEN, TIMES, *OF_HOLLOWS)

WETNESS, FRESH, WATER, DRIED = "softground_wetness", "softground_fresh", "softground_water", "softground_dried"
"""What the group stores for materials; see `core.after.weathered_ground.Weathered`. What has dried of ground that
was wet is 0 to 1."""

NOW = ("softground_weather_now_1", "softground_weather_now_2")
"""Vectors that are there only while the group works."""

CENTIMETRES_AN_HOUR, MILLIMETRES_AN_HOUR = 0.01 / w.HOUR, 0.001 / w.HOUR

INPUTS = (
    ("Snowfall", 0.0, 0.0, 100.0, "New snow in centimetres per hour. It settles, and rounds what it drapes over"),
    (
        "Temperature",
        0.0,
        -60.0,
        40.0,
        "Of the air in °C. Above 0, new snow melts, then the ground's, trodden snow last",
    ),
    ("Wind", 0.0, 0.0, 60.0, "In metres per second, at 10 m. From about 5 on it blows sand into prints, from 6 snow"),
    ("Rain", 0.0, 0.0, 500.0, "In millimetres per hour. It rounds edges, and what does not soak in stands in prints"),
    (
        "Drying",
        0.0,
        0.0,
        50.0,
        "What the air takes up, in millimetres of water per hour: 0.2 mild, 0.5 in sun and wind",
    ),
    ("Time Scale", 1.0, 0.0, 1e7, "How many times faster than the animation: 2880 shows 8 hours in 10 seconds"),
)
"""Name, value, least, most and description of each of the group's inputs."""
CONSTANT = ". The same over the whole shot: keys change all that has fallen so far"


def new() -> Any:
    """A new group with its inputs and nothing in it."""
    tree = new_group(GROUP, MARK)
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    for name, value, least, most, description in INPUTS:
        socket = tree.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketFloat")
        socket.default_value, socket.min_value, socket.max_value = value, least, most
        socket.description = description + CONSTANT
    return tree


def is_weather(tree: bpy.types.NodeTree) -> bool:
    """Whether a node group is one that `new` made."""
    return MARK in tree.keys()  # noqa: SIM118  (an ID is no mapping)


def build(tree: Any, *, matter: Matter, up: Sequence[float], first_frame: float, frame_rate: float) -> None:
    """Fill a group, in place of what is in it; its inputs stay.

    Parameters
    ----------
    tree : bpy.types.NodeTree
        From `new`.
    matter : Matter
        What the ground is.
    up : (3,) floats
        World up in the ground's own space and units, of the length of one metre.
    first_frame : float
        Scene frame at which the weather begins.
    frame_rate : float
        Frames of the scene per second [Hz].
    """
    tree.nodes.clear()
    graph = NodeGraph(tree)
    group = graph.node("NodeGroupInput")
    sky = _Sky(graph, group)
    frame = graph.number(graph.node("GeometryNodeInputSceneTime").outputs["Frame"])

    graph.next_row()
    pace = sky.time_scale / frame_rate
    of_all = (frame - first_frame).at_least(0.0) * pace
    pressed, since, compression = (graph.number(part) for part in graph.separated(_vector(graph, TIMES)))
    age = (frame - since).at_least(0.0) * pace
    cover_around, cover_within = sky.cover(of_all), sky.cover(age)

    graph.next_row()
    share = _shares(graph, sky.variance(age, cover_within, matter))
    relief = _relief(graph, up)
    blurred = relief + graph.number(graph.dot(_vector(graph, BLUR), share))
    kept = None
    if matter.blown:
        rate = sky.flux(matter.blown) * (1.0 / (max(matter.section, 1e-9) * matter.blown.bulk_density))
        kept = (age * rate * -1.0).exp()
        blurred = blurred * kept
    inside = graph.number(graph.dot(_vector(graph, TRODDEN), graph.vector("MAXIMUM", share, (1.0, 0.0, 0.0))))
    inside = inside.within_one() * (1.0 - pressed.above(frame))

    graph.next_row()
    cover = cover_around + (cover_within - cover_around) * inside
    height = blurred - relief + cover
    if matter.snow_depth:
        left = (blurred + matter.snow_depth).at_least(0.0)
        ratio = (1.0 - compression * (1.0 / matter.snow_depth)).at_least(0.0)
        around, within = sky.thawed(of_all).at_most(left), (sky.thawed(age) * ratio * ratio).at_most(left)
        height = height - around - (within - around) * inside
    fresh = (cover * (1.0 / COVERED)).within_one()
    wetness = sky.wetness(of_all, of_all + (age - of_all) * inside, matter)
    water = None
    if matter.soaking:
        graph.next_row()
        water = sky.standing(age, height, matter.soaking)
        height = height + water
        wetness = wetness.at_least(water.above(0.0))

    graph.next_row()
    geometry = group.outputs["Geometry"]
    seen = [height, wetness, fresh, *filter(None, (water, kept))]
    changed, (height, wetness, fresh, *more) = _worked_out(graph, geometry, seen)
    stored = {WETNESS: wetness, FRESH: fresh} | ({WATER: more.pop(0)} if water else {})
    # Before anything moves: all of it follows from where the playback has the vertices.
    changed = _with(graph, changed, _seen(graph, stored, more.pop() if kept else None, matter))
    changed = graph.forgotten(_moved(graph, changed, up, height), *NOW[: 1 + (len(seen) > 3)])
    graph.finish(graph.choose("GEOMETRY", sky.is_any().above(0.0).socket, geometry, changed))


def _worked_out(graph: NodeGraph, geometry: Any, values: Sequence[Number]) -> tuple[Any, list[Number]]:
    """A geometry that keeps some numbers, and these as they are kept: who asks for one does not work it out again."""
    kept = []
    for number, name in enumerate(NOW):
        together = values[3 * number : 3 * number + 3]
        if not together:
            break
        pack = graph.node("ShaderNodeCombineXYZ")
        for value, socket in zip(together, pack.inputs, strict=False):
            graph.link(value.socket, socket)
        geometry = graph.store(geometry, name, pack.outputs["Vector"], True, "FLOAT_VECTOR")
        kept += [graph.number(part) for part in graph.separated(_vector(graph, name))][: len(together)]
    return geometry, kept


def _seen(graph: NodeGraph, stored: dict[str, Number], kept: Number | None, matter: Matter) -> dict[str, Number]:
    """What is stored for materials; `kept` is the share of the prints that is not blown full."""
    if WATER in stored:
        stored[WATER] = graph.number(graph.attribute(WATER)).at_least(stored[WATER])  # the bake's own stays
    if matter.wet:
        stored[DRIED] = 1.0 - stored[WETNESS]
    if kept:  # what is blown full looks trodden no more
        stored |= {name: graph.number(graph.attribute(name)) * kept for name in (COMPRESSION, RIM)}
    return stored


def _with(graph: NodeGraph, geometry: Any, values: Mapping[str, Number]) -> Any:
    """A geometry with numbers of these names."""
    for name, value in values.items():
        geometry = graph.store(geometry, name, value.socket, True)
    return geometry


def _moved(graph: NodeGraph, geometry: Any, up: Sequence[float], height: Number) -> Any:
    """A geometry that is higher by so much."""
    node = graph.node("GeometryNodeSetPosition")
    graph.link(geometry, node.inputs["Geometry"])
    graph.link(graph.scaled(tuple(up), height.socket), node.inputs["Offset"])
    return node.outputs["Geometry"]


class _Sky:
    """The group's inputs in SI units, and what they do; what a method is given and gives is per vertex."""

    def __init__(self, graph: NodeGraph, group: Any) -> None:
        self.graph = graph
        said = {name: graph.number(group.outputs[name]) for name, *_ in INPUTS}
        self.snowfall = said["Snowfall"] * CENTIMETRES_AN_HOUR
        self.warmth = said["Temperature"].at_least(0.0)
        self.cold = said["Temperature"].at_most(0.0)
        self.wind = said["Wind"]
        self.rain = said["Rain"] * MILLIMETRES_AN_HOUR
        self.drying = said["Drying"] * MILLIMETRES_AN_HOUR
        self.time_scale = said["Time Scale"]
        least, more, fall, most = w.NEW_SNOW
        self._density = ((said["Temperature"] * (1.0 / fall)).exp() * more + least).at_most(most)
        rate, warmth, self._slowing = w.SETTLING
        self._settling = (self.cold * warmth).exp() * self._density * (self._slowing * rate)
        self._falling = self.snowfall * self._density * (1.0 / w.WATER_DENSITY)
        self._melting = self.warmth * w.DEGREE_DAY

    def is_any(self) -> Number:
        """More than 0 where there is any weather."""
        return (self.snowfall + self.warmth + self.wind + self.rain + self.drying) * self.time_scale

    def _fallen(self, age: Number) -> Number:
        """As `weather.snow_cover`."""
        kept: Number | None = None
        for at, weight in w.GAUSS:
            density = (age * self._settling * at + 1.0).log() * (1.0 / self._slowing) + self._density
            part = self._density * weight / density
            kept = part if kept is None else kept + part
        assert kept is not None
        return age * self.snowfall * kept

    def cover(self, age: Number) -> Number:
        """New snow that has not melted."""
        return self._fallen(age) * (1.0 - self._melting / self._falling).within_one()

    def thawed(self, age: Number) -> Number:
        """As `weather.thawed_depth`."""
        return age * (self._melting - self._falling).at_least(0.0) * (w.WATER_DENSITY / w.SNOW.bulk_density)

    def flux(self, blown: w.Blown) -> Number:
        """As `weather.blown_flux`."""
        speed = self.wind * float(w.friction_velocity(1.0))
        return speed * speed * speed * (w.BAGNOLD * w.AIR_DENSITY / w.GRAVITY) * speed.above(blown.threshold)

    def variance(self, age: Number, cover: Number, matter: Matter) -> Number:
        """What edges have lost."""
        spread = self.rain * w.RAIN_ROUNDING
        if matter.blown:
            spread = spread + self.flux(matter.blown) * (2.0 * w.HOP / matter.blown.bulk_density)
        under = cover + self.thawed(age) if matter.snow_depth else cover
        return under * w.DRAPE + spread * age

    def wetness(self, of_all: Number, exposed: Number, matter: Matter) -> Number:
        """How wet the ground looks where no water stands on it."""
        melting = self._melting if matter.snow_depth else self._melting.at_most(self._falling)
        wet = 1.0 - (of_all * (self.rain + melting) * (-1.0 / w.SHINE)).exp()
        if not matter.wet:
            return wet
        films = exposed * self.drying * (1.0 / w.SURFACE_FILM)
        lost = films.at_most(1.0) + (films.at_least(1.0).root() - 1.0) * 2.0
        return wet.at_least(1.0 - lost * (1.0 / w.DRY_AT))

    def standing(self, age: Number, height: Number, soaking: w.Soaking) -> Number:
        """Depth of water where the ground has changed by a height."""
        graph = self.graph
        capacity, above, left = (graph.number(part) for part in graph.separated(_vector(graph, POOL)))
        filled = (self._excess(age, left, soaking) / capacity).within_one().root() * KNOTS
        rise: Number | None = None
        for number, name in enumerate(LEVELS):
            steps = graph.vector("SUBTRACT", filled.socket, tuple(3.0 * number + step for step in range(3)))
            steps = graph.vector("MINIMUM", graph.vector("MAXIMUM", steps, (0.0,) * 3), (1.0,) * 3)
            part = graph.number(graph.dot(steps, _vector(graph, name)))
            rise = part if rise is None else rise + part
        assert rise is not None
        return (rise - above - height).at_least(0.0) * rise.above(0.0)

    def _excess(self, age: Number, left: Number, soaking: w.Soaking) -> Number:
        """As `weather.rain_excess`."""
        over = (self.rain - left * soaking.final).at_least(0.0)
        drop = left * (soaking.first - soaking.final)
        begin = ((over / drop).at_most(1.0).at_least(1e-30).log() * (-1.0 / soaking.decay)).at_most(age)
        soaked = (begin * -soaking.decay).exp() - (age * -soaking.decay).exp()
        return (over * (age - begin) - drop * soaked * (1.0 / soaking.decay)).at_least(0.0)


def _vector(graph: NodeGraph, name: str) -> Any:
    return graph.attribute(name, "FLOAT_VECTOR")


def _shares(graph: NodeGraph, variance: Number) -> Any:
    """As `weathered_ground.shares`."""
    spans = [high - low for low, high in pairwise(BOUNDS)]
    factors = tuple(1.0 / span for span in spans)
    offsets = tuple(-low / span for low, span in zip(BOUNDS[:-1], spans, strict=True))
    passed = graph.vector("MULTIPLY_ADD", variance.socket, factors, offsets)
    return graph.vector("MINIMUM", graph.vector("MAXIMUM", passed, (0.0,) * 3), (1.0,) * 3)


def _relief(graph: NodeGraph, up: Sequence[float]) -> Number:
    """How high the playback has a vertex over its place at rest [m]."""
    position = graph.node("GeometryNodeInputPosition").outputs["Position"]
    moved = graph.vector("SUBTRACT", position, _vector(graph, REST))
    metre = sum(part * part for part in up)
    along = graph.number(graph.dot(moved, tuple(part / metre for part in up)))
    return along * graph.number(graph.attribute(MOVED, "BOOLEAN"))
