"""Effect of weather from any moment to now, as nodes: sums over time, on points of their own that are its rows.

Rates are those of each part; within it every integral but that over the settling of its own layer is exact. A slider's
value is that of the group's input, or of a curve if it is keyed, for each part. Rows begin with the moments at which
vertices were last stepped on: a thousand, whatever the ground has of vertices. What is read more than once is kept with
them, as nodes that ask for it would each have it worked out again.

Where no slider is keyed, all this follows from an age. The add-on keeps a table of it for the values at which the
sliders are, and the nodes look there as long as these and the frame are among what the table has.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import sqrt
from typing import Any

from ...core.weather import weather as w
from ...core.weather.weather import MOMENTS, NO_WATER, PARTS, Span
from ...core.weather.weather_places import LEAST_RANGE
from ..nodes.node_graph import NodeGraph, Number

CENTIMETRES_AN_HOUR, MILLIMETRES_AN_HOUR = 0.01 / w.HOUR, 0.001 / w.HOUR

UNITS = {
    "Snowfall": CENTIMETRES_AN_HOUR,
    "Temperature": 1.0,
    "Wind": 1.0,
    "Rain": MILLIMETRES_AN_HOUR,
    "Drying": MILLIMETRES_AN_HOUR,
    "Time Scale": 1.0,
}
SUMMED = tuple(UNITS)
"""The inputs that are summed up over time, of which keys count, and their units."""
THREES = [SUMMED[first : first + 3] for first in range(0, len(SUMMED), 3)]
"""The same, as vectors hold them; the last may have room."""
FIRST, STEP = "First Frame", "Frames in a Part"
"""Nodes with the span."""
KEYED = "Keyed Sliders"
"""Node with how many sliders are keyed: 0 is none."""
TABLE, AGES = "Table", "Ages in the Table"
"""Nodes with the object that has what happened after each age, from 0 on, and with the last of these; none below 0.
What `SUMS` calls *look* is the position, which a mesh has in any case."""
HOLLOWS = "Hollows"
"""Node with the object that has what water needs to know of each hollow: *pool*, what it holds as a depth of water on
it [m], how much of its soaking is left and the number of the moment from which on it is there; *rise*, coefficients of
`core.weather.weather_places.WeatherPlaces.levels`."""
PER_FRAME = MOMENTS // PARTS
"""Ages in a frame: moments lie at multiples of it, as parts have whole frames."""
GAUSS = ((0.5 - sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + sqrt(0.15), 5 / 18))
"""Places and weights of the Gauss-Legendre rule of three points, over 0 to 1: how snow settles within a row."""
ROWS = MOMENTS + PARTS + 3
"""Of the table: one of what has not begun, the moments, as many parts behind them, and now."""
ENDLESS = 1e9
LOWEST = "lowest"
SUMS = {
    "look": ("cover", "variance", "wet"),
    "loss": ("filled", "thawed", "pale"),
    "hollows": ("low", "high", "seeped"),
}
"""Sums over time in each row, in vectors of these names: as `core.weather.weather_course.Course` has it, but *filled*
is less than nothing by the share of a print that is blown full; excess at the *low* and the *high* share of soaking."""


def field_of(name: str) -> str:
    """Name in `core.weather.weather_course.Weather` of an input."""
    return name.lower().replace(" ", "_")


def keys_of(name: str) -> str:
    """Name of the node with an input's value in each part."""
    return f"{name} Keys"


def tabled(number: int) -> str:
    """Name of the node that has three of the values of `SUMMED` that the table is for: the first or the last."""
    return f"Tabled Values {number}"


def switch_of(name: str) -> str:
    """Name of the node that says whether the input is keyed."""
    return f"{name} Is Keyed"


