"""A bake on a ground, wherever it lies: on the user's own mesh, or on the detail that stands in for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, fields
from typing import Any

import bpy
import numpy as np

from ...batch.manifest_values import FRAME_LIMIT
from ...core.errors import InputError
from ...core.events.events import Event, as_edited
from ...core.ground.material import MATERIAL_RANGES, OFF
from ...core.motion.ground_frame import GroundFrame, rows
from ...core.numerics.arrays import Array, Indices
from ...core.playback.playback_curves import Spans
from ...core.record import record
from ...core.record.edits import StepEdit, with_names
from ...core.record.footprints import Footprint
from ...core.record.pressed_ground import GroundSample
from ...core.settings import BakeSettings, CharacterSettings, ObjectName, renamed
from ..carried import marks_object
from ..debris import debris_object
from ..jobs import Job, Progress
from ..placement import events_in_world
from ..plants import trampling_table
from ..playback import own_data, playback
from ..settings import SceneUnits, exists, name_of, resolve, scene_named
from . import created_ground, ground_checks, ground_mesh, ground_surface, hidden_ground, trail_detail

LARGEST_UNIT = 1e12
"""Of any of these, and 1 over the smallest: what is beyond is damage."""
EVENTS = "events"
"""What is known about footprints: the table of their events."""


@dataclass(frozen=True)
class Place:
    """Place to write a bake to. Nothing that the user sees is changed before `publish`.

    Attributes
    ----------
    index : (K,) int array
        Vertices of the display mesh that the bake moves.
    position : (K, 3) float array
        Their undisturbed world positions [m].
    display_mesh : bpy.types.Object
        What takes the prints.
    publish : callable
        Shows the written display mesh, takes away what stood in its place, and returns what carries the bake.
    is_draft : bool
        True if the display mesh is a new object, in no scene yet.
    """

    index: Indices
    position: Array
    display_mesh: ObjectName
    publish: Callable[[], bpy.types.Object]
    is_draft: bool = True


def display_mesh_of(ground: bpy.types.Object) -> bpy.types.Object:
    """The object that carries the ground's bake: the detail along the trail where there is one, else the ground."""
    return trail_detail.detail_of(ground) or ground


def is_baked(ground: bpy.types.Object) -> bool:
    """True if a bake is on this ground."""
    return ground_mesh.is_baked(display_mesh_of(ground))


def is_deleted(ground: bpy.types.Object) -> bool:
    """True if the ground, or the copy of it that carried its bake, was deleted in the viewport."""
    return not exists(ground) or trail_detail.was_deleted(ground)


def has_remains(ground: bpy.types.Object) -> bool:
    """True if `clear` has something to take away: a bake, what is left of one that was deleted in part, or a table that
    no plants give way by any more."""
    shown = display_mesh_of(ground)
    return ground_mesh.has_remains(shown) or hidden_ground.hides(ground) or trampling_table.is_idle(ground)


def check_writable(ground: bpy.types.Object) -> None:
    """Raise InputError if the ground, or the copy that carries its bake, cannot be changed."""
    for obj in dict.fromkeys((ground, display_mesh_of(ground))):
        ground_checks.check_writable(obj)


def clear(ground: bpy.types.Object) -> None:
    """Take the bake off the ground: it is what it was before, bit for bit. Without a bake nothing happens.

    Raises
    ------
    InputError
        If the ground or the copy that carries the bake cannot be changed.
    """
    check_writable(ground)
    debris_object.remove(ground)
    marks_object.remove(ground)
    trampling_table.clear(ground)
    trail_detail.remove(ground)
    ground_mesh.restore(ground)


def on_created(wanted: BakeSettings, draft: ObjectName, index: Indices, vertices: Array) -> Place:
    """A ground that is not in the scene yet."""

    def publish() -> bpy.types.Object:
        created_ground.publish(scene_named(wanted.scene), resolve(draft), wanted.surface)
        return resolve(draft)

    return Place(index, vertices[index], draft, publish)


def on_detail(ground: bpy.types.Object, draft: bpy.types.Object, index: Indices, vertices: Array) -> Place:
    """A draft of the ground refined along the trail; a bake that lies on the ground itself is taken off."""
    below, above = name_of(ground), name_of(draft)
    if detail := trail_detail.detail_of(ground):  # and gets what is written to the draft
        ground_checks.check_playable(detail)

    def publish() -> bpy.types.Object:
        ground_mesh.restore(resolve(below))
        return trail_detail.publish(resolve(below), resolve(above))

    return Place(index, vertices[index], above, publish)


