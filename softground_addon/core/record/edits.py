"""What the artist changes of single steps, stored beside the footprints of a bake and kept when it is baked again."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

from ..errors import InputError
from .footprints import Footprint

SCHEMA_VERSION = 1

STRONGEST = 10.0
"""Largest `StepEdit.strength`."""
FARTHEST = 100.0
"""Largest part of `StepEdit.move_m` [m]."""


@dataclass(frozen=True)
class StepEdit:
    """Changes of one step.

    Attributes
    ----------
    mute : bool
        Its imprint is left out of the ground.
    strength : float
        Its depth over that of the bake.
    move_m : (float, float)
        How far it is moved along world x and y [m].
    turn_deg : float
        How far it is turned counter-clockwise around its position [deg].
    """

    mute: bool = False
    strength: float = 1.0
    move_m: tuple[float, float] = (0.0, 0.0)
    turn_deg: float = 0.0


UNCHANGED = StepEdit()
_FIELDS = tuple(field.name for field in fields(StepEdit))


def step_id(footprint: Footprint) -> str:
    """Identity of a step in reports and edits, such as `Walker/foot.L@36.5`: character, contact, middle of the contact.

    The frame is the middle of the contact to a tenth, so that no two contacts of a sole share it. An edit belongs to
    the contact of that sole that is under way at its frame. So it stays with its step when material, mass, cell size
    or the range of frames change, and when keys move the ends of a contact by less than half of its length.
    """
    return f"{_who(footprint)}@{_middle(footprint):.1f}"


def edit_of(footprint: Footprint, edits: Mapping[str, StepEdit]) -> StepEdit:
    """What the artist changed of a step; where several edits belong to it, the one nearest to its middle."""
    name = _key_of(footprint, edits)
    return edits[name] if name is not None else UNCHANGED


def _key_of(footprint: Footprint, edits: Mapping[str, StepEdit]) -> str | None:
    """The id under which a step's edit stands."""
    who, middle = _who(footprint), _middle(footprint)
    of_sole = {float(frame): name for name in edits for key, _, frame in [name.rpartition("@")] if key == who}
    meant = [frame for frame in of_sole if footprint.start_frame <= frame <= footprint.end_frame or frame == middle]
    return of_sole[min(meant, key=lambda frame: abs(frame - middle))] if meant else None


def edits_by_number(footprints: Iterable[Footprint], edits: Mapping[str, StepEdit]) -> dict[int, StepEdit]:
    """What the artist changed, by the number of the step; steps that are as they were baked are left out."""
    if not edits:
        return {}
    changes = {number: edit_of(footprint, edits) for number, footprint in enumerate(footprints)}
    return {number: edit for number, edit in changes.items() if edit != UNCHANGED}


def without_step(footprints: Iterable[Footprint], edits: Mapping[str, StepEdit]) -> list[str]:
    """Ids of edits that belong to no step any more."""
    used = {_key_of(footprint, edits) for footprint in footprints} if edits else set()
    return [name for name in edits if name not in used]


def to_json(edits: Mapping[str, StepEdit]) -> dict[str, Any]:
    """The edits for JSON; what is unchanged is left out.

    Examples
    --------
    >>> to_json({"Walker/foot.L@36.5": StepEdit(mute=True)})
    {'schema_version': 1, 'steps': {'Walker/foot.L@36.5': {'mute': True}}}
    """
    return {
        "schema_version": SCHEMA_VERSION,
        "steps": {name: edit_as_json(edit) for name, edit in edits.items()},
    }


def edit_as_json(edit: StepEdit) -> dict[str, Any]:
    """What one edit changes, for JSON.

    Examples
    --------
    >>> edit_as_json(StepEdit(strength=0.5, move_m=(0.1, 0.0)))
    {'strength': 0.5, 'move_m': [0.1, 0.0]}
    """
    return {
        key: list(value) if isinstance(value, tuple) else value
        for key in _FIELDS
        if (value := getattr(edit, key)) != getattr(UNCHANGED, key)
    }


def from_json(content: object, origin: str) -> dict[str, StepEdit]:
    """The edits from what `to_json` gave.

    Parameters
    ----------
    content : object
        Of the JSON.
    origin : str
        What error messages call it.

    Raises
    ------
    InputError
        Naming the step and the field that is unknown or out of range.
    """
    if not isinstance(content, dict) or not isinstance(steps := content.get("steps"), dict):
        raise InputError(f"{origin} must be a table with 'schema_version' and 'steps'.")
    if content.get("schema_version") != SCHEMA_VERSION:
        raise InputError(
            f"{origin} is of version {content.get('schema_version')!r}; this SoftGround reads version {SCHEMA_VERSION}."
        )
    _check_fields(content, ("schema_version", "steps"), origin)
    return {name: _edit(name, change, origin) for name, change in steps.items()}


def _edit(name: str, change: object, origin: str) -> StepEdit:
    where = f"{origin}, step '{name}'"
    who, _, frame = name.rpartition("@")
    if "/" not in who or not _is_frame(frame):
        raise InputError(f"{where}: this is no step's id. The bake's report names them: steps, id.")
    if not isinstance(change, dict):
        raise InputError(f'{where} must be a table such as {{"mute": true}}.')
    _check_fields(change, _FIELDS, where)
    mute, strength = change.get("mute", False), change.get("strength", 1.0)
    move, turn = change.get("move_m", (0.0, 0.0)), change.get("turn_deg", 0.0)
    if not isinstance(mute, bool):
        raise InputError(f"{where}: 'mute' is {mute!r}; it must be true or false.")
    if not _is_number(strength, 0.0, STRONGEST):
        raise InputError(f"{where}: 'strength' is {strength!r}; it must be a number from 0 to {STRONGEST:g}.")
    if (
        not isinstance(move, list | tuple)
        or len(move) != 2
        or not all(_is_number(m, -FARTHEST, FARTHEST) for m in move)
    ):
        raise InputError(f"{where}: 'move_m' is {move!r}; it must be two numbers up to {FARTHEST:g} m, along x and y.")
    if not _is_number(turn, -360.0, 360.0):
        raise InputError(f"{where}: 'turn_deg' is {turn!r}; it must be a number from -360 to 360.")
    return StepEdit(mute, float(strength), (float(move[0]), float(move[1])), float(turn))


def _who(footprint: Footprint) -> str:
    return f"{footprint.character}/{footprint.sole}"


def _middle(footprint: Footprint) -> float:
    return round((footprint.start_frame + footprint.end_frame) / 2, 1)


def _check_fields(table: Mapping[str, object], known: tuple[str, ...], where: str) -> None:
    unknown = [key for key in table if key not in known]
    if unknown:
        raise InputError(f"{where}: unknown field {unknown[0]!r}. Known are: {', '.join(known)}.")


def _is_frame(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _is_number(value: object, low: float, high: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high
