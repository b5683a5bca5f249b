"""The node group of weather over a bake, behind the playback's.

z = rest + kept·relief(sigma) + level. The level is that of untouched ground, which the weather has acted on from the
start, and in a print that since it was made; relief and bounds of prints lose their edges as variances add up.

Native Blender data that needs nothing of this add-on. What is the same everywhere is worked out once, the rest for each
vertex, from what `core.after.weather_places` found and the group's own inputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import bpy

from ...core.after.weather import Matter, Span
from ...core.after.weather_places import BOUNDS, COVERED, KNOTS, NEAR
from ..node_graph import NodeGraph, Number, new_group
from .playback_nodes import COMPRESSION, MOVED, REST, RIM
from .weather_course_nodes import CourseNodes

GROUP = "SoftGround Weather"
MARK = "softground_weather"
"""Custom property of the group, whatever the user calls it."""

BLUR, TRODDEN = "softground_weather_blur", "softground_weather_trodden"
TIMES, POOL = "softground_weather_times", "softground_weather_pool"
LEVELS = ("softground_weather_level_1", "softground_weather_level_2")
"""Vectors; see `core.after.weather_places.WeatherPlaces`. The levels are three and three."""
OF_HOLLOWS = (POOL, *LEVELS)
OF_WEATHER = (BLUR, TRODDEN, TIMES, *OF_HOLLOWS)

WETNESS, FRESH, WATER, DRIED = "softground_wetness", "softground_fresh", "softground_water", "softground_dried"
"""What the group stores for materials: how wet the ground looks and how much of it new snow covers, 0 to 1; depth of
standing water [m]; how dry it looks where it was wet to begin with, 0 to 1."""

NOW = "softground_weather_now"
"""A vector that is there only while the group works."""
HEIGHT, KEPT, PALE, PRESSED = "height", "kept", "pale", "pressed"
"""Names of what is worked out with that, and not stored."""

NEVER_FULL = 1e9
"""Of a sixth knot of the levels, which is none."""

INPUTS = (
    ("Snowfall", 0.0, 0.0, 100.0, "New snow in centimetres per hour. It settles, and rounds whatever it covers"),
    (
        "Temperature",
        0.0,
        -60.0,
        40.0,
        "Air temperature in °C. Above 0, new snow melts first, then the ground's, trodden snow last",
    ),
    (
        "Wind",
        0.0,
        0.0,
        60.0,
        "Wind speed in metres per second, at 10 m. It blows sand into prints from about 5 on, snow from 6",
    ),
    ("Rain", 0.0, 0.0, 500.0, "Rain in millimetres per hour. It rounds edges; what does not soak in stands in prints"),
    (
        "Drying",
        0.0,
        0.0,
        50.0,
        "Water that the air takes up, in millimetres per hour: 0.2 is mild, 0.5 sunny and windy",
    ),
    (
        "Water Table",
        100.0,
        0.0,
        100.0,
        "Water level in centimetres below the brim of each print, to which water seeps in",
    ),
    ("Halo", 0.0, 0.0, 1.0, "How pale wet sand turns around a loaded foot; it is wet again seconds later"),
    (
        "Time Scale",
        1.0,
        0.0,
        1e7,
        "How many times faster than the animation the weather runs: 2880 shows 8 hours in 10 seconds",
    ),
)
"""Name, value, least, most and description of each of the group's inputs."""


def new() -> Any:
    """A new group with its inputs and nothing in it."""
    tree = new_group(GROUP, MARK)
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    for name, value, least, most, description in INPUTS:
        socket = tree.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketFloat")
        socket.default_value, socket.min_value, socket.max_value = value, least, most
        socket.description = description
    return tree


def is_weather(tree: bpy.types.NodeTree) -> bool:
    """Whether a node group is one that `new` made."""
    return MARK in tree.keys()  # noqa: SIM118  (an ID is no mapping)


