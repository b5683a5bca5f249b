"""The node group that plays a bake: attributes and the time in, the ground at that time out.

It is native Blender data and needs nothing of this add-on. A vertex stands still most of the time: before its first
movement where it was, after its last where that left it, which is where the mesh has it. So only those that wait for
theirs are put back, and only those under way are looked up, in keyframe tables (see `core.playback.playback_curves`):
the splines of an object of its own, on each of which those of some vertices lie end to end.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

from ...core.playback.keyframe_tables import NO_CONTACT
from ...core.playback.playback_curves import NARROW
from ...core.record.footprints import NEVER
from ..nodes.node_graph import NodeGraph
from ..nodes.node_modifiers import GroupInput, new_group

GROUP = "SoftGround Playback"
MARK = "softground_playback"
"""Custom property of the group, whatever the user calls it."""

REST = "softground_rest"
MOVED = "softground_moved"
"""True if the bake moves or touches the vertex at all."""
START, END = "softground_start", "softground_end"
"""Frame from which on something happens to a vertex, and frame from which on nothing does."""
SPLINE, OFFSET = "softground_spline", "softground_offset"
"""Number of the spline that the vertex's timeline lies on, and where on it that begins."""
LAST_HEIGHT, LAST_CONTACT = "softground_last_height", "softground_last_contact"
"""Height at which a vertex comes to rest [m], and last frame of its last contact."""
COMPRESSION, RIM, AGE, PRESSURE = "softground_compression", "softground_rim", "softground_age", "softground_pressure"
OF_PLAYBACK = (MOVED, START, END, SPLINE, OFFSET, LAST_HEIGHT, LAST_CONTACT, PRESSURE)

SAMPLED = "softground_sampled"
"""What is sampled of the splines, while the group works: change of height, compression, contact."""

CONTACT = "softground_contact"
"""Of a spline's points; see `core.playback.playback_curves.PlaybackCurves`, which says what their positions hold."""


def build(
    *,
    table: bpy.types.Object,
    up: Sequence[float],
    frame_rate: float,
    few: bool,
    settled: bool,
) -> bpy.types.NodeTree:
    """A new node group.

    Parameters
    ----------
    table : bpy.types.Object
        Its splines are the keyframe_tables.
    up : (3,) floats
        World up in the ground's own space and units, of the length of one metre.
    frame_rate : float
        Frames of the table per second [Hz].
    few : bool
        True if so few of the vertices move that looking all of them up costs less than telling them apart.
    settled : bool
        True if the positions that the group is given are those at which vertices come to rest, whatever the user does.
    """
    graph = _Graph()
    geometry, frame = graph.inputs(up)
    start, end = graph.attribute(START), graph.attribute(END)
    waiting = graph.compare("LESS_THAN", frame, start)
    looked_up = graph.compare("LESS_THAN", frame, end)
    moved = graph.attribute(MOVED, "BOOLEAN")  # vertices that the user adds have 0 in all attributes
    if few:
        looked_up = graph.both(moved, looked_up)
    else:
        waiting = graph.both(moved, waiting)
        looked_up = graph.both(graph.compare("LESS_EQUAL", start, frame), looked_up)
    since = graph.math("MAXIMUM", graph.math("SUBTRACT", frame, start), 0.0)
    keyframe_tables = _KeyframeTables(graph, table, graph.math("ADD", graph.attribute(OFFSET), since))

    graph.next_row()
    rest = graph.attribute(REST, "FLOAT_VECTOR")
    # Each node looks up its own fields: the curves are sampled once, for all that follow.
    geometry = graph.store(geometry, SAMPLED, keyframe_tables.sampled(), looked_up, "FLOAT_VECTOR")
    height, compression, contact = graph.separated(graph.attribute(SAMPLED, "FLOAT_VECTOR"))
    if not settled:
        at_rest = graph.both(moved, graph.compare("LESS_EQUAL", end, frame))
        geometry = graph.put(geometry, at_rest, rest, graph.scaled(graph.up, graph.attribute(LAST_HEIGHT)))
    if not few:
        geometry = graph.put(geometry, waiting, rest)
    geometry = graph.put(geometry, looked_up, rest, graph.scaled(graph.up, height))

    graph.next_row()
    last = graph.attribute(LAST_CONTACT)
    aged = graph.math("DIVIDE", graph.math("SUBTRACT", frame, last), frame_rate)
    shaded = graph.store(geometry, AGE, aged, graph.compare("LESS_EQUAL", last, frame))
    rim = graph.math("MAXIMUM", graph.math("ADD", height, compression), 0.0)
    untouched = graph.compare("LESS_THAN", contact, -NO_CONTACT / 2)
    if few:
        untouched = graph.either(waiting, untouched)
    age = graph.choose("FLOAT", untouched, graph.math("MAXIMUM", graph.math("MULTIPLY", contact, -1.0), 0.0), NEVER)
    for name, value, at_first in ((COMPRESSION, compression, 0.0), (RIM, rim, 0.0), (AGE, age, NEVER)):
        graph.next_row()
        if not few:
            shaded = graph.store(shaded, name, at_first, waiting)
        shaded = graph.store(shaded, name, value, looked_up)
    graph.next_row()
    shaded = graph.store(shaded, PRESSURE, graph.math("MAXIMUM", contact, 0.0), looked_up)
    graph.finish(graph.forgotten(graph.choose("GEOMETRY", graph.with_shading, geometry, shaded), SAMPLED))
    return graph.tree


