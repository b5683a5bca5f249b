"""The node group of weather over a bake, behind the playback's.

z = rest + kept·relief(sigma) + level. The level is that of untouched ground, which the weather has acted on from the
start, and in a print that since it was made; relief and bounds of prints lose their edges as variances add up.

Native Blender data that needs nothing of this add-on. All that follows from a vertex's last contact alone is worked out
for each moment of `weather_course_nodes`, of which the vertex has the number. What is left for each vertex is linear in
what `core.weather.weather_places` found.

Where a ground has regions, there is such a group for each that takes weather in its own way, one behind the other, and
each changes its own vertices alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import bpy

from ...core.numerics.slices import Slices, sliced
from ...core.weather import weather as w
from ...core.weather.weather import Matter, Span
from ...core.weather.weather_places import BOUNDS, COVERED, NEAR, POWERS
from ..nodes import node_graph
from ..nodes.node_graph import NodeGraph, Number
from ..nodes.node_modifiers import add_sockets
from . import weather_table
from .playback_nodes import COMPRESSION, MOVED, REST, RIM
from .weather_course_nodes import ENDLESS, HOLLOWS, TABLE, CourseNodes
from .weather_inputs import INPUTS, hold

WITHIN = "SoftGround Weather Nodes"
"""The group that has the nodes. Of a modifier's own group, Blender notes the values of all sockets at each frame."""

BLUR, TRODDEN = "softground_weather_blur", "softground_weather_trodden"
PRESSED, MOMENT, COMPACTED = (
    "softground_weather_pressed",
    "softground_weather_moment",
    "softground_weather_compacted",
)
"""Frame of the first contact; number of the last one's end among the moments, 0 where there is none; what steps
compressed, on snow alone [m]."""
AGAIN, BEFORE, BLUR_BEFORE = (
    "softground_weather_again",
    "softground_weather_before",
    "softground_weather_blur_before",
)
"""First frame of the last step into an earlier print, and moment and blur that hold until then; only where there are
such steps."""
HOLLOW, ABOVE = "softground_weather_hollow", "softground_weather_above"
"""Number of the hollow among those of `weather_course_nodes.HOLLOWS`, 0 where there is none; how far the undisturbed
ground is above its bottom [m]."""
REGION = "softground_weather_region"
"""Number of the group within that changes the vertex; only where there are several."""
OF_WEATHER = {
    REGION: "INT",
    BLUR: "FLOAT_VECTOR",
    TRODDEN: "FLOAT_VECTOR",
    PRESSED: "FLOAT",
    MOMENT: "INT",
    COMPACTED: "FLOAT",
    AGAIN: "FLOAT",
    BEFORE: "INT",
    BLUR_BEFORE: "FLOAT_VECTOR",
    HOLLOW: "INT",
    ABOVE: "FLOAT",
}
"""Types of these attributes of a mesh, by their names."""

WETNESS, FRESH, WATER, DRIED = "softground_wetness", "softground_fresh", "softground_water", "softground_dried"
BLOWN, RAISED = "softground_blown", "softground_raised"
"""What the group stores for materials: how wet the ground looks and how much of it new snow covers, 0 to 1; depth of
standing water [m]; how dry it looks where it was wet to begin with, and how much of a print blown sand or snow covers,
0 to 1; and for what stands on the ground, how much higher that is under new snow [m]."""

Part = tuple[Matter, tuple[float, float]]
"""What a region is, and least and largest share of its soaking that its hollows have left; see
`core.weather.weather_places.soaking_shares`."""


def groups_within(tree: Any) -> list[Any]:
    """The groups in a group of weather that have its nodes, one for each region; none where nothing is in it yet."""
    return [node.node_tree for node in tree.nodes if node.bl_idname == "GeometryNodeGroup" and node.node_tree]


def within(tree: Any) -> Any:
    """The first of `groups_within`; None without any."""
    return next(iter(groups_within(tree)), None)