def build(
    tree: Any,
    *,
    matter: Matter,
    up: Sequence[float],
    span: Span,
    soaking: tuple[float, float] = (1.0, 1.0),
    felt: bool = False,
) -> None:
    """Fill a group, in place of what is in it; its inputs stay.

    Parameters
    ----------
    tree : bpy.types.NodeTree
        From `new`.
    matter : Matter
        What the ground is.
    up : (3,) floats
        World up in the ground's own space and units, of the length of one metre.
    span : Span
        In frames of the scene.
    soaking : (float, float)
        Of the hollows; see `core.after.weather_places.soaking_shares`.
    felt : bool
        Whether steps felt the weather: how deep they are below new snow is then not what the record has.
    """
    tree.nodes.clear()
    graph = NodeGraph(tree)
    group = graph.node("NodeGroupInput")
    said = {name: graph.number(group.outputs[name]) for name, *_ in INPUTS}
    course = CourseNodes(graph, said, matter, span, soaking)

    graph.next_row()
    pressed, since, compression = (graph.number(part) for part in graph.separated(_vector(graph, TIMES)))
    aged = course.since(since, course.of_places)
    share = _shares(graph, aged["variance"])
    relief = _relief(graph, up)
    snow, warmth, wind, rain, drying, _, seep, halo = course.acts.values()
    soft = relief + graph.number(graph.dot(_vector(graph, BLUR), share))
    if matter.blown:
        soft = soft * aged["kept"]
    trodden = _vector(graph, TRODDEN)
    begun = 1.0 - pressed.above(course.frame)
    inside = graph.number(graph.dot(trodden, graph.vector("MAXIMUM", share, (1.0, 0.0, 0.0)))).within_one() * begun

    lower = inside * aged["kept"] if matter.blown else inside  # what is blown full lies as high as open ground

    graph.next_row()
    cover = (course.around["cover"] + (aged["cover"] - course.around["cover"]) * lower).where(snow)
    height = (soft - relief).where(snow, warmth, wind, rain) + cover
    if matter.snow_depth:
        left = (soft + matter.snow_depth).at_least(0.0)
        ratio = (1.0 - compression * (1.0 / matter.snow_depth)).at_least(0.0)
        around, within = course.around["thawed"].at_most(left), (aged["thawed"] * ratio * ratio).at_most(left)
        height = (height - around - (within - around) * lower).where(warmth, otherwise=height)
    wetness = course.around["wet"]
    if matter.wet:
        wetness = (wetness + (aged["wet"] - wetness) * inside).where(drying, otherwise=1.0)
    seen = {HEIGHT: height, FRESH: (cover * (1.0 / COVERED)).within_one(), WETNESS: wetness}
    if matter.soaking:
        graph.next_row()
        water = _standing(graph, course, said["Water Table"] * 0.01, height).where(rain, seep)
        seen |= {HEIGHT: height + water, WETNESS: wetness.at_least(water.above(0.0)), WATER: water}
    if matter.blown:
        seen[KEPT] = aged["kept"]
    if felt and matter.snow_depth:
        seen[PRESSED] = compression * begun
    if matter.pales:
        near = graph.number(graph.dot(trodden, (NEAR,) * 3)).within_one() * begun
        seen[PALE] = (said["Halo"] * near * aged["pale"]).where(halo)
    graph.next_row()
    geometry = group.outputs["Geometry"]
    changed = _changed(graph, geometry, seen, course.acts, matter, up)
    graph.finish(graph.choose("GEOMETRY", course.is_any.above(0.0).socket, geometry, changed))


