"""The events of a bake in the scene: as points with attributes, and as markers of the timeline."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty

from ...core.events import events
from ...core.events import phases as event_phases
from .. import mesh_arrays, settings
from ..baking import bake_report
from ..ground import baked_ground
from ..operator_base import Act, OnBake

NAME = "SoftGround Events"

_NUMBERS = (
    *("time_s", "frame", "peak_force_n", "peak_bw", "impulse_ns", "landing_speed", "slide_speed", "depth_m"),
    *("area_m2", "thrown_kg", "duration_s"),
)
"""Columns that become attributes as they are."""

MARKED = {"heel_strike", "land", "toe_off"}
"""Phases that get a marker unless the user chooses others."""


def add_points(scene: bpy.types.Scene, table: Sequence[events.Event]) -> bpy.types.Object:
    """An object whose points are the events, in place of the one that there may be.

    Texts become numbers: `phase` in the order of `core.events.phases.KINDS`, `character` and `contact` in the order
    of the lists that the object has as custom properties.
    """
    place = np.array([row["position"] for row in table], float).reshape(-1, 3) / scene.unit_settings.scale_length
    texts = {name: list(dict.fromkeys(row[name] for row in table)) for name in ("character", "contact")}
    texts["phase"] = list(event_phases.KINDS)
    columns = (
        *((name, "FLOAT", np.array([row[name] for row in table])) for name in _NUMBERS),
        ("normal_of_ground", "FLOAT_VECTOR", np.array([row["normal"] for row in table])),
        *((name, "INT", np.array([known.index(row[name]) for row in table])) for name, known in texts.items()),
    )
    shown = _fresh(scene, mesh_arrays.points(NAME, place, columns))
    for name, known in texts.items():
        shown[f"{name}s"] = ", ".join(known)
    return shown


def add_markers(markers: Any, table: Sequence[events.Event], kinds: set[str]) -> int:
    """Put the events of some phases into a timeline, in place of those of an earlier bake; returns their number."""
    ours = {f"{row['character']} {row['contact']} " for row in table}
    endings = tuple(kind.replace("_", " ") for kind in event_phases.KINDS)
    for marker in list(markers):
        if marker.name.endswith(endings) and any(marker.name.startswith(prefix) for prefix in ours):
            markers.remove(marker)
    wanted = [row for row in table if row["phase"] in kinds]
    for row in wanted:
        markers.new(events.label(row), frame=round(row["frame"]))
    return len(wanted)


def _fresh(scene: bpy.types.Scene, points: bpy.types.Mesh) -> bpy.types.Object:
    """The scene's object of events with new points; the user's changes of it stay."""
    shown = scene.objects.get(NAME)
    if shown is None or shown.type != "MESH":
        shown = bpy.data.objects.new(NAME, points)
        scene.collection.objects.link(shown)
        return shown
    older: Any = shown.data
    shown.data = points
    if not older.users:
        bpy.data.meshes.remove(older)
    return shown


def events_of(bakes: Iterable[bake_report.HeardBake]) -> list[events.Event]:
    """Events of some bakes, in the order of time; errors as of `baked_ground.events_of`."""
    tables = ((bake, baked_ground.events_of(bake.ground)) for bake in bakes)
    return events.in_order(row for bake, table in tables for row in table if bake.has(row["character"], row["frame"]))


class SOFTGROUND_OT_event_points(OnBake, Act):
    """Add an object whose points are the events of the bake: where and when each foot strikes, slides and leaves"""

    bl_idname = "softground.event_points"
    bl_label = "Add Event Points"

    def act(self, context: bpy.types.Context) -> None:
        table = events_of(bake_report.heard_bakes(settings.options_of(context)))
        shown = add_points(context.scene, table)
        self.say("{count} events are the points of '{name}'", count=len(table), name=shown.name)


class SOFTGROUND_OT_event_markers(OnBake, Act):
    """Add markers to the timeline where each foot strikes and leaves the ground"""

    bl_idname = "softground.event_markers"
    bl_label = "Mark Events in Timeline"

    phases: EnumProperty(
        name="Events",
        description="Which events to mark",
        items=[(kind, kind.replace("_", " ").title(), "") for kind in event_phases.KINDS],
        options={"ENUM_FLAG"},
        default=MARKED,
    )

    def act(self, context: bpy.types.Context) -> None:
        table = events_of(bake_report.heard_bakes(settings.options_of(context)))
        count = add_markers(context.scene.timeline_markers, table, set(self.phases))
        self.say("Marked {count} events", count=count)


CLASSES = (SOFTGROUND_OT_event_points, SOFTGROUND_OT_event_markers)