def on_itself(ground: bpy.types.Object, index: Indices, vertices: Array) -> Place:
    """The ground itself; a detail that stood in for it is taken away."""
    name = name_of(ground)

    def publish() -> bpy.types.Object:
        trail_detail.remove(resolve(name))
        return resolve(name)

    return Place(index, vertices[index], name, publish, is_draft=False)


def write(
    place: Place,
    sample: GroundSample,
    spans: Spans,
    table: ObjectName,
    stored: bytes,
    *,
    unit_scale: float,
    frame: GroundFrame | None = None,
    shape_keys: bool = True,
    marks: Array | None = None,
    water: Array | None = None,
    layer: Callable[[bpy.types.Object], Array | None] = lambda _: None,
) -> Job[None]:
    """Put a bake on its place: the finished ground, the record, and the playback. It still has to be published.

    What is in the scene already is written in one step, and is as it was before if that fails.

    Parameters
    ----------
    sample : GroundSample
        The finished ground at the place's positions.
    spans : Spans
        Of the place's positions.
    table : bpy.types.Object
        The curves that these lie on, from `playback.keyframe_tables`.
    stored : bytes
        The footprints, from `core.record.record`.
    unit_scale : float
        Metres per Blender unit.
    frame : GroundFrame, optional
        That the positions are in.
    shape_keys : bool
        See `ground_mesh.write`.
    marks : (K, 3) float array, optional
        Where under a sole they lay, as in `own_data.SOLE`.
    water : (K,) float array, optional
        How deep the water on them is [m].
    layer : callable, optional
        Gives the depth of the layer at all vertices of the display mesh, where what lies below it shows (V,) [m].
    """
    resolve(table)  # or nothing is written
    ground_checks.check_playable(resolve(place.display_mesh))
    sample = sample.moved_at(spans.point)  # what never moves stays exactly where it is
    up = ground_surface.up_of(resolve(place.display_mesh), unit_scale, frame)
    with nullcontext() if place.is_draft else _as_before_if_it_fails(place.display_mesh):
        ground_mesh.write(resolve(place.display_mesh), place.index, sample, stored, up, shape_keys=shape_keys)
        if place.is_draft:
            yield Progress("write", 0.95)
        display_mesh = resolve(place.display_mesh)
        ground_mesh.note_frame(display_mesh, ground_surface.to_world_of(display_mesh, 1.0, frame) if frame else None)
        playback.attach(display_mesh, place.index[spans.point], spans, resolve(table), up=up)
        ground_mesh.write_shading(display_mesh, own_data.SOLE, place.index, marks)
        ground_mesh.write_shading(display_mesh, own_data.WATER, place.index, water)
        layers = layer(display_mesh)
        of_places = None if layers is None else layers[place.index]
        ground_mesh.write_shading(display_mesh, own_data.LAYER, place.index, of_places)


@contextmanager
def _as_before_if_it_fails(name: ObjectName) -> Iterator[None]:
    """Give a ground back what it was, with the bake that was on it, where what is done to it fails."""
    if not ground_mesh.is_baked(resolve(name)):
        try:
            yield
        except BaseException:
            ground_mesh.restore(resolve(name))
            raise
        return
    older: Any = ground_mesh.mesh_of(resolve(name)).copy()
    played = [(name_of(shown), modifier.node_group) for shown, modifier in playback.playing(resolve(name))]
    for _, group in played:
        group.use_fake_user = True  # or it goes with its last modifier
    try:
        yield
    except BaseException:
        playback.remove(resolve(name))
        newer: Any = ground_mesh.mesh_of(resolve(name))
        former = newer.name
        newer.user_remap(older)
        ground_mesh.remove_mesh(newer)
        older.name = former
        for shown, group in played:
            playback.play(resolve(shown), group)
            group.use_fake_user = False
        raise
    ground_mesh.remove_mesh(older)
    for _, group in played:
        group.use_fake_user = False
    playback.remove_unused()


def stored_record(ground: bpy.types.Object) -> memoryview:
    """The record of a ground's bake as it is stored, in bytes; to be looked at, not to be kept.

    Raises
    ------
    InputError
        If there is no bake, or its record is something else.
    """
    stored = ground_mesh.mesh_of(display_mesh_of(ground)).get(ground_mesh.RECORD)
    if stored is None:
        raise InputError(f"There is no bake on ground '{ground.name}': press Bake Footprints first.")
    try:
        return memoryview(stored).cast("B")
    except TypeError:
        raise InputError(
            f"The stored record of the footprints on '{ground.name}' was replaced by something else: clear the bake "
            "and bake again."
        ) from None


def record_of(ground: bpy.types.Object) -> record.BakeRecord:
    """The record of a ground's bake.

    Raises
    ------
    InputError
        If there is no bake, or its record is damaged or no longer fits the mesh.
    """
    stored = bytes(stored_record(ground))
    return record.load(stored)


