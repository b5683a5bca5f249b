"""Effect of steady weather after each age: a table in no scene, which nodes look up."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.ground.surfaces import Soaking
from ...core.weather.weather import Matter, Span
from ...core.weather.weather_course import Weather, steady_table
from ..rigs.object_data import mesh_of
from .weather_course_nodes import AGES, HOLLOWS, PER_FRAME, SUMMED, TABLE, THREES, UNITS, field_of, tabled

NAME = "SoftGround Weather Table"
TABLES = (TABLE, HOLLOWS)
"""Names of the nodes that have one."""
GROUND = "softground_weather_ground"
"""Custom property of the group that looks the table up: how its ground takes weather, as JSON."""
MOST = 1 << 14
"""Ages in a table: beyond, the nodes work it out."""


def new() -> bpy.types.Object:
    """A table that has nothing yet."""
    return bpy.data.objects.new(NAME, bpy.data.meshes.new(NAME))


def named(tree: Any, name: str) -> bpy.types.Object | None:
    """The table that one of a group's nodes has; None without one."""
    node = tree.nodes.get(name)
    return node.inputs["Object"].default_value if node else None


def separate(tree: Any, name: str) -> None:
    """Give one of a group's nodes a table of its own."""
    if table := named(tree, name):
        copy = tree.nodes[name].inputs["Object"].default_value = table.copy()
        copy.data = mesh_of(table).copy()


def remove_unused(tables: Iterable[bpy.types.Object | None]) -> None:
    """Remove those of some tables that nothing looks up any more."""
    for table in tables:
        if table is not None and not table.users:
            mesh = mesh_of(table)
            bpy.data.objects.remove(table)
            bpy.data.meshes.remove(mesh)


def fill(table: bpy.types.Object, columns: Mapping[str, NDArray[np.float64]]) -> None:
    """Have a table hold some columns, each (rows, 3)."""
    mesh = mesh_of(table)
    rows = len(next(iter(columns.values())))
    if len(mesh.vertices) != rows:
        mesh.clear_geometry()
        mesh.vertices.add(rows)
    for name, column in columns.items():
        attribute: Any = mesh.attributes.get(name) or mesh.attributes.new(name, "FLOAT_VECTOR", "POINT")
        attribute.data.foreach_set("vector", column.astype(np.float32).ravel())
    mesh.update()


def describe(tree: Any, matter: Matter, span: Span, soaking: tuple[float, float]) -> None:
    """Note with a group what its table needs of the ground."""
    tree[GROUND] = json.dumps({"matter": asdict(matter), "frame_rate": span.frame_rate, "soaking": soaking})


def follow(tree: Any, values: Mapping[str, float], frames: float) -> bool:
    """Have the table of a group fit its sliders; whether anything changed.

    Parameters
    ----------
    tree : bpy.types.NodeTree
        That has the nodes.
    values : mapping
        The sliders by name, none of `SUMMED` keyed.
    frames : float
        So many from the first on, as far as `MOST` ages go.
    """
    table, last = named(tree, TABLE), tree.nodes[AGES].outputs[0]
    if table is None or not values.keys() >= set(SUMMED):  # deleted by the user
        is_known, last.default_value = last.default_value >= 0.0, -1.0
        return is_known
    wanted = np.resize([*(values[name] for name in SUMMED), 0.0, 0.0], (len(THREES), 3)).astype(np.float32)
    sockets = [tree.nodes[tabled(number)].inputs[1] for number in range(len(wanted))]
    ages = min(max(round(frames * PER_FRAME), 1), MOST)
    if last.default_value == ages and np.array_equal([socket.default_value for socket in sockets], wanted):
        return False
    fill(table, _columns(dict(zip(SUMMED, wanted.ravel().tolist(), strict=False)), json.loads(tree[GROUND]), ages))
    for socket, three in zip(sockets, wanted, strict=True):
        socket.default_value = three
    last.default_value = ages
    return True


def _columns(values: Mapping[str, float], ground: Mapping[str, Any], ages: int) -> dict[str, NDArray[np.float64]]:
    """Effect of weather by sliders at these values; `ground` is of `describe`."""
    about = ground["matter"]
    soaking = about["soaking"]
    matter = Matter(**about | {"soaking": Soaking(**soaking) if soaking else None})
    # What is below 0 does not act.
    rates = {name: value if name == "Temperature" else max(value, 0.0) for name, value in values.items()}
    weather = Weather(**{field_of(name): rate * UNITS[name] for name, rate in rates.items()})
    low, high = ground["soaking"]
    columns = steady_table(
        weather, matter, (low, high), ages=ages, per_frame=PER_FRAME, frame_rate=ground["frame_rate"]
    )
    return columns | {"position": columns.pop("look")}
