"""Edits of single steps, stored beside the footprints of a bake and kept when it is baked again.

Steps are numbered as they were baked; copy number k of step n has the number n + k times the count of the baked ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..errors import InputError, damaged
from . import mesh_sole
from .contact_steps import PressingSole
from .footprints import Footprint
from .mesh_sole import MeshSole

SCHEMA_VERSION = 1

STRONGEST = 10.0
"""Largest `StepEdit.strength`."""
FARTHEST = 100.0
"""Largest part of `StepEdit.move_m` [m]."""
SMALLEST, LARGEST = 0.2, 5.0
"""Least and largest `StepEdit.scale`."""
LONGEST_SHIFT = 1000
"""Most frames of `StepEdit.shift_frames`, either way."""
LONGEST_NAME = 200
"""Most bytes of `StepEdit.sole`."""
MOST_COPIES = 999
"""Most copies of one step."""


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
        Displacement along world x and y [m].
    turn_deg : float
        Counter-clockwise turn around its position [deg].
    scale : float
        Size of its sole over that of the bake, at the same pressure.
    shift_frames : int
        Frames by which it presses later.
    sole : str
        Character and contact whose sole presses it, such as `Fox/paw.L`, or the name of a mesh object; its own where
        empty, or not known.
    mesh : MeshSole or None
        Of that object, as it was when it was read last; None for a foot of the bake.
    """

    mute: bool = False
    strength: float = 1.0
    move_m: tuple[float, float] = (0.0, 0.0)
    turn_deg: float = 0.0
    scale: float = 1.0
    shift_frames: int = 0
    sole: str = ""
    mesh: MeshSole | None = None


UNCHANGED = StepEdit()


def step_id(footprint: Footprint, copy: int = 0) -> str:
    """Identity of a step in reports and edits, such as `Walker/foot.L@36.5`: character, contact, middle of the contact.

    The frame is the middle of the contact to a tenth, so that no two contacts of a sole share it. An edit belongs to
    the contact of that sole that is under way at its frame. So it stays with its step when material, mass, cell size
    or the range of frames change, and when keys move the ends of a contact by less than half of its length. A copy that
    the artist made of it goes with it, and its number follows: `Walker/foot.L@36.5+1`.
    """
    return f"{sole_id(footprint)}@{_middle(footprint):.1f}" + (f"+{copy}" if copy else "")


def with_edit(
    edits: Mapping[str, StepEdit], footprint: Footprint, name: str, edit: StepEdit | None
) -> dict[str, StepEdit]:
    """All edits, with a new one of a step or of a copy of it; None removes the edit and the copy.

    Parameters
    ----------
    footprint : Footprint
        The step as it was baked.
    name : str
        Its id, or that of the copy: edits stored under ids of an earlier bake go.
    """
    _, _, copy = _parts(name)
    others = {other: stored for other, stored in edits.items() if not _is_of(other, footprint, copy)}
    return others if edit is None else others | {name: edit}


def new_copy(edits: Mapping[str, StepEdit], footprint: Footprint) -> str:
    """Id for one more copy of a step.

    Raises
    ------
    InputError
        If it has `MOST_COPIES` already.
    """
    taken = {_parts(name)[2] for name in edits if _is_of(name, footprint, _parts(name)[2])}
    free = next((copy for copy in range(1, MOST_COPIES + 1) if copy not in taken), None)
    if free is None:
        message = f"Step '{step_id(footprint)}' already has {MOST_COPIES} copies, the most: copy another step."
        raise InputError(message, "too_many_copies")
    return step_id(footprint, free)


def is_copy(name: str) -> bool:
    """True if a step's id is that of a copy."""
    return _parts(name)[2] > 0


def edits_by_number(footprints: Sequence[Footprint], edits: Mapping[str, StepEdit]) -> dict[int, StepEdit]:
    """Edits by the number of the step, without those of unchanged steps."""
    names = sorted(_names(footprints, edits).items())
    return {n: edits[name] for n, name in names if edits[name] != UNCHANGED or n >= len(footprints)}


def without_step(footprints: Sequence[Footprint], edits: Mapping[str, StepEdit]) -> list[str]:
    """Ids of edits that belong to no step any more."""
    used = set(_names(footprints, edits).values())
    return [name for name in edits if name not in used]


def without_sole(footprints: Sequence[Footprint], edits: Mapping[str, StepEdit]) -> list[str]:
    """Ids of edits whose sole is that of no foot in the bake and of no mesh."""
    known = {"", *feet(footprints)}
    return [name for name, edit in edits.items() if edit.sole not in known and edit.mesh is None]