def is_playback(tree: bpy.types.NodeTree) -> bool:
    """True if a node group is one that `build` made."""
    return MARK in tree.keys()  # noqa: SIM118  (an ID is no mapping)


def table_of(tree: bpy.types.NodeTree) -> bpy.types.Object | None:
    """The object whose splines a group samples."""
    for node in tree.nodes:
        if node.bl_idname == "GeometryNodeObjectInfo":
            socket: Any = node.inputs["Object"]
            return socket.default_value
    return None


INPUTS = (
    GroupInput(
        "Shading",
        True,
        "Update compression, rim, age and pressure over time, for materials that read them",
        kind="Bool",
    ),
    GroupInput("Up", (0.0, 0.0, 1.0), "World up in the ground's space, one metre long", kind="Vector"),
)


class _KeyframeTables:
    """Values of the keyframe_tables of vertices at a place along their splines."""

    def __init__(self, graph: _Graph, table: bpy.types.Object, length: Any) -> None:
        splines = graph.node("GeometryNodeObjectInfo", {"Object": table}).outputs["Geometry"]
        self._graph, self._splines, self._length = graph, splines, length
        self._number = graph.attribute(SPLINE, "INT")

    def sampled(self) -> Any:
        """Change of the displayed height, and displayed compression [m]; contact as in `PlaybackCurves`."""
        graph = self._graph
        node = graph.sample(self._splines, self._number, self._length)
        graph.link(graph.attribute(CONTACT), node.inputs["Value"])
        _, *movement = graph.separated(node.outputs["Position"])
        height, compression = (graph.math("MULTIPLY", part, 1 / NARROW) for part in movement)
        return graph.combined(height, compression, node.outputs["Value"])


class _Graph(NodeGraph):
    """The playback's group, while it is built."""

    def __init__(self) -> None:
        super().__init__(new_group(GROUP, MARK, INPUTS))

    def inputs(self, up: Sequence[float]) -> tuple[Any, Any]:
        """The group's geometry and the scene's frame, with its fraction."""
        self.tree.interface.items_tree["Up"].default_value = tuple(up)
        group = self.node("NodeGroupInput")
        self.with_shading, self.up = group.outputs["Shading"], group.outputs["Up"]
        return group.outputs["Geometry"], self.frame()
