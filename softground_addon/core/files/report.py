"""The report of a bake in numbers, as JSON."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from ..findings import Finding, worst_first
from ..numerics.slices import Slices, sliced
from ..record.edits import UNCHANGED, StepEdit, edit_as_json, to_json
from ..record.footprints import Footprint
from ..record.record import EditableStep
from ..record.throws import WADE, of_print
from ..record.typical_depth import typical_of

SCHEMA_VERSION = 1


def build(
    *,
    inputs: Mapping[str, object],
    input_hash: str,
    steps: Sequence[tuple[EditableStep, str]],
    edits: Mapping[str, StepEdit] = MappingProxyType({}),
    offsets_mm: Mapping[str, Mapping[str, float]],
    timings: Mapping[str, float],
    playback_error_m: float | None = None,
    findings: Sequence[Finding] = (),
    forces: Mapping[str, object] | None = None,
    gaps_mm: Mapping[str, object] | None = None,
    worst_gaps: Sequence[Mapping[str, object]] = (),
    suggested_speed: Mapping[str, float] | None = None,
    events: Sequence[Mapping[str, object]] = (),
    carried_kg: Mapping[str, float] | None = None,
    carves: Sequence[Footprint] = (),
) -> dict[str, Any]:
    """The whole report of a bake, ready for JSON.

    Parameters
    ----------
    inputs : mapping
        The settings of the bake, in SI units.
    input_hash : str
        From `hash_inputs`, of all inputs but the edits: with these, it is equal for bakes with equal inputs.
    steps : sequence of (EditableStep, str)
        Of all `BakeRecord`s, each with the name of its ground if there are several. Those that made no print, or were
        muted, have `left_out`.
    edits : mapping
        Of the `BakeRecord`s: why they are not as they were baked.
    offsets_mm : mapping of character to (sole to mm)
        Constant float (positive) or sink of the source animation that was taken out of each sole.
    timings : mapping
        Seconds by stage, and frames per second.
    playback_error_m : float, optional
        Largest error of the played heights against the record's [m].
    findings : sequence of Finding
        Problems and remedies.
    forces : mapping, optional
        Force per frame and sole [N], on request.
    gaps_mm : mapping, optional
        Distance of the standing soles from the ground before and after grounding, by character.
    worst_gaps : sequence of mapping
        The frames and soles where it is largest after grounding.
    suggested_speed : mapping, optional
        Speed that people would choose on this ground, over that on hard ground, by character.
    events : sequence of mapping
        From `core.events.events`.
    carried_kg : mapping, optional
        Masses that soles carried onto hard floors, of a `core.carried.film.CarriedMass`.
    carves : sequence of Footprint
        `laid_carves` of the `BakeRecord`s.
    """
    rows = [_step(step) | ({"ground": ground} if ground else {}) for step, ground in steps]
    counted = [row for row in rows if not row.get("left_out")]
    shown = [step.footprint for step, _ in steps if step.footprint]
    report: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "inputs": dict(inputs),
        "input_hash": hash_inputs(input_hash, to_json(edits)) if edits else input_hash,
        "steps": rows,
        "totals": {
            "steps": len(counted),
            "peak_force_n": max((step["peak_force_n"] for step in counted), default=0.0),
            "max_depth_m": max((step["max_depth_m"] for step in counted), default=0.0),
            "typical_depth_m": typical_of(shown),
            "compressed_m3": sum(step["compressed_m3"] for step in counted),
            "rim_m3": sum(step["rim_m3"] for step in counted),
            "thrown_m3": sum(of_print(step.thrown) for step, _ in steps),
        },
        "events": [dict(event) for event in events],
        "source_offset_mm": {name: dict(soles) for name, soles in offsets_mm.items()},
        "timings": dict(timings),
        "self_check": [finding.as_dict() for finding in worst_first(findings)],
        "warnings": [finding.text for finding in worst_first(findings)],
    }
    if carried_kg is not None:
        report["totals"]["carried_kg"] = dict(carried_kg)
    if carves:
        report["totals"]["carved_m3"] = sum(carve.compressed_m3 for carve in carves)
        report["carved"] = _carved(carves, [step for step, _ in steps])
    if playback_error_m is not None:
        report["playback_error_mm"] = playback_error_m * 1e3
    if gaps_mm is not None:
        report["gaps_mm"] = dict(gaps_mm)
        report["worst_gaps"] = [dict(gap) for gap in worst_gaps]
    if suggested_speed is not None:
        report["suggested_speed"] = dict(suggested_speed)
    if forces is not None:
        report["forces"] = dict(forces)
    return report


def _carved(carves: Iterable[Footprint], steps: Iterable[EditableStep]) -> dict[str, dict[str, float]]:
    """Volumes that each character cut, packed into walls, left loose, threw, and found no place for [m³]."""
    volumes: dict[str, dict[str, float]] = {}
    for carve in carves:
        packed = carve.compressed_m3 - carve.rim_m3 - carve.unplaced_rim_m3
        of_step = (carve.compressed_m3, packed, carve.rim_m3, 0.0, carve.unplaced_rim_m3)
        sums = volumes.setdefault(carve.character, {})
        for name, volume in zip(("cut_m3", "packed_m3", "loose_m3", "thrown_m3", "unplaced_m3"), of_step, strict=True):
            sums[name] = sums.get(name, 0.0) + volume
    for step in steps:
        if volume := step.thrown.get(WADE, 0.0):  # which the rim lacks
            sums = volumes[step.baked.character]
            sums["thrown_m3"] += volume
            sums["packed_m3"] -= volume
    return volumes


def _step(editable: EditableStep) -> dict[str, Any]:
    """Entry of a step, as it lies on the ground; as it was baked if nothing of it does."""
    footprint = editable.footprint or editable.baked
    step: dict[str, Any] = {
        "id": editable.name,
        "contact": footprint.sole,
        "character": footprint.character,
        "frame_start": round(float(footprint.start_frame), 3),
        "frame_end": round(float(footprint.end_frame), 3),
        "position": [round(float(value), 5) for value in footprint.position],
        "area_m2": float(footprint.area_m2),
        "peak_force_n": float(footprint.peak_force_n),
        "max_depth_m": float(footprint.max_depth_m),
        "compressed_m3": float(footprint.compressed_m3),
        "rim_m3": float(footprint.rim_m3),
    }
    if footprint.surface:
        step["surface"] = footprint.surface
    if editable.edit != UNCHANGED or editable.is_copy:
        step["edit"] = edit_as_json(editable.edit)
    if editable.footprint is None:
        step["left_out"] = True
    return step


def summary(report: Mapping[str, Any]) -> str:
    """The report in one line, for people."""
    totals, timings = report["totals"], report["timings"]
    seconds = sum(timings[stage] for stage in ("sample", "simulate", "write"))
    return (
        f"{totals['steps']} steps, deepest {totals['max_depth_m'] * 100:.1f} cm, peak force "
        f"{totals['peak_force_n']:.0f} N, {seconds:.1f} s"
    )


def dump(report: Mapping[str, object]) -> str:
    """The report as the text of a JSON file."""
    return json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


@sliced
def hash_inputs(*inputs: object) -> Slices[str]:
    """A SHA-256 over nested dataclasses, mappings, sequences, arrays, numbers and texts, by value."""
    digest = hashlib.sha256()
    yield from _feed(digest, inputs)
    return digest.hexdigest()


def _feed(digest: hashlib._Hash, value: object) -> Slices[None]:
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
        yield
    elif is_dataclass(value):
        for field in fields(value):
            yield from _feed(digest, (field.name, getattr(value, field.name)))
    elif isinstance(value, Mapping):
        for key in sorted(value):
            yield from _feed(digest, (key, value[key]))
    elif isinstance(value, list | tuple):
        digest.update(f"({len(value)}".encode())
        for item in value:
            yield from _feed(digest, item)
    elif type(value).__repr__ is object.__repr__:  # which says where it is, not what
        raise TypeError(f"{type(value).__name__} has no value to be compared by")
    else:
        digest.update(f"{type(value).__name__}:{value!r};".encode())