def sole_of(edit: StepEdit, baked: PressingSole, known: Mapping[str, PressingSole]) -> PressingSole:
    """The sole that presses a step.

    Parameters
    ----------
    baked : PressingSole
        That made the step: a foot may be swapped, a prop may not.
    known : mapping of str to PressingSole
        From `feet`.
    """
    if baked.sole.prop is not None:
        return baked
    return known.get(edit.sole) or (edit.mesh.pressing if edit.mesh else baked)


def mesh_soles(edits: Mapping[str, StepEdit]) -> dict[str, MeshSole]:
    """The soles of meshes that edits keep, by the names of the objects."""
    return {edit.sole: edit.mesh for edit in edits.values() if edit.mesh is not None}


def with_meshes(edits: Mapping[str, StepEdit], meshes: Mapping[str, MeshSole]) -> dict[str, StepEdit]:
    """Edits with other soles of the meshes that they name; where none is known, with their stored ones."""
    return {name: replace(edit, mesh=meshes.get(edit.sole, edit.mesh)) for name, edit in edits.items()}


def with_names(edits: Mapping[str, StepEdit], names: Mapping[str, str]) -> dict[str, StepEdit]:
    """Edits of characters that have other names by now, and the same by the soles that press.

    Examples
    --------
    >>> with_names({"Walker/foot.L@36.5": StepEdit(sole="Fox/paw.L")}, {"Walker": "Ann", "Fox": "Reynard"}).keys()
    dict_keys(['Ann/foot.L@36.5'])
    """

    def now(text: str) -> str:
        before = next((name for name in names if text.startswith(f"{name}/")), None)
        return text if before is None else names[before] + text.removeprefix(before)

    return {now(name): replace(edit, sole=now(edit.sole)) for name, edit in edits.items()}


def feet(footprints: Sequence[Footprint]) -> dict[str, PressingSole]:
    """Soles that may press the steps of other feet, by the names that `StepEdit.sole` calls them."""
    made_by = {sole_id(footprint): footprint.pressed_by for footprint in footprints}
    return {name: by.pressing for name, by in made_by.items() if by is not None and by.pressing.sole.prop is None}


def _names(footprints: Sequence[Footprint], edits: Mapping[str, StepEdit]) -> dict[int, str]:
    """Ids of the edits that belong to steps, by number; of several for one step, the one nearest to its middle."""
    of_soles: dict[str, dict[int, dict[float, str]]] = {}
    for name in edits:
        sole, frame, copy = _parts(name)
        of_soles.setdefault(sole, {}).setdefault(copy, {})[frame] = name
    names = {}
    for number, footprint in enumerate(footprints) if edits else ():
        middle = _middle(footprint)
        for copy, frames in of_soles.get(sole_id(footprint), {}).items():
            during = [frame for frame in frames if _is_during(frame, footprint)]
            if during:
                nearest = min(during, key=lambda frame: abs(frame - middle))
                names[number + copy * len(footprints)] = frames[nearest]
    return names


def _is_of(name: str, footprint: Footprint, copy: int) -> bool:
    """True if an id is that of a step, or of its copy of that number."""
    sole, frame, number = _parts(name)
    return (sole, number) == (sole_id(footprint), copy) and _is_during(frame, footprint)


def _is_during(frame: float, footprint: Footprint) -> bool:
    """True if the frame of an id is within a contact; that of a short one may round to a frame beside it."""
    return footprint.start_frame <= frame <= footprint.end_frame or frame == _middle(footprint)


def _parts(name: str) -> tuple[str, float, int]:
    """Name of the sole as of `sole_id`, frame, and number of the copy in an id; ValueError where it is none."""
    sole, _, when = name.rpartition("@")
    frame, plus, copy = when.partition("+")
    number = int(copy) if plus else 0
    if "/" not in sole or not math.isfinite(float(frame)) or not (not plus or 1 <= number <= MOST_COPIES):
        raise ValueError(name)
    return sole, float(frame), number


def to_json(edits: Mapping[str, StepEdit]) -> dict[str, Any]:
    """The edits for JSON, with the soles of meshes that they need, without unchanged fields.

    Examples
    --------
    >>> to_json({"Walker/foot.L@36.5": StepEdit(mute=True)})
    {'schema_version': 1, 'steps': {'Walker/foot.L@36.5': {'mute': True}}}
    """
    soles = {name: mesh.to_json() for name, mesh in mesh_soles(edits).items()}
    return {
        "schema_version": SCHEMA_VERSION,
        "steps": {name: edit_as_json(edit) for name, edit in edits.items()},
        **({"soles": soles} if soles else {}),
    }


