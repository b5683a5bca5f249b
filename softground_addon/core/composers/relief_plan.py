"""The relief that the settings of a bake ask for, while it is made and afterwards, from its record."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..ground.material import GroundMaterial
from ..ground.surfaces import SURFACES
from ..motion.motion import CharacterMotion
from ..motion.sole_motion import Sole
from ..numerics.arrays import Array
from ..numerics.slices import Slices, sliced
from ..record.footprints import Footprint
from ..relief import amounts, tread_map
from ..relief.broken_crust import REACH, plate_length
from ..relief.steps import ReliefSettings, StepRelief, relief_of_steps
from ..relief.tread import PATTERNS, SoleTread, of_map
from ..settings import BakeSettings

BARS = ("HIKING", "TRAINER")
"""Patterns that materials may draw as bars across a print, where the mesh is too coarse for the pattern itself."""
IMAGE, SHOES = "IMAGE", "SHOES"
"""Patterns that are read: from an image that is the same under all soles, and from the undersides of each."""
FLESH = "BARE"
"""The pattern of a foot without a shoe."""

FEET_IN_SHOES = 2
"""Feet of those who wear shoes."""
PAW = 1.5
"""Length over breadth up to which a foot is a paw or a hoof: foxes' come to 1.4, figures' shoes begin at 1.6."""
APART = 0.1
"""Length over which toes are apart, over that of the sole, from which a foot is bare: a dinosaur's come to 0.25, rats'
to 0.4, shoes to 0."""
GAP = 0.01
"""Least distance of toes that are apart, over the length of the sole."""
LINES = 100
"""Across the front half of a sole, along which toes are looked for."""
UPRIGHT = 0.25
"""Share of their contacts for which feet in shoes are alone on the ground, at least: people may fall and lie there."""

TREAD = 0.003
"""Tread that the amounts of looks are given for [m]."""


def shod_of(inputs: Mapping[str, Any], footprints: Sequence[Footprint]) -> set[tuple[str, str]]:
    """Characters and names of the soles that wear shoes, by the settings and all footprints of a bake.

    They are the feet of those who have two, and go upright on them, unless these are paws or hooves or have toes apart.
    """
    shod = set()
    for character in inputs["characters"]:
        steps = [step for step in footprints if step.character == character["name"] and len(step.contact_cells)]
        limbs = {sole["name"] for sole in character["soles"] if sole["bone"] and sole["limb"]}
        feet = _two_feet(character)
        if _is_upright([step for step in steps if step.sole in feet], [step for step in steps if step.sole in limbs]):
            pattern = inputs["tread_pattern"]
            soles = {step.sole: step.pressed_by.pressing.sole for step in steps if step.pressed_by}
            bare = {name for name, sole in soles.items() if _is_bare(sole, pattern=pattern)}
            shod |= {(character["name"], name) for name in feet - bare}
    return shod


def _two_feet(character: Mapping[str, Any]) -> set[str]:
    """Names of the feet of a character that has two; else none."""
    feet = {sole["name"] for sole in character["soles"] if sole["bone"] and not sole["limb"]}
    return feet if len(feet) == FEET_IN_SHOES else set()


def _is_bare(sole: Sole, *, pattern: str) -> bool:
    """True if it is a paw, a hoof, or a foot with toes apart, to which the pattern of a bare foot may belong."""
    if sole.prop is not None:
        return False
    return sole.length < PAW * sole.breadth or (pattern != FLESH and _toes_apart(sole.outline) > APART)


def _toes_apart(outline: Array) -> float:
    """Length over which toes are apart, over that of the sole: where lines across its front half leave an outline
    (N, 2) and come back to it."""
    x, y = outline.T
    length = float(np.ptp(x))
    lines = x.max() - 0.5 * length * (np.arange(LINES) + 0.5) / LINES
    next_x, next_y = np.roll(x, -1), np.roll(y, -1)
    crosses = (x <= lines[:, None]) != (next_x <= lines[:, None])
    along = (lines[:, None] - x) / np.where(next_x == x, 1.0, next_x - x)
    ends = np.sort(np.where(crosses, y + along * (next_y - y), np.inf), axis=1)
    reentry, leaving = ends[:, 2::2], ends[:, 1:-1:2]
    gaps = np.where(np.isfinite(reentry), reentry, 0.0) - np.where(np.isfinite(reentry), leaving, 0.0)
    return 0.5 * float(np.mean((gaps > GAP * length).any(axis=1)))


def _is_upright(on_feet: Sequence[Footprint], on_limbs: Sequence[Footprint]) -> bool:
    """True if contacts of feet pass without those of other limbs."""
    if not on_feet or not on_limbs:
        return True
    of_feet, of_limbs = (
        np.rint([(step.start_frame, step.end_frame + 1.0) for step in of]).astype(np.intp) for of in (on_feet, on_limbs)
    )
    first = min(of_feet.min(), of_limbs.min())
    last = max(of_feet.max(), of_limbs.max())
    begun, ended = (np.bincount(times - first, minlength=last - first + 1) for times in of_limbs.T)
    alone = np.concatenate([[0], np.cumsum(np.cumsum(begun - ended) == 0)])  # frames without limbs before each
    start, end = of_feet.T
    return bool(np.mean((alone[end - first] - alone[start - first]) / np.maximum(end - start, 1)) >= UPRIGHT)


def asked_of(inputs: Mapping[str, Any], footprints: Sequence[Footprint]) -> ReliefSettings | None:
    """The relief that a bake was asked for, None where it has none.

    Parameters
    ----------
    inputs : mapping
        Of a bake, as the record has them.
    footprints : sequence of Footprint
        All of the bake.

    Raises
    ------
    InputError
        If they say what no bake has.
    """
    look = inputs.get("relief_look", "")
    if not look:
        return None
    try:
        numbers = [float(inputs[name]) for name in ("relief_strength", "tread_m")]
        treads, plates = _treads_of(inputs, shod_of(inputs, footprints)), plates_of(inputs)
        known = look in SURFACES
    except (KeyError, TypeError, ValueError, AttributeError, ArithmeticError):
        known, numbers, treads, plates = False, [], {}, {}
    if not known or not all(math.isfinite(number) and number >= 0 for number in numbers):
        raise InputError("The stored relief of the footprints is damaged: bake again.", "damaged_record")
    strength, tread = numbers
    if not strength > 0:
        return None
    looks = {step.surface: amounts.of_look(step.surface) for step in footprints if step.surface}
    return ReliefSettings(amounts.of_look(look), strength, treads, tread / TREAD, looks, plates)


def plates_of(inputs: Mapping[str, Any]) -> dict[str, float]:
    """Lengths of plates: see `ReliefSettings.plates`. Of regions of one surface, the first counts."""
    lengths: dict[str, float] = {}
    for kind in (inputs, *inputs.get("regions", ())):
        if kind.get("material") and SURFACES[kind["surface"]].melts:
            material = GroundMaterial(**kind["material"])
            lengths.setdefault(kind["surface"], plate_length(material, float(inputs["gravity_m_s2"])))
    return {**lengths, "": lengths.get(inputs.get("surface", ""), 0.0)}


def reach_of_relief(inputs: Mapping[str, Any]) -> float:
    """Distance from prints to which relief moves ground that they do not move [m]."""
    is_shown = inputs.get("relief_look") and inputs["relief_strength"] > 0
    return REACH * max(plates_of(inputs).values()) if is_shown else 0.0


def _treads_of(inputs: Mapping[str, Any], shod: set[tuple[str, str]]) -> dict[tuple[str, str], SoleTread]:
    """The treads of those in shoes, by character and name of the sole; none of those whose meshes show none.

    Raises
    ------
    KeyError, TypeError, ValueError
        If there is no such pattern.
    """
    pattern = inputs["tread_pattern"]
    if pattern == SHOES:
        maps = {(name, sole): text for name, sole, text in inputs["shoe_treads"]}
        return {key: SoleTread(of_map(tread_map.from_text(text))) for key, text in maps.items() if key in shod}
    under = of_map(tread_map.from_text(inputs["tread_image"])) if pattern == IMAGE else PATTERNS[pattern]
    sides = {
        (character["name"], sole["name"]): sole["side"]
        for character in inputs["characters"]
        for sole in character["soles"]
    }
    return {key: SoleTread(under, sides[key] == "L") for key in shod}


def with_shoe_treads(wanted: BakeSettings, motions: Sequence[CharacterMotion]) -> BakeSettings:
    """Settings with the treads of the soles of some motions, where these are asked for.

    Raises
    ------
    InputError
        If none of those who wear shoes has grooves in its soles.
    """
    if wanted.tread_pattern != SHOES or not (wanted.relief_look and wanted.tread_m > 0):
        return wanted
    treads = []
    feet = {(item["name"], name) for item in wanted.inputs()["characters"] for name in _two_feet(item)}
    soles = [
        (item.name, of_foot.sole)
        for item in motions
        for of_foot in item.soles
        if (item.name, of_foot.sole.name) in feet and not _is_bare(of_foot.sole, pattern=SHOES)
    ]
    for name, sole in soles:
        of_sole = tread_map.from_underside(sole.underside, sole.length) if sole.underside is not None else None
        if of_sole is not None:
            treads.append((name, sole.name, tread_map.as_text(of_sole)))
    if soles and not treads:
        names = ", ".join(f"'{name}'" for name in dict.fromkeys(name for name, _ in soles))
        raise InputError(
            f"The tread is to be that of the shoes, and the soles of {names} show no grooves",
            "no_grooves",
            remedy="model some into the undersides of their meshes (half a millimetre deep or more, vertices 4 mm "
            "apart or less), have these rendered, or choose another pattern.",
        )
    return replace(wanted, shoe_treads=tuple(treads))


@sliced
def relief_at(
    footprints: Sequence[Footprint], x: Array, y: Array, inputs: Mapping[str, Any], *, blur_sigma: float
) -> Slices[list[StepRelief]]:
    """The relief of each footprint at places (K,) [m], as the inputs of their bake ask; nothing at all where it is off.

    Raises
    ------
    InputError
        See `asked_of`.
    """
    asked = asked_of(inputs, footprints)
    if asked is None:
        return []
    return (yield from relief_of_steps.slices(footprints, x, y, asked, blur_sigma=blur_sigma))
