"""The node group that lets debris fly: each point's birth and first speed in, where it is at the time out.

It is native Blender data and needs nothing of this add-on; the closed form is that of `core.debris.flight`.

Points lie where they come to rest, so that only what flies is worked out in a frame, and nothing is left out before the
end, so that what does not change is never copied. The largest pieces become instances of shapes, which take about 50 ns
each in every frame whatever they are [measured]; all else becomes round points, which take next to nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import bpy

from ..nodes.node_graph import NodeGraph
from ..nodes.node_modifiers import GroupInput, new_group

GROUP = "SoftGround Debris"
MARK = "softground_debris"
"""Custom property of the group, of its object and of the collections of shapes."""

BIRTH, FLIGHT, DRAG = "softground_birth", "softground_flight", "softground_drag"
"""Of a point: frame of its birth, time in the air [s], settling speed over gravity [s]."""
SMALL = "softground_small"
"""True if it is one of the seen round points."""
START, LAUNCH = "softground_start", "softground_launch"
"""Its first place [Blender units] and its first speed [Blender units/s]."""
RANK = "softground_rank"
"""Its place in the order of size, from 0 for the largest."""
LOOK = "softground_look"
"""Which of several looks it has, from 0 for that of the ground; only where there are several."""
RADIUS, VELOCITY, AGE, KIND, STEP = "radius", "velocity", "age", "kind", "step"

SHAPED = 4000
"""How many of the largest pieces have a shape at first."""
FULL_TURNS = 12.0
"""How fast pieces turn in the air [rad/s]."""

INPUTS = (
    GroupInput("Wind", None, "Wind in metres per second, which carries the flying pieces along", kind="Vector"),
    GroupInput("Amount", 1.0, "Share of the pieces that are shown", (0.0, 1.0)),
    GroupInput(
        "Shaped",
        SHAPED,
        "How many of the largest pieces have a shape; all others are round, and play much faster",
        (0, 2**31 - 1),
        "Int",
    ),
    GroupInput("Shapes", None, "Objects of radius 1 for the large pieces, one picked for each", kind="Collection"),
)


def build(
    *,
    frame_rate: float,
    gravity: float,
    unit_scale: float,
    shapes: bpy.types.Collection,
    material: Any,
    others: Sequence[tuple[bpy.types.Collection, Any]] = (),
) -> Any:
    """A new node group.

    Parameters
    ----------
    frame_rate : float
        Frames that the scene's time counts per second [Hz].
    gravity : float
        [m/s²]
    unit_scale : float
        Metres per Blender unit.
    shapes : bpy.types.Collection
        What large pieces look like, of radius 1.
    material : bpy.types.Material
        Of the small ones.
    others : sequence of (bpy.types.Collection, bpy.types.Material)
        The same of further looks, in the order of `LOOK`.
    """
    graph = _Graph()
    geometry, wind, amount, shaped, collection = graph.inputs(shapes)
    geometry = _thinned(graph, geometry, amount)
    since = graph.math("DIVIDE", graph.math("SUBTRACT", graph.frame(), graph.attribute(BIRTH)), frame_rate)
    geometry = graph.store(geometry, AGE, since, True)
    geometry = _moved(graph, geometry, wind, gravity=gravity, unit_scale=unit_scale)
    geometry = graph.forgotten(geometry, BIRTH, DRAG, START, LAUNCH)
    unseen = graph.less(graph.attribute(AGE), 0.0)
    large = graph.less(graph.attribute(RANK), shaped)
    geometry = graph.store(geometry, SMALL, graph.logic("NOR", unseen, large), True, "BOOLEAN")
    points = _points(graph, graph.forgotten(geometry, FLIGHT, RANK), material)
    few, seen = graph.without(geometry, graph.logic("NOT", large)), graph.logic("NOT", unseen)
    looks = [seen] if not others else [graph.both(seen, graph.has_look(number)) for number in range(len(others) + 1)]
    pieces = [_pieces(graph, few, looks[0], collection)]
    for number, (more, of_small) in enumerate(others, 1):
        points = graph.shown(points, of_small, graph.has_look(number))
        pieces.append(_pieces(graph, few, looks[number], more))
    graph.finish(graph.forgotten(graph.joined(points, *pieces), FLIGHT, RANK, SMALL, *([LOOK] if others else [])))
    return graph.tree


def _thinned(graph: _Graph, geometry: Any, amount: Any) -> Any:
    """Points without those that the amount leaves out; nothing is done where it leaves out none."""
    fewer = graph.without(geometry, graph.less(amount, graph.random(0.0, 1.0, 1)))
    return graph.choose("GEOMETRY", graph.less(amount, 1.0), geometry, fewer)


def _moved(graph: _Graph, geometry: Any, wind: Any, *, gravity: float, unit_scale: float) -> Any:
    """Points at their places at the time, with their velocity."""
    age, flight, drag = (graph.attribute(name) for name in (AGE, FLIGHT, DRAG))
    time = graph.math("MINIMUM", age, flight)
    remaining = graph.math("EXPONENT", graph.math("DIVIDE", graph.math("MULTIPLY", time, -1.0), drag))
    passed = graph.math("MULTIPLY", drag, graph.math("SUBTRACT", 1.0, remaining))
    launch = graph.attribute(LAUNCH, "FLOAT_VECTOR")
    fall = graph.combined(0.0, 0.0, graph.math("MULTIPLY", drag, -gravity / unit_scale))
    drift = graph.vector("ADD", graph.scaled(wind, 1.0 / unit_scale), fall)
    moved = graph.vector("ADD", graph.scaled(launch, passed), graph.scaled(drift, graph.math("SUBTRACT", time, passed)))
    speed = graph.vector(
        "ADD", graph.scaled(launch, remaining), graph.scaled(drift, graph.math("SUBTRACT", 1.0, remaining))
    )

    born = graph.logic("NOT", graph.less(age, 0.0))
    flies = graph.both(graph.less(age, flight), born)
    blows = graph.less(0.0, graph.vector("LENGTH", wind, output="Value"))  # what has landed lies elsewhere for it
    geometry = graph.store(geometry, VELOCITY, speed, flies, "FLOAT_VECTOR")
    away = graph.either(flies, graph.both(blows, born))
    return graph.put(geometry, away, graph.vector("ADD", graph.attribute(START, "FLOAT_VECTOR"), moved))


def _points(graph: _Graph, geometry: Any, material: Any) -> Any:
    """The small ones as round points."""
    inputs = {"Mesh": geometry, "Selection": graph.attribute(SMALL, "BOOLEAN"), "Radius": graph.attribute(RADIUS)}
    return graph.shown(graph.node("GeometryNodeMeshToPoints", inputs).outputs["Points"], material)


def _pieces(graph: _Graph, geometry: Any, selection: Any, collection: Any) -> Any:
    """Some points as instances of shapes, which turn as long as they fly, and come to lie on their flat side."""
    children = {"Collection": collection, "Separate Children": True, "Reset Children": True}
    shapes = graph.node("GeometryNodeCollectionInfo", children).outputs[0]
    time = graph.math("MINIMUM", graph.attribute(AGE), graph.attribute(FLIGHT))
    remaining = graph.math("SUBTRACT", graph.attribute(FLIGHT), time)
    heading = graph.random((0.0, 0.0, 0.0), (0.0, 0.0, 2 * pi), 4, "FLOAT_VECTOR")
    turns = graph.random((-FULL_TURNS,) * 3, (FULL_TURNS,) * 3, 0, "FLOAT_VECTOR")
    turn = graph.vector("ADD", graph.scaled(turns, remaining), heading)
    inputs = {
        "Points": geometry,
        "Selection": selection,
        "Instance": shapes,
        "Pick Instance": True,
        "Instance Index": graph.random(0, 100, 3, "INT"),
        "Rotation": turn,
        "Scale": graph.attribute(RADIUS),
    }
    return graph.node("GeometryNodeInstanceOnPoints", inputs).outputs["Instances"]


class _Graph(NodeGraph):
    """The debris' group, while it is built."""

    def __init__(self) -> None:
        super().__init__(new_group(GROUP, MARK, INPUTS))

    def inputs(self, shapes: bpy.types.Collection) -> list[Any]:
        """Geometry, wind, amount, how many are shaped, and shapes."""
        self.tree.interface.items_tree["Shapes"].default_value = shapes
        group = self.node("NodeGroupInput")
        return [group.outputs[name] for name in ("Geometry", *(name for name, *_ in INPUTS))]

    def shown(self, geometry: Any, material: Any, selection: Any = True) -> Any:
        """Geometry with a material on some or all of it."""
        inputs = {"Geometry": geometry, "Selection": selection, "Material": material}
        return self.node("GeometryNodeSetMaterial", inputs).outputs["Geometry"]

    def has_look(self, number: int) -> Any:
        """True if a point has a look of several."""
        look = self.math("SUBTRACT", self.attribute(LOOK, "INT"), float(number))
        return self.less(self.math("ABSOLUTE", look), 0.5)

    def less(self, first: Any, second: Any) -> Any:
        """True if one is less than the other."""
        return self.compare("LESS_THAN", first, second)

    def joined(self, *geometries: Any) -> Any:
        node = self.node("GeometryNodeJoinGeometry")
        for geometry in geometries:
            self.link(geometry, node.inputs["Geometry"])
        return node.outputs["Geometry"]

    def random(self, low: Any, high: Any, seed: int, kind: str = "FLOAT") -> Any:
        node = self.node("FunctionNodeRandomValue")
        node.data_type = kind
        sockets = [socket for socket in node.inputs if socket.enabled]
        for name, value in (("Min", low), ("Max", high), ("Seed", seed)):
            self.link(value, next(socket for socket in sockets if socket.name == name))
        return next(socket for socket in node.outputs if socket.enabled)