def edit_as_json(edit: StepEdit) -> dict[str, Any]:
    """Changes of one edit, for JSON; of a mesh, its name.

    Examples
    --------
    >>> edit_as_json(StepEdit(strength=0.5, move_m=(0.1, 0.0)))
    {'strength': 0.5, 'move_m': [0.1, 0.0]}
    """
    return {
        key: list(value) if isinstance(value, tuple) else value
        for key in _CHECKS
        if (value := getattr(edit, key)) != getattr(UNCHANGED, key)
    }


def from_json(content: object, origin: str) -> dict[str, StepEdit]:
    """The edits from the result of `to_json`.

    Parameters
    ----------
    content : object
        Of the JSON.
    origin : str
        Its name in error messages.

    Raises
    ------
    InputError
        Naming the step and the field that is unknown or out of range.
    """
    if not isinstance(content, dict) or not isinstance(steps := content.get("steps"), dict):
        raise damaged(origin, "it must be a table with 'schema_version' and 'steps'.")
    if content.get("schema_version") != SCHEMA_VERSION:
        raise damaged(
            origin,
            f"it is of version {content.get('schema_version')!r}; {SCHEMA_VERSION} is read.",
        )
    _check_fields(content, ("schema_version", "steps", "soles"), origin)
    if not isinstance(soles := content.get("soles", {}), dict):
        raise damaged(origin, "'soles' must be a table by the names of objects.")
    edits = {name: _edit(name, change, origin) for name, change in steps.items()}
    named = {edit.sole for edit in edits.values()} & soles.keys()
    read = {name: mesh_sole.from_json(name, soles[name], f"{origin}, sole {name!r}") for name in sorted(named)}
    return with_meshes(edits, read)


def _edit(name: str, change: object, origin: str) -> StepEdit:
    where = f"{origin}, step {name!r}"
    try:
        _parts(name)
        name.encode()
    except ValueError:  # also for half a character
        raise damaged(where, "this is not the id of a step. The bake's report names them: steps, id.") from None
    if not isinstance(change, dict):
        raise damaged(where, 'it must be a table such as {"mute": true}.')
    _check_fields(change, tuple(_CHECKS), where)
    for field, (is_valid, needed, _) in _CHECKS.items():
        if field in change and not is_valid(change[field]):
            raise damaged(where, f"'{field}' is {change[field]!r}; it must be {needed}.")
    return StepEdit(**{field: _CHECKS[field][2](value) for field, value in change.items()})


def _is_number(value: object, low: float, high: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high


def _is_move(value: object) -> bool:
    return (
        isinstance(value, list | tuple) and len(value) == 2 and all(_is_number(m, -FARTHEST, FARTHEST) for m in value)
    )


def _is_sole(value: object) -> bool:
    try:
        return isinstance(value, str) and len(value.encode()) <= LONGEST_NAME
    except UnicodeEncodeError:  # half a character
        return False


_CHECKS: dict[str, tuple[Callable[[Any], bool], str, Callable[[Any], Any]]] = {
    "mute": (lambda value: isinstance(value, bool), "true or false", bool),
    "strength": (lambda value: _is_number(value, 0.0, STRONGEST), f"a number from 0 to {STRONGEST:g}", float),
    "move_m": (
        _is_move,
        f"two numbers up to {FARTHEST:g} m, along x and y",
        lambda move: (float(move[0]), float(move[1])),
    ),
    "turn_deg": (lambda value: _is_number(value, -360.0, 360.0), "a number from -360 to 360", float),
    "scale": (lambda value: _is_number(value, SMALLEST, LARGEST), f"a number from {SMALLEST:g} to {LARGEST:g}", float),
    "shift_frames": (
        lambda value: _is_number(value, -LONGEST_SHIFT, LONGEST_SHIFT) and value == int(value),
        f"a whole number from -{LONGEST_SHIFT} to {LONGEST_SHIFT}",
        int,
    ),
    "sole": (
        _is_sole,
        f"a foot of the bake, such as 'Fox/paw.L', or a mesh object, in at most {LONGEST_NAME} bytes",
        str,
    ),
}
"""Check of each field of an edit in JSON, its words in messages, and the type that it is stored as."""


def sole_id(footprint: Footprint) -> str:
    """Character and contact that made a print, such as `Walker/foot.L`."""
    return f"{footprint.character}/{footprint.sole}"


def _middle(footprint: Footprint) -> float:
    return round((footprint.start_frame + footprint.end_frame) / 2, 1)


def _check_fields(table: Mapping[str, object], known: tuple[str, ...], where: str) -> None:
    unknown = [key for key in table if key not in known]
    if unknown:
        raise damaged(where, f"unknown field {unknown[0]!r}. Known are: {', '.join(known)}.")
