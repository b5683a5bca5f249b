"""What weather has done from any moment to now, as nodes: sums over parts of the time, on points that begin one each.

Rates are those of each part; within it every integral but that over the settling of its own layer is exact. Points are
a few hundred, whatever the ground has of vertices. Each of these looks up what has happened since it was stepped on. A
slider's value is that of the group's input, or of a curve if it is keyed, for each part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from typing import Any

from ...core.after import weather as w
from ...core.after.weather import NO_WATER, PARTS, Span
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


def keys_of(name: str) -> str:
    """Name of the node with an input's value in each part."""
    return f"{name} Keys"


def switch_of(name: str) -> str:
    """Name of the node that says whether the input is keyed."""
    return f"{name} Is Keyed"


class CourseNodes:
    """What has happened since the points' moments, and since those of vertices.

    What only a slider that is at zero would ask for is not worked out, unless any is keyed. `acts` tells by the names
    of sliders what may be above 0: warmth for *Temperature*.

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
        points = graph.node("GeometryNodePoints")
        points.inputs["Count"].default_value = PARTS + 2
        self._points = points.outputs[0]
        self._kept: dict[str, Any] = {}
        self._index = graph.number(graph.node("GeometryNodeInputIndex").outputs["Index"])
        self._number = (self.frame - self._first) / self._step

        past = (self._number - self._index).at_least(0.0).at_most(self._index.above(PARTS - 0.5) * ENDLESS + 1.0)
        past = past * (1.0 - self._index.above(PARTS + 0.5))
        rates = {name: self._rate(name, said[name]) for name in SUMMED}
        self._time = past * self._step * rates["Time Scale"] * (1.0 / span.frame_rate)
        self._sum(said, rates)

    def since(self, frame: Number, packed: Mapping[str, tuple[str, int]]) -> dict[str, Number]:
        """What has happened since frames of the vertices; what has not begun is as if it began now."""
        graph = self.graph
        number = ((frame.at_most(self.frame) - self._first) / self._step).at_least(0.0)
        part = number.floor().at_most(PARTS)
        through = ((number - part) / (self._number - part).at_most(1.0)).at_most(1.0)
        looked_up = {}
        for name in dict.fromkeys(stored for stored, _ in packed.values()):
            value = graph.attribute(name, "FLOAT_VECTOR")
            begin, end = (graph.at_index(self._kept[name], value, one.socket) for one in (part, part + 1.0))
            more = graph.scaled(graph.vector("SUBTRACT", end, begin), through.socket)
            looked_up[name] = graph.separated(graph.vector("ADD", begin, more))
        return {key: self._needed(key, graph.number(looked_up[name][place])) for key, (name, place) in packed.items()}

    def between(self, left: Number) -> Number:
        """How far a share of soaking is through those for which there are sums."""
        low, high = self._soaking
        return ((left - low) * (1.0 / max(high - low, LEAST_RANGE))).within_one()

    def _value(self, name: str, value: float) -> Number:
        node = self.graph.node("ShaderNodeValue")
        node.name = node.label = name
        node.outputs[0].default_value = value
        return self.graph.number(node.outputs[0])

    def _rate(self, name: str, given: Number) -> Number:
        """An input, or what its keys say of each part."""
        graph = self.graph
        curve = graph.node("ShaderNodeFloatCurve")
        curve.name = curve.label = keys_of(name)
        curve.mapping.use_clip = False
        graph.link((self._index * (1.0 / PARTS)).at_most(1.0).socket, curve.inputs["Value"])
        chosen = graph.choose("FLOAT", False, given.socket, curve.outputs["Value"])
        chosen.node.name = chosen.node.label = switch_of(name)
        return graph.number(chosen)

    def _sum(self, said: Mapping[str, Number], rates: Mapping[str, Number]) -> None:
        graph, matter, time = self.graph, self._matter, self._time
        graph.next_row()
        snow, warmth, wind, rain, drying = (self.acts[name] for name in SUMMED[:5])
        self._melting = warmth if matter.snow_depth else warmth * snow
        drying_and_wetting = drying * (rain + warmth)

        temperature = rates["Temperature"]
        density = w.new_snow_density(temperature)
        settling = (w.settling_rate(temperature) * time).where(snow)
        fallen = rates["Snowfall"] * density * (CENTIMETRES_AN_HOUR / w.WATER_DENSITY) * time
        fallen, melted = fallen.where(snow), (w.melting_rate(temperature) * time).where(warmth)
        rained = (rates["Rain"] * MILLIMETRES_AN_HOUR * time).where(rain)
        dried = (rates["Drying"] * MILLIMETRES_AN_HOUR * time).where(drying)
        drier = dried - rained - melted if matter.snow_depth else dried - rained

        sums = graph.accumulated(
            graph.combined((fallen - melted).socket, settling.socket, drier.socket), "FLOAT_VECTOR"
        )
        lowest, following = self._lowest(sums, warmth * snow + drying_and_wetting)
        reserve, *_ = self._parts(sums.outputs["Trailing"])
        reserve_now, settled_now, water_now = self._parts(sums.outputs["Total"])
        since = settled_now - self._parts(sums.outputs["Leading"])[1]

        graph.next_row()
        depth = self._depth((following[0] - lowest[0]) * w.WATER_DENSITY, density, settling, since).where(snow)
        spread, filling = rained * w.RAIN_ROUNDING, graph.number(0.0)
        if matter.blown:
            flux = (w.blown_flux(rates["Wind"], matter.blown) * time).where(wind)
            spread = spread + w.spread_rate(flux, matter.blown)
            filling = w.fill_rate(flux, matter.section, matter.blown)
        cover, rounding, filled = self._to_now(depth, spread, filling)
        cover, rounding = cover.where(snow), rounding.where(rain, wind)
        thawed = ((reserve - lowest[0]) * (w.WATER_DENSITY / w.SNOW.bulk_density)).where(warmth)
        wet = w.wetness(water_now - lowest[2]).where(drying, otherwise=1.0)
        got, gone, _ = self._totals(rained, melted if matter.snow_depth else fallen)
        if not matter.snow_depth:
            gone = gone - (reserve_now - lowest[0])
        if not matter.wet:
            wet = wet * w.wetted(got + gone.where(self._melting))

        graph.next_row()
        under = cover + thawed if matter.snow_depth else cover
        aged = {"cover": cover, "variance": under * w.DRAPE + rounding, "wet": wet}
        if matter.blown:
            aged["kept"] = (filled * -1.0).exp()
        if matter.snow_depth:
            aged["thawed"] = thawed
        self._keep(aged, rained, rates["Rain"])

    def _keep(self, aged: dict[str, Number], rained: Number, rain: Number) -> None:
        """Keep with the points what vertices look up."""
        of_hollows: dict[str, Number] = {}
        if soaking := self._matter.soaking:
            low, high, age = self._hollows(rained, rain, soaking)
            of_hollows = {"low": low, "high": high, "seeped": w.seeped(age, soaking)}
            if self._matter.pales:
                aged["pale"] = w.halo(age)
        self.of_places = self._stored("place", aged)
        self.of_hollows = self._stored("hollow", of_hollows)
        self.around = {key: self._at_first(key, packed) for key, packed in self.of_places.items()}

    def _needed(self, key: str, number: Number) -> Number:
        """What vertices look up by this name, or what it is while the sliders that it follows are at nothing."""
        snow, warmth, wind, rain, drying = (self.acts[name] for name in SUMMED[:5])
        follows: dict[str, tuple[Number, ...]] = {
            "cover": (snow,),
            "variance": (snow, warmth, wind, rain),
            "thawed": (warmth,),
            "kept": (wind,),
            "wet": (drying,) if self._matter.wet else (rain, self._melting),
            "low": (rain,),
            "high": (rain,),
            "seeped": (self.acts["Water Table"],),
            "pale": (self.acts["Halo"],),
        }
        is_whole = key == "kept" or (key == "wet" and self._matter.wet)
        return number.where(*follows[key], otherwise=1.0 if is_whole else 0.0)

    def _depth(self, left: Number, density: Number, settling: Number, since: Number) -> Number:
        """Depth of the snow of each part [kg/m²] that settles within it, and from its end on."""
        first, second, third = (
            left * weight / w.settled_density(since + settling * (1.0 - at), density) for at, weight in GAUSS
        )
        return first + second + third

    def _hollows(self, rained: Number, rain: Number, soaking: w.Soaking) -> list[Number]:
        """Rain that has not soaked in at either share, and time, from each moment to now."""
        graph = self.graph
        sums = graph.accumulated((self._time * rain.above(0.0)).socket)
        begin, end = (w.soaked(graph.number(sums.outputs[name]), soaking) for name in ("Trailing", "Leading"))
        low, high = ((rained - (end - begin) * share).at_least(0.0) for share in self._soaking)
        return self._to_now(low, high, self._time)

    def _lowest(self, sums: Any, turns: Number) -> tuple[list[Number], list[Number]]:
        """The least of each sum from a moment on, and from the next one on; 0 is `turns` if none ever turns back."""
        graph, trailing = self.graph, sums.outputs["Trailing"]
        at_an_end = graph.vector("MINIMUM", trailing, sums.outputs["Total"])
        straight = graph.store(self._points, LOWEST, at_an_end, True, "FLOAT_VECTOR")
        self._points = graph.store(self._points, LOWEST, trailing, True, "FLOAT_VECTOR")
        ahead = 1
        while ahead < PARTS + 2:
            graph.next_row()
            here, there = self._ahead(ahead)
            lower = graph.vector("MINIMUM", here, there)
            self._points = graph.store(self._points, LOWEST, lower, True, "FLOAT_VECTOR")
            ahead *= 2
        self._points = graph.choose("GEOMETRY", turns.above(0.0).socket, straight, self._points)
        here, there = self._ahead(1)
        return self._parts(here), self._parts(there)

    def _ahead(self, count: int) -> tuple[Any, Any]:
        """What is stored as the lowest at each point, and so many further on."""
        stored = self.graph.attribute(LOWEST, "FLOAT_VECTOR")
        return stored, self.graph.at_index(self._points, stored, (self._index + float(count)).socket)

    def _to_now(self, *parts: Number) -> list[Number]:
        """Sums of up to three numbers from each moment on."""
        graph = self.graph
        sums = graph.accumulated(graph.combined(*(part.socket for part in parts)), "FLOAT_VECTOR")
        return self._parts(graph.vector("SUBTRACT", sums.outputs["Total"], sums.outputs["Trailing"]))

    def _totals(self, *parts: Number) -> list[Number]:
        """Sums of up to three numbers over all."""
        sums = self.graph.accumulated(self.graph.combined(*(part.socket for part in parts)), "FLOAT_VECTOR")
        return self._parts(sums.outputs["Total"])

    def _parts(self, vector: Any) -> list[Number]:
        return [self.graph.number(part) for part in self.graph.separated(vector)]

    def _stored(self, name: str, values: Mapping[str, Number]) -> dict[str, tuple[str, int]]:
        """Keep numbers with the points, three in a vector; where each is."""
        kept: dict[str, tuple[str, int]] = {}
        keys: Sequence[str] = list(values)
        for begin in range(0, len(keys), 3):
            stored, together = f"{name}_{begin // 3}", keys[begin : begin + 3]
            pack = self.graph.combined(*(self._needed(key, values[key]).socket for key in together))
            self._kept[stored] = self.graph.store(self._points, stored, pack, True, "FLOAT_VECTOR")
            kept |= {key: (stored, place) for place, key in enumerate(together)}
        return kept

    def _at_first(self, key: str, packed: tuple[str, int]) -> Number:
        """A kept number since the first frame."""
        name, place = packed
        value = self.graph.at_index(self._kept[name], self.graph.attribute(name, "FLOAT_VECTOR"), 0)
        return self._needed(key, self.graph.number(self.graph.separated(value)[place]))
