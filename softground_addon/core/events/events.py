"""The table of events between soles and ground, one row for each phase of a step: for other programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..ground import surfaces
from ..loads.estimate import CharacterLoads
from ..numerics.slices import Slices, sliced
from ..record.edits import step_id
from ..record.footprints import Footprint
from ..record.record import EditableStep
from . import phases
from .phases import Phase

Event = dict[str, Any]
"""A row, ready for JSON: see `COLUMNS`."""

COLUMNS = {
    "time_s": "since the first frame of the bake",
    "frame": "scene frame, with its fraction",
    "character": "who",
    "contact": "with what, such as foot.L",
    "phase": "heel_strike, foot_flat, heel_off, toe_off, slide_start, slide_end, scuff, land or wade",
    "step": "id of the step in the report; empty of a scuff, on hard ground, and where nothing was pressed",
    "side": "L, R or empty",
    "position": "of the lowest point of the sole [m]",
    "normal": "of the ground",
    "surface": "what the ground is made of; hard where it takes no print",
    "peak_force_n": "largest normal force of the phase",
    "peak_bw": "the same in body weights",
    "impulse_ns": "of the normal force over the phase",
    "landing_speed": "into the ground [m/s]; 0 of what is no landing",
    "slide_speed": "largest speed along the ground in the phase [m/s]",
    "depth_m": "of the whole print",
    "area_m2": "largest of the step",
    "thrown_kg": "what the phase throws",
    "carried": "on hard ground, what the sole brings there: mud, sand, snow, water or paint; else empty",
    "film": "of that, over the thickest",
    "duration_s": "of the phase; of landings, until the sole leaves",
}

LANDINGS = ("heel_strike", "land")
"""Phases with which a contact begins."""

MOST_OF_A_CUT = 0.05, 0.95
"""Parts of what a leg cuts between which it wades."""


@sliced
def events(
    loads: Sequence[CharacterLoads],
    footprints: Sequence[Footprint],
    *,
    surface: str,
    first_frame: float,
) -> Slices[list[Event]]:
    """The events of a bake, in the order of time.

    Parameters
    ----------
    footprints : sequence of Footprint
        Of the same steps.
    first_frame : float
        Of the bake.

    Returns
    -------
    list of dict
        With the keys of `COLUMNS`.
    """
    steps = _Steps(footprints)
    rows = []
    for character in loads:
        of_character = phases.phases(character)
        soles = [_Sole(character, sole, of_character) for sole in range(len(character.motion.soles))]
        for phase in of_character:
            yield
            rows.append(_row(character, phase, steps, surface, first_frame, soles[phase.sole]))
    return in_order(rows)


def as_edited(
    table: Sequence[Event], steps: Sequence[EditableStep], carves: Mapping[int, Footprint] | None = None
) -> list[Event]:
    """The events of the edited steps, with the mass that each phase threw: muted steps have none, moved steps have
    theirs at the new place and time, and copies have their own. Deep steps wade besides.

    Parameters
    ----------
    steps : sequence of EditableStep
        From the record.
    carves : mapping of int to Footprint, optional
        Its `laid_carves`.
    """
    of_steps: dict[str, list[Event]] = {step_id(step.baked): [] for step in steps}
    rows = [row for row in table if row["step"] not in of_steps]
    for row in table:
        if row["step"] in of_steps:
            of_steps[row["step"]].append(row)
    rows += [_moved(row, step) for step in steps if step.footprint for row in of_steps[step_id(step.baked)]]
    if carves:
        of_left = {row["step"]: row for row in reversed(rows)}
        wading = ((of_left.get(step.name), step, carves.get(step.index)) for step in steps)
        rows += [_wade(row, step, carve) for row, step, carve in wading if row and carve and _is_cut(carve)]
    return in_order(rows)


def in_order(rows: Iterable[Event]) -> list[Event]:
    """Rows by time, character and contact."""
    return sorted(rows, key=lambda row: (row["frame"], row["character"], row["contact"]))


def between(table: Sequence[Event], start: float, end: float, frame_rate: float) -> list[Event]:
    """The events within some frames, their time counted from the first of those."""
    return [
        row | {"time_s": _rounded((row["frame"] - start) / frame_rate)} for row in table if start <= row["frame"] <= end
    ]


def label(event: Event) -> str:
    """An event as people read it, such as `Walker foot.L heel strike`."""
    return f"{event['character']} {event['contact']} {event['phase'].replace('_', ' ')}"


class _Steps:
    """The footprints of each sole, by time."""

    def __init__(self, footprints: Sequence[Footprint]) -> None:
        self._of: dict[tuple[str, str], list[tuple[float, float, str, float, float, str]]] = {}
        for step in footprints:
            row = (step.start_frame, step.end_frame, step_id(step), step.max_depth_m, step.area_m2, step.surface)
            self._of.setdefault((step.character, step.sole), []).append(row)

    def at(self, character: str, sole: str, first: float, last: float) -> tuple[str, float, float, str]:
        """Id, depth [m], area [m²] and, of regions, surface of the print that shares most time with a phase from one
        frame to another.
        """
        rows = self._of.get((character, sole), [])
        shared = [min(last, end) - max(first, start) for start, end, *_ in rows]
        if not shared or max(shared) < -1.0:
            return "", 0.0, 0.0, ""
        _, _, name, depth, area, surface = rows[int(np.argmax(shared))]
        return name, depth, area, surface


class _Sole:
    """Movement of a sole over time: speed along the ground, force into it, and moments of leaving."""

    def __init__(self, loads: CharacterLoads, sole: int, of_character: Sequence[Phase]) -> None:
        self.speed = phases.slide_speed(loads, sole)
        self.force = phases.normal_force(loads, sole)
        self.toe_off = [phase.moment for phase in of_character if phase.kind == "toe_off" and phase.sole == sole]
        self.end = len(loads.motion.frames) - 1.0

    def until(self, phase: Phase) -> float:
        """The moment at which the contact of a landing ends."""
        return next((moment for moment in self.toe_off if moment > phase.moment), self.end)


def _row(
    loads: CharacterLoads, phase: Phase, steps: _Steps, surface: str, first_frame: float, over_time: _Sole
) -> Event:
    motion, sole = loads.motion, loads.motion.soles[phase.sole].sole
    at, span = phase.at, slice(phase.first, max(phase.last, phase.first + 1))
    frame = float(np.interp(phase.moment, np.arange(len(motion.frames)), motion.frames))
    landing, force = phase.kind in LANDINGS, over_time.force[span]
    length = over_time.until(phase) - phase.moment if landing else phase.last - phase.first
    frames = motion.frames[phase.first], motion.frames[min(phase.last, len(motion.frames)) - 1]
    step, depth, area, its_surface = steps.at(motion.name, sole.name, *frames)
    if phase.kind == "scuff" or phase.hard:
        step, depth, area = "", 0.0, 0.0
    peak = float(force.max(initial=0.0))
    return {
        "time_s": _rounded((frame - first_frame) / motion.frame_rate),
        "frame": _rounded(frame),
        "character": motion.name,
        "contact": sole.name,
        "phase": phase.kind,
        "step": step,
        "side": sole.side,
        "position": [_rounded(value, 5) for value in phases.place_of(loads, phase.sole, at)],
        "normal": [_rounded(value, 5) for value in loads.contacts.normal[at, phase.sole]],
        "surface": surfaces.HARD if phase.hard else its_surface or surface,
        "peak_force_n": _rounded(peak, 2),
        "peak_bw": _rounded(peak / (motion.mass * motion.gravity), 4),
        "impulse_ns": _rounded(float(force.sum()) * motion.time_step, 3),
        "landing_speed": _rounded(phases.landing_speed(loads, phase.sole, at) if landing else 0.0, 4),
        "slide_speed": _rounded(over_time.speed[span].max(initial=0.0), 4),
        "depth_m": _rounded(depth),
        "area_m2": _rounded(area),
        "thrown_kg": 0.0,
        "carried": "",
        "film": 0.0,
        "duration_s": _rounded(length * motion.time_step),
    }


def _moved(row: Event, step: EditableStep) -> Event:
    """An event of a step as edited."""
    before, after = step.baked, step.footprint
    assert after is not None
    if step.thrown:
        row = row | {"thrown_kg": _rounded(step.thrown.get(row["phase"], 0.0) * surfaces.find(row["surface"]).density)}
    row = row | {"surface": after.surface or row["surface"]}
    later = after.start_frame - before.start_frame
    if later and before.pressed_by:
        seconds = later / before.load_spacing * before.pressed_by.time_step
        row = row | {"frame": _rounded(row["frame"] + later), "time_s": _rounded(row["time_s"] + seconds)}
    row = row | {"step": step.name} if step.is_copy else row
    turn = after.heading - before.heading
    x, y = np.array(row["position"][:2]) - before.position[:2]
    cos, sin = np.cos(turn), np.sin(turn)
    place = (after.position[0] + cos * x - sin * y, after.position[1] + sin * x + cos * y)
    if np.allclose(place, row["position"][:2], atol=1e-6):
        return row
    height = row["position"][2] + after.position[2] - before.position[2]
    return row | {"position": [_rounded(value, 5) for value in (*place, height)]}


def _is_cut(carve: Footprint) -> bool:
    """True if a cut is left: later soles may press it level, and that of a step made small may fit no cell."""
    return carve.compressed_m3 > 0 and bool(carve.tile(carve.compression).sum() > 0)


def _wade(row: Event, step: EditableStep, carve: Footprint) -> Event:
    """Event of a leg that carves deep ground beside its print, from the event of the step."""
    changes, cell = carve.compression, carve.cell_size
    cut = np.maximum(np.add.reduceat(changes.amounts.astype(float), changes.first[:-1]), 0.0).cumsum()
    start, end = changes.frames[np.searchsorted(cut, np.array(MOST_OF_A_CUT) * cut[-1])]
    made_by = step.baked.pressed_by
    spacing = made_by.time_step / step.baked.load_spacing if made_by else 0.0
    depth = carve.tile(changes)
    x, y = carve.window.centres(cell)
    place = (depth.sum(axis=0) @ x / depth.sum(), depth.sum(axis=1) @ y / depth.sum(), row["position"][2])
    unused = dict.fromkeys(("peak_force_n", "peak_bw", "impulse_ns", "landing_speed", "slide_speed", "thrown_kg"), 0.0)
    return {
        **(row | unused),
        "time_s": _rounded(row["time_s"] + (start - row["frame"]) * spacing),
        "frame": _rounded(start),
        "phase": "wade",
        "position": [_rounded(value, 5) for value in place],
        "depth_m": _rounded(depth.max()),
        "area_m2": _rounded(np.count_nonzero(depth) * cell**2),
        "duration_s": _rounded((end - start) * spacing),
        "thrown_kg": _rounded(step.thrown.get("wade", 0.0) * surfaces.find(row["surface"]).density),
    }


def _rounded(value: float, digits: int = 6) -> float:
    return round(float(value), digits)
