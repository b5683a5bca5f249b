"""What weather has done from any moment to now, as nodes: sums over parts of the time, on points that begin one each.

Rates are those of each part; within it every integral but that over the settling of its own layer is exact. A slider's
value is that of the group's input, or of a curve if it is keyed, for each part. What has happened since each of the
moments at which vertices were last stepped on is then between two of these sums, on points of their own: a thousand,
whatever the ground has of vertices. What is read more than once is kept with the points, as nodes that ask for it would
each have it worked out again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import sqrt
from typing import Any

from ...core.after import weather as w
from ...core.after.weather import MOMENTS, NO_WATER, PARTS, Span
from ...core.after.weather_places import LEAST_RANGE
from ..node_graph import NodeGraph, Number

CENTIMETRES_AN_HOUR, MILLIMETRES_AN_HOUR = 0.01 / w.HOUR, 0.001 / w.HOUR

SUMMED = ("Snowfall", "Temperature", "Wind", "Rain", "Drying", "Time Scale")
"""The inputs that are summed up over time, of which keys count."""
FIRST, STEP = "First Frame", "Frames in a Part"
"""Nodes with the span."""
KEYED = "Keyed Sliders"
"""Node with how many sliders are keyed: 0 is none."""
GAUSS = ((0.5 - sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + sqrt(0.15), 5 / 18))
"""Places and weights of the Gauss-Legendre rule of three points, over 0 to 1: how snow settles within a part."""
ENDLESS = 1e9
LOWEST = "lowest"
KEPT = {
    "look": ("cover", "variance", "wet"),
    "loss": ("filled", "thawed", "pale"),
    "hollows": ("low", "high", "seeped"),
}
"""What is kept of any moment, in vectors of these names: as `core.after.weather_course.Course` has it, but *filled* is
less than nothing by the share of a print that is blown full; excess at the *low* and the *high* share of soaking."""


def keys_of(name: str) -> str:
    """Name of the node with an input's value in each part."""
    return f"{name} Keys"


def switch_of(name: str) -> str:
    """Name of the node that says whether the input is keyed."""
    return f"{name} Is Keyed"


class PointTable:
    """Points that keep numbers, up to three in a vector."""

    def __init__(self, graph: NodeGraph, count: int) -> None:
        points = graph.node("GeometryNodePoints")
        graph.link(count, points.inputs["Count"])
        self._graph, self.geometry = graph, points.outputs[0]

    def keep(self, name: str, *numbers: Number) -> list[Number]:
        """The same numbers as they are kept."""
        pack = self._graph.combined(*(number.socket for number in numbers))
        self.geometry = self.with_vector(name, pack)
        return self._graph.parts(self._graph.attribute(name, "FLOAT_VECTOR"))[: len(numbers)]

    def with_vector(self, name: str, vector: Any) -> Any:
        """The points with a vector."""
        return self._graph.store(self.geometry, name, vector, True, "FLOAT_VECTOR")

    def at(self, name: str, index: Any) -> Any:
        """A vector that is kept with one of the points."""
        return self._graph.at_index(self.geometry, self._graph.attribute(name, "FLOAT_VECTOR"), index)