class CourseNodes:
    """Sums of weather since the first frame, and since the moments of vertices.

    What only a slider that is at zero would ask for is not worked out, unless any is keyed. `acts` tells by the names
    of sliders what may be above 0: warmth for *Temperature*. `around` has by the names of `SUMS` what has happened
    since the first frame, as far as it is asked for, `aged` the same as fields of `rows`; the first of these is of what
    has not begun, where `begun` is 0 and not 1.

    Parameters
    ----------
    said : mapping
        The group's inputs by name.
    soaking : (float, float)
        Least and largest share of its soaking that a hollow has left.
    table : bpy.types.Object
        See `TABLE`.
    """

    def __init__(
        self,
        graph: NodeGraph,
        said: Mapping[str, Number],
        matter: w.Matter,
        span: Span,
        soaking: tuple[float, float],
        table: Any,
    ) -> None:
        self.graph, self._matter, self._soaking = graph, matter, soaking
        self.frame = graph.number(graph.frame())
        self._first, self._step = self._value(FIRST, span.first), self._value(STEP, span.step)
        keyed, none = self._value(KEYED, 0.0), graph.number(0.0)
        self.acts = {name: said[name].at_least(0.0) + keyed for name in SUMMED}
        self.acts["Wind"] = self.acts["Wind"] if matter.drifts_from else none
        self.acts["Water Table"] = (100.0 * NO_WATER - said["Water Table"]).at_least(0.0) if matter.soaking else none
        self.acts["Halo"] = said["Halo"] if matter.pales else none
        falling = [self.acts[name] for name in SUMMED if name != "Time Scale"]
        self.is_any = sum(falling[1:], falling[0]) * self.acts["Time Scale"]
        self.is_any = self.is_any + self.acts["Water Table"] + self.acts["Halo"]
        self._melting = (
            self.acts["Temperature"] if matter.snow_depth else self.acts["Temperature"] * self.acts["Snowfall"]
        )

        self._index = graph.number(graph.node("GeometryNodeInputIndex").outputs["Index"])
        self.begun = self._index.above(0.5)
        ages = (self.frame - self._first).at_least(0.0) * PER_FRAME
        differs, last = self._differs(said, keyed, ages), self._value(AGES, -1.0)
        self.rows = graph.points(ROWS)
        past, part = self._past(span)
        self._through = (part * (1.0 / PARTS)).at_most(1.0)
        rates = {name: self._rate(name, said[name]) for name in SUMMED}
        self._density = w.new_snow_density(rates["Temperature"]).where(self.acts["Snowfall"])
        summed = self._sum(*self._amounts(rates, past * rates["Time Scale"] * (1.0 / span.frame_rate)))
        off, worked_out = (differs + ages.above(last)).socket, self.rows
        tabled = self._tabled(table, ages, span)
        self.rows = graph.choose("GEOMETRY", off, self.rows, worked_out)
        self._vectors = {
            name: graph.choose("VECTOR", off, *two) for name, *two in zip(SUMS, tabled, summed, strict=False)
        }
        look, loss, *_ = SUMS
        self.aged = self._named(lambda vector: vector, look, loss)
        self.around = self._named(
            lambda vector: graph.at_index(self.rows, vector, 1), *((look, loss) if matter.snow_depth else (look,))
        )

    def _differs(self, said: Mapping[str, Number], keyed: Number, ages: Number) -> Number:
        """Above 0 unless the sliders are at what the table is for, none keyed, and the frame is a whole age."""
        graph, differs = self.graph, keyed + ages.fraction()
        for number, three in enumerate(THREES):
            values = graph.combined(*(said[name].socket for name in three))
            apart = graph.vector("DISTANCE", values, (0.0,) * 3, output="Value")
            if apart.node.name != tabled(number):
                apart.node.name = apart.node.label = tabled(number)
            differs = differs + graph.number(apart)
        return differs

    def _tabled(self, table: Any, ages: Number, span: Span) -> list[Any]:
        """Values that the rows keep, from a table of ages; `ages` have gone by since the first frame."""
        graph = self.graph
        graph.next_row()
        geometry = graph.object_geometry(table, TABLE)

        def at(name: str, age: Number) -> Any:
            return graph.at_index(geometry, graph.attribute(name, "FLOAT_VECTOR"), age.socket)

        moments = (self._index - 1.0) * (span.step * PARTS / MOMENTS * PER_FRAME)
        age = ((ages - moments) * self.begun).at_least(0.0)
        self.rows = graph.points(MOMENTS + 2)
        vectors = [at(name, age) for name in ("position", "loss")]
        if self._matter.soaking:
            excess = graph.vector("SUBTRACT", at("hollows", ages), at("hollows", ages - age))
            seeped = graph.vector("MULTIPLY", at("hollows", age), (0.0, 0.0, 1.0))
            vectors.append(graph.vector("MULTIPLY_ADD", excess, (1.0, 1.0, 0.0), seeped))
        return self._keep(*(graph.number(vector) for vector in vectors))

    def between(self, remaining: Number) -> Number:
        """Place of a share of soaking among those for which there are sums."""
        low, high = self._soaking
        return ((remaining - low) * (1.0 / max(high - low, LEAST_RANGE))).within_one()

    def hollows(self, index: Any) -> list[Number]:
        """Excess at the low and the high share of soaking, and share that has seeped in, of a row."""
        return self.graph.parts(self.graph.at_index(self.rows, self._vectors["hollows"], index))

    def _past(self, span: Span) -> tuple[Number, Number]:
        """Frames of each row that are over, and number of the part in which it begins.

        The first has not begun. Then they begin with the moments, and with the parts behind those; the last but one
        never ends, and the last is now.
        """
        moment, behind = span.step * PARTS / MOMENTS, span.step * PARTS
        shift = (self.graph.number(behind) / self._step).floor() - MOMENTS
        now = (self.frame - self._first).at_least(0.0)

        def begin(row: Number) -> Number:
            within = row.at_most(MOMENTS) * moment
            within = within.at_least((row + shift) * self._step).at_least(0.0)
            return within + row.above(ROWS - 2.5) * ENDLESS

        first = begin(self._index - 1.0)
        return begin(self._index).at_most(now) - first.at_most(now), (first / self._step).floor()

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

    def _amounts(self, rates: Mapping[str, Number], time: Number) -> list[Any]:
        """Amounts that fall and go in each row, as vectors that the rows keep.

        The balance of snow, its settling, and what dries; rain, water of snow that melts, and time of rain; time, and
        by how much it spreads and fills prints.
        """
        graph, matter = self.graph, self._matter
        graph.next_row()
        snow, warmth, wind, rain, drying = (self.acts[name] for name in SUMMED[:5])
        fallen = (rates["Snowfall"] * self._density * (CENTIMETRES_AN_HOUR / w.WATER_DENSITY)).where(snow)
        melted = w.melting_rate(rates["Temperature"]).where(warmth)
        settling = w.settling_rate(rates["Temperature"]).where(snow)
        rained = (rates["Rain"] * MILLIMETRES_AN_HOUR).where(rain)
        dried = (rates["Drying"] * MILLIMETRES_AN_HOUR).where(drying)
        drier = dried - rained - melted if matter.snow_depth else dried - rained
        gone = (melted if matter.snow_depth else fallen).where(self._melting)
        spread, filling = rained * w.RAIN_ROUNDING, 0.0
        if matter.drifts_from:
            flux = w.blown_flux(rates["Wind"], matter.drifts_from).where(wind)
            spread = spread + w.spread_rate(flux, matter.density)
            filling = w.fill_rate(flux, matter.section, matter.density)
        each = ((fallen - melted, settling, drier), (rained, gone, rates["Rain"].above(0.0)), (1.0, spread, filling))
        return self._keep(*(graph.number(graph.scaled(self._pack(*three), time.socket)) for three in each))

    def _sum(self, balance: Any, falling: Any, acting: Any) -> list[Any]:
        """Sums from the beginning of each row to now, as vectors that the rows keep: see `_amounts`."""
        graph, matter = self.graph, self._matter
        snow, warmth, rain, drying = (self.acts[name] for name in ("Snowfall", "Temperature", "Rain", "Drying"))
        _, settling, _ = graph.parts(balance)
        rained, *_ = graph.parts(falling)
        time, spread, filling = graph.parts(acting)

        sums, fallen = (graph.accumulated(vector, "FLOAT_VECTOR") for vector in (balance, falling))
        lowest, following = self._lowest(sums, warmth * snow + drying * (rain + warmth))
        reserve_now, _, water_now = graph.parts(sums.outputs["Total"])
        reserve, *_ = graph.parts(sums.outputs["Trailing"])
        _, since, _ = graph.parts(graph.vector("SUBTRACT", sums.outputs["Total"], sums.outputs["Leading"]))
        lasting, *_ = graph.parts(graph.vector("SUBTRACT", following, lowest))
        least, _, least_water = graph.parts(lowest)

        graph.next_row()
        depth = self._depth(lasting * w.WATER_DENSITY, settling, since).where(snow)
        cover, rounding, filled = self._to_now(depth, spread, filling)
        thawed = ((reserve - least) * (w.WATER_DENSITY / self._matter.density) * self.begun).where(warmth)
        wet = w.wetness((water_now - least_water) * self.begun).where(drying, otherwise=1.0)
        if not matter.wet:
            got, lost, _ = graph.parts(fallen.outputs["Total"])
            lying = 0.0 if matter.snow_depth else (reserve_now - least).where(self._melting)
            wet = (wet * w.wetted(got + lost - lying)).where(rain, self._melting)

        graph.next_row()
        under = cover + thawed if matter.snow_depth else cover
        look = (cover, under * w.DRAPE + rounding, wet)
        loss = ((filled * -1.0).exp() - 1.0 if matter.drifts_from else 0.0, thawed)
        if not (soaking := matter.soaking):
            return self._keep(*(graph.number(self._pack(*three)) for three in (look, loss)))
        low, high, age = self._hollows(soaking, rained, fallen, time)
        pale = w.halo(age).where(self.acts["Halo"]) if matter.pales else 0.0
        hollows = (low, high, w.seeped(age, soaking).where(self.acts["Water Table"]))
        return self._keep(*(graph.number(self._pack(*three)) for three in (look, (*loss, pale), hollows)))

    def _named(self, of_rows: Callable[[Any], Any], *names: str) -> dict[str, Number]:
        """The numbers of some of the vectors of `SUMS`, from what is made of these."""
        named: dict[str, Number] = {}
        for name in names:
            named |= zip(SUMS[name], self.graph.parts(of_rows(self._vectors[name])), strict=True)
        return named

    def _pack(self, *numbers: Number | float) -> Any:
        """A vector of up to three numbers."""
        return self.graph.combined(*(number.socket if isinstance(number, Number) else number for number in numbers))

    def _keep(self, *vectors: Number) -> list[Any]:
        """Vectors as the rows keep them, all computed together."""
        self.rows, captured = self.graph.captured(self.rows, *vectors, kinds="VECTOR")
        return [vector.socket for vector in captured]

    def _depth(self, remaining: Number, settling: Number, since: Number) -> Number:
        """Depth of the snow of each row [kg/m²] that settles within it, and from its end on."""
        first, second, third = (
            self.graph.number(weight) / w.settled_density(since + settling * (1.0 - at), self._density)
            for at, weight in GAUSS
        )
        return remaining * (first + second + third)

    def _hollows(self, soaking: w.Soaking, rained: Number, falling: Any, time: Number) -> list[Number]:
        """Rain that has not soaked in at either share, and time, from each row on to now."""
        begin, end = (w.soaked(self.graph.parts(falling.outputs[name])[2], soaking) for name in ("Trailing", "Leading"))
        low, high = ((rained - (end - begin) * share).at_least(0.0) for share in self._soaking)
        acting = self.acts["Rain"]
        return self._to_now(low.where(acting), high.where(acting), time)

    def _lowest(self, sums: Any, turns: Number) -> list[Any]:
        """The least of each sum from a row on, and from the next one on; 0 is `turns` if none ever turns back."""
        graph, now = self.graph, sums.outputs["Total"]
        at_an_end = [graph.vector("MINIMUM", sums.outputs[name], now) for name in ("Trailing", "Leading")]
        lowest = graph.attribute(LOWEST, "FLOAT_VECTOR")

        def ahead(rows: Any, count: Number) -> Any:
            return graph.at_index(rows, lowest, (self._index + count).socket)

        def doubled(rows: Any, count: Number) -> tuple[Any, Number]:
            """From the least of so many rows from each on to that of twice as many."""
            lower = graph.vector("MINIMUM", lowest, ahead(rows, count))
            return graph.store(rows, LOWEST, lower, True, "FLOAT_VECTOR"), count + count

        first = graph.store(self.rows, LOWEST, at_an_end[0], True, "FLOAT_VECTOR")
        turning = graph.repeated(ROWS.bit_length(), first, 1.0, doubled)
        self.rows = graph.choose("GEOMETRY", turns.socket, self.rows, turning)
        turned = [lowest, ahead(turning, graph.number(1.0))]
        return [graph.choose("VECTOR", turns.socket, *two) for two in zip(at_an_end, turned, strict=True)]

    def _to_now(self, *parts: Number) -> list[Number]:
        """Sums of three numbers from each row on, nothing of what has not begun."""
        graph, sums = self.graph, self.graph.accumulated(self._pack(*parts), "FLOAT_VECTOR").outputs
        since = graph.vector("SUBTRACT", sums["Total"], sums["Trailing"])
        return graph.parts(graph.scaled(since, self.begun.socket))
