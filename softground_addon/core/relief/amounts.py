"""Amounts of the relief that a ground shows, layer by layer, from a table in JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any

from ..errors import InputError, damaged
from ..ground import surfaces
from .layers import Apron, Cracks, Crumbs, Edge, Fans, Fissures, Floor, Layer, Lip, Lumps, Streaks

FOLDER = Path(__file__).parents[2] / "presets" / "relief"
"""Where the tables of amounts are that surfaces name."""

LAYERS: Mapping[str, type[Layer]] = {
    "edge": Edge,
    "lumps": Lumps,
    "floor": Floor,
    "apron": Apron,
    "streaks": Streaks,
    "fans": Fans,
    "lip": Lip,
    "cracks": Cracks,
    "fissures": Fissures,
}
"""The layers by the names that a table gives them; several of one kind are a list."""

LARGEST = 1e4
"""Largest number in a table [mm]."""


@dataclass(frozen=True)
class Bend:
    """Bends of outlines, by an `amount` and of a `size` [mm]."""

    size: float
    amount: float


@dataclass(frozen=True)
class Chunks:
    """Pieces of a `size` that are missing from the edge, or still stand, by up to about half of `shift` [mm]."""

    size: float
    shift: float
    share: float = 0.55


@dataclass(frozen=True)
class Tread:
    """Height of a tread's ridges [mm], and the parts of it that are lost in the best and worst places."""

    height: float
    least_lost: float = 0.0
    lost: float = 0.7


@dataclass(frozen=True)
class Water:
    """Water that gathers in the deepest part of prints: `above` it [mm], over about a `share` of the floor."""

    above: float
    share: float = 0.3


@dataclass(frozen=True)
class Amounts:
    """The relief of a ground. Lengths are millimetres.

    Attributes
    ----------
    depth : float
        Depth of the prints that the heights are given for; those of shallower ones are lower.
    bends : tuple of Bend
        Of the outline and all that lies along it.
    bends_with_depth : bool
        True if walls are bent at each depth otherwise.
    ledges : tuple of Bend
        Offsets of the wall, out or back, at each of its heights.
    wall : float
        Width of the wall seen from above; 0 keeps the walls that the simulation has.
    surface : str
        That the crumbs are of, see `core.ground.surfaces`.
    """

    depth: float
    bends: tuple[Bend, ...] = ()
    bends_with_depth: bool = False
    chunks: Chunks | None = None
    ledges: tuple[Bend, ...] = ()
    wall: float = 0.0
    tread: Tread | None = None
    water: Water | None = None
    layers: tuple[Layer, ...] = ()
    crumbs: Crumbs | None = None
    surface: str = ""


@cache
def of_look(look: str) -> Amounts:
    """The amounts of a look.

    Raises
    ------
    InputError
        If there is no table of it, or it holds something else.
    """
    path = FOLDER / f"{surfaces.find(look).relief}.json"
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"Relief '{path}' cannot be read: {error}", "unreadable_file", path=path) from None
    return parse(text, f"Relief '{path}'", look)


def parse(text: str, origin: str, surface: str) -> Amounts:
    """The amounts in the text of a table, for a surface.

    Raises
    ------
    InputError
        Naming `origin`, and the field that is wrong.
    """
    try:
        table = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise damaged(origin, f"this is not JSON ({error}).") from None
    if not isinstance(table, dict):
        raise damaged(origin, "this is not a table of amounts.")
    layers = [
        _made(kind, values, f"{origin}, {name}")
        for name, kind in LAYERS.items()
        for values in _list(table.pop(name, []))
    ]
    parts: dict[str, Any] = {}
    for name in ("bends", "ledges"):
        parts[name] = tuple(_made(Bend, bend, f"{origin}, {name}") for bend in _list(table.pop(name, [])))
    for name, kind in (("chunks", Chunks), ("tread", Tread), ("water", Water), ("crumbs", Crumbs)):
        if name in table:
            parts[name] = _made(kind, table.pop(name), f"{origin}, {name}")
    with_depth = table.pop("bends_with_depth", False) is True
    plain = _made(Amounts, table, origin)
    parts |= {"wall": plain.wall, "bends_with_depth": with_depth, "layers": tuple(layers), "surface": surface}
    return Amounts(plain.depth, **parts)


def _list(values: Any) -> list[Any]:
    return values if isinstance(values, list) else [values]


def _made(kind: type[Any], values: Any, origin: str) -> Any:
    """An instance of a dataclass of numbers from a table."""
    known = {field.name: field for field in fields(kind)}
    if not isinstance(values, dict) or not values.keys() <= known.keys():
        raise damaged(origin, f"it must be a table of {', '.join(known)}.")
    for name, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise damaged(origin, f"'{name}' is {value!r}; it must be a number.")
        if abs(value) > LARGEST:
            raise damaged(origin, f"'{name}' is {value!r}; it must be at most {LARGEST:g}.")
    missing = [name for name, field in known.items() if field.default is MISSING and name not in values]
    if missing:
        raise damaged(origin, f"it lacks {', '.join(missing)}.")
    return kind(**values)