class CourseNodes:
    """What has happened since the parts began, and since the moments of vertices.

    What only a slider that is at zero would ask for is not worked out, unless any is keyed. `acts` tells by the names
    of sliders what may be above 0: warmth for *Temperature*. `around` has by the names of `KEPT` what has happened
    since the first frame, `aged` the same as fields of `moments`; the first of these is of what has not begun.

    Parameters
    ----------
    graph : NodeGraph
    said : mapping
        The group's inputs by name.
    matter : Matter
    span : Span
    soaking : (float, float)
        Least and largest share of its soaking that a hollow has left.
    """

    def __init__(
        self, graph: NodeGraph, said: Mapping[str, Number], matter: w.Matter, span: Span, soaking: tuple[float, float]
    ) -> None:
        self.graph, self._matter, self._soaking = graph, matter, soaking
        self.frame = graph.number(graph.node("GeometryNodeInputSceneTime").outputs["Frame"])
        self._first, self._step = self._value(FIRST, span.first), self._value(STEP, span.step)
        keyed, none = self._value(KEYED, 0.0), graph.number(0.0)
        self.acts = {name: said[name].at_least(0.0) + keyed for name in SUMMED}
        self.acts["Wind"] = self.acts["Wind"] if matter.blown else none
        self.acts["Water Table"] = (100.0 * NO_WATER - said["Water Table"]).at_least(0.0) if matter.soaking else none
        self.acts["Halo"] = said["Halo"] if matter.pales else none
        falling = [self.acts[name] for name in SUMMED if name != "Time Scale"]
        self.is_any = sum(falling[1:], falling[0]) * self.acts["Time Scale"]
        self.is_any = self.is_any + self.acts["Water Table"] + self.acts["Halo"]
        self._kept = [name for name in KEPT if matter.soaking or name != "hollows"]
        self._parts, self.moments = PointTable(graph, PARTS + 2), PointTable(graph, MOMENTS + 2)
        self._index = graph.number(graph.node("GeometryNodeInputIndex").outputs["Index"])
        self._through = (self._index * (1.0 / PARTS)).at_most(1.0)
        self._number = (self.frame - self._first) / self._step

        past = (self._number - self._index).at_least(0.0).at_most(self._index.above(PARTS - 0.5) * ENDLESS + 1.0)
        past = past * (1.0 - self._index.above(PARTS + 0.5))
        rates = {name: self._rate(name, said[name]) for name in SUMMED}
        (self._time,) = self._parts.keep("time", past * self._step * rates["Time Scale"] * (1.0 / span.frame_rate))
        self._sum(rates)
        self.around = self._named(lambda name: self._parts.at(name, 0))
        self.aged = self._since_moments(span)

    @property
    def begun(self) -> Number:
        """0 of the first of the moments, 1 of all others."""
        return self._index.above(0.5)

    def between(self, left: Number) -> Number:
        """How far a share of soaking is through those for which there are sums."""
        low, high = self._soaking
        return ((left - low) * (1.0 / max(high - low, LEAST_RANGE))).within_one()

    def _since_moments(self, span: Span) -> dict[str, Number]:
        """What has happened since the moments; what has not begun is as if it began now."""
        graph = self.graph
        graph.next_row()
        frame = (self._index - 1.0) * ((span.last - span.first) / MOMENTS) + span.first
        frame = (frame + (1.0 - self.begun) * ENDLESS).at_most(self.frame)
        number = ((frame - self._first) / self._step).at_least(0.0)
        part = number.floor().at_most(PARTS)
        through = ((number - part) / (self._number - part).at_most(1.0)).at_most(1.0)
        (part, through) = self.moments.keep("part", part, through)
        for name in self._kept:
            begin, end = (self._parts.at(name, one.socket) for one in (part, part + 1.0))
            more = graph.scaled(graph.vector("SUBTRACT", end, begin), through.socket)
            self.moments.geometry = self.moments.with_vector(name, graph.vector("ADD", begin, more))
        return self._named(lambda name: graph.attribute(name, "FLOAT_VECTOR"))

    def _named(self, vector_of: Callable[[str], Any]) -> dict[str, Number]:
        """The numbers of `KEPT` in vectors of these names."""
        named: dict[str, Number] = {}
        for name in self._kept:
            named |= zip(KEPT[name], self.graph.parts(vector_of(name)), strict=True)
        return named

    def _value(self, name: str, value: float) -> Number:
        node = self.graph.node("ShaderNodeValue", name=name, label=name)
        self.graph.link(value, node.outputs[0])
        return self.graph.number(node.outputs[0])

    def _rate(self, name: str, given: Number) -> Number:
        """An input, or what its keys say of each part."""
        graph = self.graph
        curve = graph.node("ShaderNodeFloatCurve", name=keys_of(name), label=keys_of(name))
        if curve.mapping.use_clip:
            curve.mapping.use_clip = False
        graph.link(self._through.socket, curve.inputs["Value"])
        chosen = graph.choose("FLOAT", False, given.socket, curve.outputs["Value"])
        if chosen.node.name != switch_of(name):
            chosen.node.name = chosen.node.label = switch_of(name)
        return graph.number(chosen)

    def _sum(self, rates: Mapping[str, Number]) -> None:
        """Keep with the parts what has happened from the beginning of each to now."""
        graph, matter, parts, time = self.graph, self._matter, self._parts, self._time
        graph.next_row()
        snow, warmth, wind, rain, drying = (self.acts[name] for name in SUMMED[:5])
        melting = warmth if matter.snow_depth else warmth * snow

        temperature = rates["Temperature"]
        density = w.new_snow_density(temperature)
        settling = (w.settling_rate(temperature) * time).where(snow)
        fallen = (rates["Snowfall"] * density * (CENTIMETRES_AN_HOUR / w.WATER_DENSITY) * time).where(snow)
        melted = (w.melting_rate(temperature) * time).where(warmth)
        rained = (rates["Rain"] * MILLIMETRES_AN_HOUR * time).where(rain)
        dried = (rates["Drying"] * MILLIMETRES_AN_HOUR * time).where(drying)
        drier = dried - rained - melted if matter.snow_depth else dried - rained
        flux = (w.blown_flux(rates["Wind"], matter.blown) * time).where(wind) if matter.blown else graph.number(0.0)
        gone = (melted if matter.snow_depth else fallen).where(melting)
        gained, settling, drier = parts.keep("balance", fallen - melted, settling, drier)
        density, rained, gone = parts.keep("fall", density.where(snow), rained, gone)

        sums = self._sums(gained, settling, drier)
        lowest, following = self._lowest(sums, warmth * snow + drying * (rain + warmth))
        reserve, *_ = graph.parts(sums.outputs["Trailing"])
        reserve_now, settled_now, water_now = graph.parts(sums.outputs["Total"])
        since = settled_now - graph.parts(sums.outputs["Leading"])[1]

        graph.next_row()
        depth = self._depth((following[0] - lowest[0]) * w.WATER_DENSITY, density, settling, since).where(snow)
        spread, filling = rained * w.RAIN_ROUNDING, graph.number(0.0)
        if matter.blown:
            spread = spread + w.spread_rate(flux, matter.blown)
            filling = w.fill_rate(flux, matter.section, matter.blown)
        cover, rounding, filled = self._to_now(*parts.keep("layers", depth, spread, filling))
        thawed = ((reserve - lowest[0]) * (w.WATER_DENSITY / w.SNOW.bulk_density)).where(warmth)
        wet = w.wetness(water_now - lowest[2]).where(drying, otherwise=1.0)
        if not matter.wet:
            got, lost, _ = graph.parts(self._sums(rained, gone).outputs["Total"])
            lying = 0.0 if matter.snow_depth else (reserve_now - lowest[0]).where(melting)
            wet = (wet * w.wetted(got + lost - lying)).where(rain, melting)

        graph.next_row()
        under = cover + thawed if matter.snow_depth else cover
        parts.keep("look", cover, under * w.DRAPE + rounding, wet)
        pale = none = graph.number(0.0)
        if soaking := matter.soaking:
            low, high, age = self._hollows(soaking, rained, rates["Rain"])
            parts.keep("hollows", low, high, w.seeped(age, soaking).where(self.acts["Water Table"]))
            pale = w.halo(age).where(self.acts["Halo"]) if matter.pales else none
        parts.keep("loss", (filled * -1.0).exp() - 1.0 if matter.blown else none, thawed, pale)

    def _depth(self, left: Number, density: Number, settling: Number, since: Number) -> Number:
        """Depth of the snow of each part [kg/m²] that settles within it, and from its end on."""
        first, second, third = (
            left * weight / w.settled_density(since + settling * (1.0 - at), density) for at, weight in GAUSS
        )
        return first + second + third

    def _hollows(self, soaking: w.Soaking, rained: Number, rain: Number) -> list[Number]:
        """Rain that has not soaked in at either share, and time, from each moment to now."""
        graph = self.graph
        sums = graph.accumulated((self._time * rain.above(0.0)).socket)
        begin, end = (w.soaked(graph.number(sums.outputs[name]), soaking) for name in ("Trailing", "Leading"))
        low, high = ((rained - (end - begin) * share).at_least(0.0) for share in self._soaking)
        acting = self.acts["Rain"]
        return self._to_now(*self._parts.keep("soaking", low.where(acting), high.where(acting), self._time))

    def _lowest(self, sums: Any, turns: Number) -> tuple[list[Number], list[Number]]:
        """The least of each sum from a moment on, and from the next one on; 0 is `turns` if none ever turns back."""
        graph, parts = self.graph, self._parts
        now = graph.vector("MINIMUM", sums.outputs["Trailing"], sums.outputs["Total"])
        at_an_end = parts.with_vector(LOWEST, now)
        first = parts.with_vector(LOWEST, sums.outputs["Trailing"])

        def doubled(lowest: Any, count: Number) -> tuple[Any, Number]:
            """From the least of so many points from each on to that of twice as many."""
            parts.geometry = lowest
            return parts.with_vector(LOWEST, graph.vector("MINIMUM", *self._ahead(count))), count + count

        turning = graph.repeated((PARTS + 1).bit_length(), first, 1.0, doubled)
        parts.geometry = graph.choose("GEOMETRY", turns.socket, at_an_end, turning)
        here, there = self._ahead(1.0)
        return graph.parts(here), graph.parts(there)

    def _ahead(self, count: Number | float) -> tuple[Any, Any]:
        """What is kept as the lowest at each point, and so many further on."""
        further = (self._index + count).socket
        return self.graph.attribute(LOWEST, "FLOAT_VECTOR"), self._parts.at(LOWEST, further)

    def _sums(self, *parts: Number) -> Any:
        """A node with sums of three numbers; see `NodeGraph.accumulated`."""
        return self.graph.accumulated(self.graph.combined(*(part.socket for part in parts)), "FLOAT_VECTOR")

    def _to_now(self, *parts: Number) -> list[Number]:
        """Sums of three numbers from each moment on."""
        outputs = self._sums(*parts).outputs
        return self.graph.parts(self.graph.vector("SUBTRACT", outputs["Total"], outputs["Trailing"]))