@sliced
def build(
    tree: Any,
    parts: Sequence[Part],
    *,
    up: Sequence[float],
    span: Span,
    felt: bool = False,
    again: bool = False,
    has_water: bool = True,
) -> Slices[None]:
    """Fill a group, in place of what is in it; its inputs stay. See `node_graph.build`.

    Parameters
    ----------
    tree : bpy.types.NodeTree
        From `new`.
    parts : sequence of Part
        What the regions of the ground are, by their numbers; at least one.
    up : (3,) floats
        World up in the ground's own space and units, of the length of one metre.
    span : Span
        In frames of the scene.
    felt : bool
        True if steps felt the weather: how deep they are below new snow is then not what the record has.
    again : bool
        True if there are steps into earlier prints.
    has_water : bool
        True if the bake itself has water in prints.
    """
    before = groups_within(tree)
    inners = before[: len(parts)]
    try:
        for number, part in enumerate(parts):
            if number == len(inners):
                inners.append(bpy.data.node_groups.new(WITHIN, "GeometryNodeTree"))
                add_sockets(inners[-1], INPUTS)
            fill = partial(
                _fill,
                part=part,
                number=number if len(parts) > 1 else None,
                up=up,
                span=span,
                felt=felt,
                again=again,
                has_water=has_water,
            )
            yield from _build_within.slices(inners[number], part, span, fill)
        yield from node_graph.build.slices(tree, partial(hold, inners=inners))
    except BaseException:
        remove_unused(inners[len(before) :])
        raise
    remove_unused(before[len(parts) :])


@sliced
def _build_within(inner: Any, part: Part, span: Span, fill: Callable[..., None]) -> Slices[None]:
    """Fill a group within, with the tables that its nodes look up."""
    matter, soaking = part
    existing = {name: weather_table.named(inner, name) for name in weather_table.TABLES}
    asked = (TABLE, HOLLOWS) if matter.soaking else (TABLE,)
    tables = {name: existing[name] or weather_table.new() for name in asked}
    weather_table.describe(inner, matter, span, soaking)
    try:
        yield from node_graph.build.slices(inner, partial(fill, tables=tables))
    finally:
        weather_table.remove_unused({*existing.values(), *tables.values()})


def remove_unused(inners: Iterable[Any]) -> None:
    """Remove those of some groups within that nothing uses any more, with their tables."""
    for inner in inners:
        if not inner.users:
            tables = [weather_table.named(inner, name) for name in weather_table.TABLES]
            bpy.data.node_groups.remove(inner)
            weather_table.remove_unused(tables)


def _fill(
    graph: NodeGraph,
    *,
    part: Part,
    number: int | None,
    up: Sequence[float],
    span: Span,
    felt: bool,
    again: bool,
    has_water: bool,
    tables: Mapping[str, Any],
) -> None:
    """Make the nodes of a group; see `build`. `number` is that of its vertices, None where they are all its own."""
    matter, soaking = part
    group = graph.node("NodeGroupInput")
    said = {name: graph.number(group.outputs[name]) for name, *_ in INPUTS}
    course = CourseNodes(graph, said, matter, span, soaking, tables[TABLE])
    hollows = tables.get(HOLLOWS)
    ground = _Vertices(graph, course, matter, up, number, again=again, has_water=has_water, hollows=hollows)

    graph.next_row()
    geometry = group.outputs["Geometry"]
    changed = ground.pressed(geometry) if felt and matter.snow_depth else geometry
    changed = ground.moved(changed, said["Water Table"] * 0.01)
    if matter.wet:
        changed = ground.dried(changed, said["Halo"])
    graph.finish(graph.choose("GEOMETRY", course.is_any.socket, geometry, changed))