def load(ground: bpy.types.Object) -> tuple[list[Footprint], dict[str, Any]]:
    """The record of a ground's bake: its footprints as the artist left them, its carves, and what is known about them.

    Raises
    ------
    InputError
        If there is no bake, or its record is damaged or no longer fits the mesh.
    """
    bake_record = record_of(ground)
    return bake_record.shaping, dict(bake_record.about)


def events_of(ground: bpy.types.Object) -> list[Event]:
    """The events of a ground's bake as the artist left its steps, in the order of time.

    Raises
    ------
    InputError
        If there is no bake, or its record has no events.
    """
    bake_record = record_of(ground)
    inputs = bake_record.about["inputs"]
    return events_in_world(events_in_frame(ground, bake_record), frame_in(inputs), ground, inputs["unit_scale_m"])


def events_in_frame(ground: bpy.types.Object, bake_record: record.BakeRecord) -> list[Event]:
    """The same in the frame of the bake, as its record on the ground has its steps."""
    table = bake_record.about.get(EVENTS)
    if not isinstance(table, list):
        raise InputError(f"The bake on ground '{ground.name}' was made without events: bake again.")
    rows = as_edited(table, bake_record.steps, bake_record.laid_carves)
    if (marks := marks_object.of(ground)) is not None and marks_object.has_numbers(marks):
        rows = marks_object.floors_of(marks).with_films(rows, bake_record.steps)
    return rows


def edits_of(ground: bpy.types.Object, characters: Sequence[CharacterSettings] = ()) -> Mapping[str, StepEdit]:
    """The artist's edits of the steps of a ground's bake, by step id; none if no bake can be read.

    `characters` are those of now, if the ids are to have their names.
    """
    try:
        about, edits = record.load_edits(bytes(stored_record(ground)))
    except InputError:
        return {}
    with suppress(AttributeError, KeyError, TypeError, ValueError):  # of damaged inputs
        return with_names(edits, renamed(about["inputs"]["characters"], characters))
    return edits


def units_of(inputs: Mapping[str, Any]) -> SceneUnits:
    """Units of the frames, lengths and forces of a bake, by the inputs that its record has; errors as `unit_of`."""
    numbers = {each.name: unit_of(inputs, each.name) for each in fields(SceneUnits) if each.name != "frame"}
    return SceneUnits(**numbers, frame=frame_in(inputs))


def unit_of(inputs: Mapping[str, Any], name: str) -> float:
    """A unit or the cell size (`cell_size_m`) of a bake, by the inputs that its record has.

    Raises
    ------
    KeyError, TypeError, ValueError, OverflowError
        If it is damaged.
    """
    unit = float(inputs[name])
    if not 1.0 / LARGEST_UNIT <= unit <= LARGEST_UNIT:
        raise ValueError("its units are unknown")
    return unit


def frame_in(inputs: Mapping[str, Any]) -> GroundFrame | None:
    """The frame that a bake was solved in, by the inputs that its record has; None where that is the world's.

    Raises
    ------
    InputError
        If it is damaged.
    """
    if (said := inputs.get("frame")) is None:
        return None
    with suppress(KeyError, TypeError, ValueError, OverflowError, np.linalg.LinAlgError):
        matrix = np.array(said["matrix"], dtype=np.float64).reshape(4, 4)
        if np.isfinite(np.linalg.inv(matrix)).all():
            return GroundFrame(rows(matrix), bool(said.get("moves", False)))
    raise InputError("The stored record of the footprints does not say where they lie: clear the bake and bake again.")


def frames_of(inputs: Mapping[str, Any]) -> tuple[int, int]:
    """First and last scene frame of a bake, by the inputs that its record has.

    Raises
    ------
    KeyError, TypeError, ValueError, OverflowError
        If they are damaged.
    """
    first, last = map(int, inputs["frames"])
    if not -FRAME_LIMIT <= first <= last <= FRAME_LIMIT:
        raise ValueError("no scene has such frames")
    return first, last


def baked_with(about: Mapping[str, Any], value: str) -> float:
    """A value of the material that a bake was made with, such as its `blur_sigma`, in SI units.

    Raises
    ------
    InputError
        If the record does not say, or says what no material has.
    """
    least, most = MATERIAL_RANGES[value]
    try:
        number = float({**OFF, **about["inputs"]["material"]}[value])
    except (KeyError, TypeError, ValueError, OverflowError):
        number = float("nan")
    if not least <= number <= most:
        raise InputError(f"The stored record of the footprints lacks its {value}: clear the bake and bake again.")
    return number