def _changed(
    graph: NodeGraph,
    geometry: Any,
    seen: Mapping[str, Number],
    acts: Mapping[str, Number],
    matter: Matter,
    up: Sequence[float],
) -> Any:
    """The geometry under weather; `acts` as those of the course."""
    # Before anything moves: all of it follows from where the playback has the vertices.
    together = (HEIGHT, WETNESS, WATER) if matter.soaking else (HEIGHT, FRESH, KEPT)
    geometry, seen = _worked_out(graph, geometry, seen, together)
    geometry = _with(graph, geometry, {FRESH: seen[FRESH]}, acts["Snowfall"])
    geometry = _with(graph, geometry, {WETNESS: seen[WETNESS]})
    if matter.wet:
        dried = (1.0 - seen[WETNESS]).at_least(seen.get(PALE, 0.0))
        geometry = _with(graph, geometry, {DRIED: dried}, acts["Drying"], acts["Halo"])
    if matter.soaking:  # the bake's own water stays
        water = graph.number(graph.attribute(WATER)).at_least(seen[WATER])
        geometry = _with(graph, geometry, {WATER: water}, acts["Rain"], acts["Water Table"])
    if PRESSED in seen:
        deep = graph.number(graph.attribute(COMPRESSION)).at_least(seen[PRESSED])
        geometry = _with(graph, geometry, {COMPRESSION: deep}, acts["Snowfall"])
    if matter.blown:  # what is blown full looks trodden no more
        blown = {name: graph.number(graph.attribute(name)) * seen[KEPT] for name in (COMPRESSION, RIM)}
        geometry = _with(graph, geometry, blown, acts["Wind"])
    return graph.forgotten(_moved(graph, geometry, up, seen[HEIGHT]), NOW)


def _worked_out(
    graph: NodeGraph, geometry: Any, values: Mapping[str, Number], together: Sequence[str]
) -> tuple[Any, dict[str, Number]]:
    """A geometry that keeps up to three numbers, and all, these as they are kept: they are not worked out again."""
    names = [name for name in together if name in values]
    pack = graph.combined(*(values[name].socket for name in names))
    parts = graph.separated(_vector(graph, NOW))
    known = {name: graph.number(part) for name, part in zip(names, parts, strict=False)}
    return graph.store(geometry, NOW, pack, True, "FLOAT_VECTOR"), {**values, **known}


def _with(graph: NodeGraph, geometry: Any, values: Mapping[str, Number], *acting: Number) -> Any:
    """A geometry with numbers of these names, if one of those that act, the same everywhere, is above 0."""
    changed = geometry
    for name, value in values.items():
        changed = graph.store(changed, name, value.socket, True)
    if not acting:
        return changed
    return graph.choose("GEOMETRY", sum(acting[1:], acting[0]).above(0.0).socket, geometry, changed)


def _moved(graph: NodeGraph, geometry: Any, up: Sequence[float], height: Number) -> Any:
    """A geometry that is higher by so much."""
    node = graph.node("GeometryNodeSetPosition")
    graph.link(geometry, node.inputs["Geometry"])
    graph.link(graph.scaled(tuple(up), height.socket), node.inputs["Offset"])
    return node.outputs["Geometry"]


def _standing(graph: NodeGraph, course: CourseNodes, table: Number, height: Number) -> Number:
    """Depth of water where the ground has changed by a height; `table` is how far below the brim it comes by itself."""
    capacity, above, left = (graph.number(part) for part in graph.separated(_vector(graph, POOL)))
    rises = [_vector(graph, name) for name in LEVELS]
    aged = course.since(graph.number(graph.separated(rises[1])[2]), course.of_hollows)
    excess = aged["low"] + (aged["high"] - aged["low"]) * course.between(left)
    filled = (excess / capacity).within_one().root() * KNOTS
    parts = []
    for rise, begin in zip(rises, ((0.0, 1.0, 2.0), (3.0, 4.0, NEVER_FULL)), strict=True):
        steps = graph.vector("SUBTRACT", filled.socket, begin)
        steps = graph.vector("MINIMUM", graph.vector("MAXIMUM", steps, (0.0,) * 3), (1.0,) * 3)
        parts.append(graph.number(graph.dot(steps, rise)))
    brim = graph.number(graph.dot(rises[0], (1.0,) * 3)) + graph.number(graph.dot(rises[1], (1.0, 1.0, 0.0)))
    seeped = ((brim - table).at_least(0.0) * aged["seeped"]).where(course.acts["Water Table"])
    level = (parts[0] + parts[1]).where(course.acts["Rain"]).at_least(seeped)
    return (level - above - height).at_least(0.0) * level.above(0.0)


def _vector(graph: NodeGraph, name: str) -> Any:
    return graph.attribute(name, "FLOAT_VECTOR")


def _shares(graph: NodeGraph, variance: Number) -> Any:
    """How far a variance is through each of the spans between `BOUNDS`, 0 to 1."""
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