class _Vertices:
    """Vertices as the weather makes them.

    Parameters
    ----------
    up : (3,) floats
        See `build`.
    number : int or None
        See `_fill`.
    again, has_water : bool
        See `build`.
    hollows : bpy.types.Object or None
        Where water stands; see `weather_course_nodes.HOLLOWS`.
    """

    def __init__(
        self,
        graph: NodeGraph,
        course: CourseNodes,
        matter: Matter,
        up: Sequence[float],
        number: int | None,
        *,
        again: bool,
        has_water: bool,
        hollows: Any,
    ) -> None:
        self._is_one_of_several = number is not None
        self._mine: Any = True
        if number is not None:
            self._mine = graph.compare("EQUAL", graph.attribute(REGION, "INT"), float(number))
        self._graph, self._course, self._matter, self._up = graph, course, matter, tuple(up)
        self._has_water, self._hollows = has_water, hollows
        self._acts = course.acts
        not_yet = graph.compare("LESS_THAN", course.frame.socket, graph.attribute(PRESSED))
        self._moment, self._blur = graph.attribute(MOMENT, "INT"), graph.attribute(BLUR, "FLOAT_VECTOR")
        if again:
            before = graph.compare("LESS_THAN", course.frame.socket, graph.attribute(AGAIN))
            self._moment = graph.choose("INT", before, self._moment, graph.attribute(BEFORE, "INT"))
            self._blur = graph.choose("VECTOR", before, self._blur, graph.attribute(BLUR_BEFORE, "FLOAT_VECTOR"))
        self._moment_if_begun = graph.choose("INT", not_yet, self._moment, 0)
        self._share = _shares(graph, course.aged["variance"])
        _, wider, widest = graph.parts(self._share)
        self._inside = graph.combined(
            *(blur.socket for blur in (course.begun, wider * course.begun, widest * course.begun))
        )
        self._kept = course.aged["filled"] + 1.0
        self._trodden = graph.attribute(TRODDEN, "FLOAT_VECTOR")

    def pressed(self, geometry: Any) -> Any:
        """The geometry as deep as steps that felt weather have pressed new snow."""
        graph = self._graph
        begun = graph.number(self._moment_if_begun).at_most(1.0)
        deep = graph.number(graph.attribute(COMPACTED)) * begun
        deep = graph.number(graph.attribute(COMPRESSION)).at_least(deep)
        return self._with(geometry, {COMPRESSION: deep}, self._acts["Snowfall"])

    def moved(self, geometry: Any, table: Number) -> Any:
        """The geometry as high as the weather has it, under new snow and water, looking no more trodden than it is.

        `table` is how far below the brims of hollows water comes by itself [m].
        """
        graph, acts, matter = self._graph, self._acts, self._matter
        rounded, relief = self._rounded(), self._relief()
        cover = self._around("cover", self._not_full(self._inside))
        change = rounded.where(acts["Snowfall"], acts["Temperature"], acts["Rain"])
        worn: dict[str, Number] = {}
        if matter.drifts_from:
            filled = self._number(self._course.aged["filled"], self._moment)
            change = (rounded + relief * filled).where(acts["Wind"], otherwise=change)
            pressed, risen = (graph.number(graph.attribute(name)) for name in (COMPRESSION, RIM))
            remaining = filled + 1.0
            worn = dict(zip((COMPRESSION, RIM), w.worn(pressed * remaining, risen * remaining, rounded), strict=True))
            worn[BLOWN] = (pressed * filled * (-1.0 / COVERED)).within_one()
        height = raised = change + cover.where(acts["Snowfall"])
        if matter.snow_depth:
            # Vertices that the user adds have no place at rest.
            remaining = relief * graph.number(graph.attribute(MOVED, "BOOLEAN")) + change
            height = height - self._thawed((remaining + matter.snow_depth).at_least(0.0)).where(acts["Temperature"])
        fresh = (cover * (1.0 / COVERED)).within_one()
        floods = acts["Rain"] + acts["Water Table"]
        standing = [self._standing(table, relief + height).where(floods)] if matter.soaking else []
        # Once and together, as each node works out all that it asks for anew.
        values = height, fresh, raised, *standing, *worn.values()
        geometry, (height, fresh, raised, *others) = graph.captured(geometry, *values)
        standing, looks = others[: len(standing)], others[len(standing) :]
        if worn:
            # What takes the place of another is copied.
            blown = geometry if self._is_one_of_several else graph.forgotten(geometry, COMPRESSION, RIM)
            for name, look in zip(worn, looks, strict=True):
                blown = graph.store(blown, name, look.socket, self._mine)
            geometry = graph.choose("GEOMETRY", acts["Wind"].socket, geometry, blown)
        geometry = self._with(geometry, {FRESH: fresh, RAISED: raised}, acts["Snowfall"])
        wetness = self._course.around["wet"]
        if matter.wet:
            wetness = self._around("wet", self._inside).where(acts["Drying"], otherwise=1.0)
        dry = graph.store(geometry, WETNESS, wetness.socket, self._mine)
        if not standing:
            return graph.put_higher(dry, self._up, height.socket, self._mine)
        depth = deepest = standing[0]
        if self._has_water:  # which stays
            deepest = graph.number(graph.attribute(WATER)).at_least(depth)
        wet = graph.store(geometry, WATER, deepest.socket, self._mine)
        wet = graph.store(wet, WETNESS, wetness.at_least(depth.above(0.0)).socket, self._mine)
        geometry = graph.choose("GEOMETRY", floods.socket, dry, wet)
        return graph.put_higher(geometry, self._up, (height + depth.where(floods)).socket, self._mine)

    def dried(self, geometry: Any, halo: Number) -> Any:
        """The geometry with how dry ground looks that is wet to begin with."""
        graph, acts = self._graph, self._acts
        dried = 1.0 - graph.number(graph.attribute(WETNESS))
        if self._matter.pales:
            near = graph.number(graph.dot(self._trodden, (NEAR,) * 3)).within_one()
            pale = self._number(self._course.aged["pale"] * self._course.begun, self._moment_if_begun)
            dried = dried.at_least((halo * near * pale).where(acts["Halo"]))
        return self._with(geometry, {DRIED: dried}, acts["Drying"], acts["Halo"])

    def _rounded(self) -> Number:
        """Change of height by edges that are lost [m]."""
        return self._dot(self._blur, self._not_full(self._share), self._moment)

    def _standing(self, table: Number, relief: Number) -> Number:
        """Depth of water in hollows of a relief [m]."""
        graph = self._graph
        hollows = graph.object_geometry(self._hollows, HOLLOWS)
        level = graph.at_index(hollows, self._levels(table).socket, graph.attribute(HOLLOW, "INT"), "FLOAT")
        return (graph.number(level) - graph.number(graph.attribute(ABOVE)) - relief).at_least(0.0)

    def _levels(self, table: Number) -> Number:
        """Height of the water in each of the hollows over its bottom [m], far below it in a dry one."""
        graph, course = self._graph, self._course
        capacity, remaining, filled = graph.parts(graph.attribute("pool", "FLOAT_VECTOR"))
        rise = graph.attribute("rise", "FLOAT_VECTOR")
        low, high, seeped = course.hollows(filled.socket)
        excess = low + (high - low) * course.between(remaining)
        share = (excess / capacity).within_one()
        root = share.root()
        powers = graph.combined(*(power.socket for power in (root, share, share * root)))
        brim = graph.number(graph.dot(rise, (1.0,) * POWERS))
        risen = ((brim - table).at_least(0.0) * seeped).where(self._acts["Water Table"])
        level = graph.number(graph.dot(rise, powers)).where(self._acts["Rain"]).at_least(risen)
        return level - (1.0 - level.above(0.0)) * ENDLESS

    def _thawed(self, remaining: Number) -> Number:
        """Melted depth of snow, at most the depth that would remain without thaw [m]."""
        graph, depth = self._graph, self._matter.snow_depth
        ratio = (1.0 - graph.number(graph.attribute(COMPACTED)) * (1.0 / depth)).at_least(0.0)
        around = self._course.around["thawed"].at_most(remaining)
        within = (self._number(self._course.aged["thawed"], self._moment) * ratio * ratio).at_most(remaining)
        return around + (within - around) * self._dot(
            self._trodden, self._not_full(self._inside), self._moment_if_begun
        )

    def _not_full(self, vector: Any) -> Any:
        """A vector of the moments by the share of prints that is not blown full."""
        return self._graph.scaled(vector, self._kept.socket) if self._matter.drifts_from else vector

    def _around(self, name: str, inside: Any) -> Number:
        """What it is of open ground, and in prints since they were made."""
        around = self._course.around[name]
        more = self._graph.scaled(inside, (self._course.aged[name] - around).socket)
        return around + self._dot(self._trodden, more, self._moment_if_begun)

    def _dot(self, stored: Any, of_moments: Any, moment: Any) -> Number:
        """A vector of the vertices by one that belongs to their moments."""
        looked_up = self._graph.at_index(self._course.rows, of_moments, moment)
        return self._graph.number(self._graph.dot(stored, looked_up))

    def _number(self, value: Number, moment: Any) -> Number:
        """A number of the vertices' moments."""
        moments = self._course.rows
        return self._graph.number(self._graph.at_index(moments, value.socket, moment, "FLOAT"))

    def _relief(self) -> Number:
        """Height of a vertex over its place at rest [m]."""
        graph, up = self._graph, self._up
        moved = graph.vector("SUBTRACT", graph.position(), graph.attribute(REST, "FLOAT_VECTOR"))
        metre = sum(part * part for part in up)
        return graph.number(graph.dot(moved, tuple(part / metre for part in up)))

    def _with(self, geometry: Any, values: Mapping[str, Number], *acting: Number) -> Any:
        """A geometry with numbers of these names, if one of those that act, the same everywhere, is above 0."""
        graph, changed = self._graph, geometry
        for name, value in values.items():
            changed = graph.store(changed, name, value.socket, self._mine)
        return graph.choose("GEOMETRY", sum(acting[1:], acting[0]).socket, geometry, changed)


def _shares(graph: NodeGraph, variance: Number) -> Any:
    """Part of each span between `BOUNDS` that a variance is through, 0 to 1."""
    spans = [high - low for low, high in pairwise(BOUNDS)]
    factors = tuple(1.0 / span for span in spans)
    offsets = tuple(-low / span for low, span in zip(BOUNDS[:-1], spans, strict=True))
    return _within_one(graph, graph.vector("MULTIPLY_ADD", variance.socket, factors, offsets))


def _within_one(graph: NodeGraph, vector: Any) -> Any:
    return graph.vector("MINIMUM", graph.vector("MAXIMUM", vector, (0.0,) * 3), (1.0,) * 3)
