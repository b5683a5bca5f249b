"""Analysis of a shot before it is baked: its loads on the ground and the predicted depth.

A shot is read when the user asks for something that needs it, and kept while Blender runs, outside the file. It counts
as known until what it was read from changes; what the add-on itself writes leaves it known.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import bpy

from ...core.composers.prediction import (
    ShotContacts,
    matching_modulus,
    pressed_again,
    pressed_contacts,
    typical_depth,
)
from ...core.errors import InputError
from ...core.files import report
from ...core.ground.material import GroundMaterial, Pressure
from ...core.loads.cell_limits import Coverage, coverage_of
from ...core.loads.estimate import CharacterLoads
from ...core.numerics.arrays import Array
from ...core.response.root_motion import lacking_velocity
from ...core.settings import Acts, BakeSettings
from .. import jobs, settings
from ..ground import ground_surface
from ..ground.still_ground import mover_of
from ..state import state
from . import staleness
from .shots import Shot, estimate_shot, ground_of, read_shot, settings_of

TRIALS = 3
"""Moduli that a match may press all contacts with: one is enough unless other contacts become typical."""
CLOSE_ENOUGH = 0.005
"""Relative error of a matched depth."""

_Source = tuple[Mapping[str, Any], Any, Any]
"""Settings that decide what is read of a shot, and where its ground lies."""


@dataclass(frozen=True, eq=False)
class Analysis:
    """A shot that was read; each reading is its own.

    Attributes
    ----------
    sources : tuple
        What it was read from, as far as it is seen in the settings: several where the add-on itself changed them.
    hashes : frozenset of str
        Of the animation, the meshes and the ground that it was read from, likewise.
    terms : tuple
        Settings that the loads and the contacts depend on beside that.
    coverage : Coverage
        What the soles cover on the ground.
    """

    sources: tuple[_Source, ...]
    hashes: frozenset[str]
    terms: tuple[Any, ...]
    shot: Shot
    loads: list[CharacterLoads]
    contacts: ShotContacts
    coverage: Coverage

    @cached_property
    def belts(self) -> dict[str, Array]:
        """Velocity of the belt on which each character walks on the spot, by its name, (2,) [m/s]: as Root Motion's."""
        each = zip(self.shot.motions, self.loads, strict=True)
        lacking = {motion.name: lacking_velocity(motion, loads, self.shot.terrain) for motion, loads in each}
        return {name: -velocity for name, velocity in lacking.items() if velocity is not None}


def forget() -> None:
    """Read shots anew from now on."""
    state.analyses.clear()
    state.depths.clear()


def look_again() -> None:
    """Forget the shots that were read from something else than what is there now, as after an undo."""
    scenes = {scene.session_uid: scene for scene in bpy.data.scenes}
    for uid, analysis in list(state.analyses.items()):
        scene = scenes.get(uid)
        wanted = settings.snapshot(scene) if scene else None
        if wanted is None or known(wanted) is None or _hash_of(wanted) not in analysis.hashes:
            del state.analyses[uid]


def is_empty() -> bool:
    """True if no shot is known."""
    return not state.analyses


def known(wanted: BakeSettings) -> Analysis | None:
    """Analysis of the scene of some settings, if it was read and still holds, with the masses and force models that it
    was last asked for.

    Only looks; see `refreshing`.
    """
    analysis: Analysis | None = state.analyses.get(wanted.scene.uid)
    return analysis if analysis and _source(wanted) in analysis.sources else None


def refreshing(wanted: BakeSettings) -> jobs.Job[Analysis | None]:
    """Analysis of the scene of some settings, if it was read and still holds, with their masses and force models."""
    analysis, uid = known(wanted), wanted.scene.uid
    if analysis is None or analysis.terms == _terms(wanted):
        return analysis
    try:
        return (yield from _keep(wanted, analysis.shot, analysis.sources, analysis.hashes))
    except InputError:
        state.analyses.pop(uid, None)
        return None


def read(scene: bpy.types.Scene) -> Analysis:
    """The scene's analysis, read now if it is not known.

    Raises
    ------
    InputError
        If the shot could not be baked either; names what is wrong and the remedy.
    """
    return jobs.run(reading(scene))


def reading(scene: bpy.types.Scene) -> jobs.Job[Analysis]:
    """Job of `read`."""
    analysis = yield from refreshing(settings.snapshot(scene))
    if analysis is None:
        wanted = settings_of(scene)
        shot = replace((yield from read_shot(replace(wanted, response=None))), layout=None)  # which is large
        hashes = frozenset([_hash_of(settings.snapshot(scene))])
        analysis = yield from _keep(wanted, shot, (_source(wanted),), hashes)
        _tell_of_changes(scene.view_layers)  # response layers were switched off and on again, which is no edit
        state.analyses[scene.session_uid] = analysis
    return analysis


@contextmanager
def own_changes(scene: bpy.types.Scene) -> Iterator[None]:
    """Context of changes that leave the shot as it was read: prints, response, a ground made to fit it."""
    analysis = None
    if scene.session_uid in state.analyses:
        _tell_of_changes(scene.view_layers)  # of what others have changed until now, while it still counts
        analysis = known(settings.snapshot(scene))
    yield
    if analysis is None:
        return
    _tell_of_changes(scene.view_layers)
    now = settings.snapshot(scene)
    source = _source(now)
    if source in analysis.sources:
        state.analyses[scene.session_uid] = analysis
    elif analysis.shot.surface is None:
        sources, hashes = (*analysis.sources, source), analysis.hashes | {_hash_of(now)}
        state.analyses[scene.session_uid] = replace(analysis, sources=sources, hashes=hashes)


def _tell_of_changes(view_layers: Iterable[bpy.types.ViewLayer]) -> None:
    """Have Blender call the handlers for what was changed by now."""
    for layer in view_layers:
        layer.update()


def expected_depth(scene: bpy.types.Scene, material: GroundMaterial | None = None) -> float | None:
    """Depth of the typical print to expect [m] in a material, or the scene's; None where the shot is not known."""
    return jobs.run(working_out_depth(settings.snapshot(scene), material))


def working_out_depth(wanted: BakeSettings, material: GroundMaterial | None = None) -> jobs.Job[float | None]:
    """Job of `expected_depth`, with some settings of the scene."""
    analysis = yield from refreshing(wanted)
    if analysis is None:
        return None
    key = _key(wanted, analysis, material)
    if key not in state.depths:
        work = typical_depth.slices(analysis.contacts, *key[1:])
        state.depths[key] = yield from jobs.meanwhile(jobs.Progress("sample", 1.0), work)
    return state.depths[key]


def pressing_all(wanted: BakeSettings) -> jobs.Job[None]:
    """Press every contact into the material of some settings, where its depth comes from a sample of them."""
    analysis, uid = known(wanted), wanted.scene.uid
    if analysis is None or analysis.terms != _terms(wanted) or analysis.contacts.is_in(*_key(wanted, analysis)[1:]):
        return
    work = pressed_again.slices(analysis.contacts, wanted.material, wanted.pressure)
    contacts = yield from jobs.meanwhile(jobs.Progress("sample", 1.0), work)
    latest: Analysis | None = state.analyses.get(uid)
    if latest is analysis:
        state.analyses[uid] = renewed = replace(analysis, contacts=contacts)
        state.depths.clear()
        state.depths[_key(wanted, renewed)] = contacts.typical


def known_depth(analysis: Analysis, wanted: BakeSettings) -> float | None:
    """The expected depth [m] if it was asked for since anything has changed that it depends on. Only looks."""
    return state.depths.get(_key(wanted, analysis)) if analysis.terms == _terms(wanted) else None


def _key(
    wanted: BakeSettings, analysis: Analysis, material: GroundMaterial | None = None
) -> tuple[int, GroundMaterial, Pressure]:
    return id(analysis.contacts), material or wanted.material, wanted.pressure


def match_depth(scene: bpy.types.Scene, depth: float) -> float:
    """The modulus [Pa] that gives the typical print a depth [m] in a bake of the scene.

    Raises
    ------
    InputError
        If there is none, or the shot cannot be read.
    """
    analysis, wanted = read(scene), settings.snapshot(scene)
    contacts, material = analysis.contacts, wanted.material
    for _ in range(TRIALS):
        modulus = matching_modulus(contacts, material, depth, wanted.pressure)
        material = replace(material, youngs_modulus=modulus)
        contacts = pressed_again(contacts, material, wanted.pressure)
        if abs(contacts.typical - depth) <= CLOSE_ENOUGH * depth:
            break
    return material.youngs_modulus


def _keep(wanted: BakeSettings, shot: Shot, sources: tuple[_Source, ...], hashes: frozenset[str]) -> jobs.Job[Analysis]:
    """Work the loads of a shot out and know it from now on."""
    loads = yield from estimate_shot(wanted, shot)
    pressing = pressed_contacts.slices(loads, ground_of(wanted, shot), wanted.cell_size_m)
    contacts = yield from jobs.meanwhile(jobs.Progress("sample", 1.0), pressing)
    analysis = Analysis(sources, hashes, _terms(wanted), shot, loads, contacts, coverage_of(loads))
    state.analyses[wanted.scene.uid] = analysis
    state.depths.clear()
    state.depths[_key(wanted, analysis)] = contacts.typical
    return analysis


def _hash_of(wanted: BakeSettings) -> str:
    """Hash of the inputs of reading a shot that are not in the settings."""
    objects = settings.scene_named(wanted.scene).objects
    return report.hash_inputs(staleness.of_movers(objects, wanted), staleness.of_ground(wanted))


def _source(wanted: BakeSettings) -> _Source:
    """Inputs of reading a shot that are in the settings; a handler notices other edits."""
    scene = settings.scene_with(wanted.scene.uid) if wanted.ground else None
    ground = scene and scene.softground.ground  # a redraw looks for no object by its name
    beside = [settings.find(name) for name in (*wanted.soft_grounds[1:], *wanted.hard_grounds)]
    return _parts(wanted)[0], ground and _place(ground), list(map(_place, filter(None, beside)))


def _place(ground: bpy.types.Object) -> list[tuple[float, ...]]:
    """World matrix of the ground, without evaluating the scene, which would call the handlers; empty for a ground that
    moves, which is compared by hash."""
    if mover_of(ground):
        return []
    return [tuple(row[:]) for row in (ground_surface.placed_by_parents(ground) or ground.matrix_world)[:]]


def _terms(wanted: BakeSettings) -> tuple[Any, ...]:
    """Settings that loads and contacts depend on: all that act on prints, but for those that a prediction varies."""
    landing = any(character.force_model == "IMPULSE" or character.armature is None for character in wanted.characters)
    return _parts(wanted)[1], wanted.material.characteristic_time if landing else None


def _parts(wanted: BakeSettings) -> tuple[dict[str, Any], dict[str, Any]]:
    if not state.parted or state.parted[0] != wanted:
        pressing = wanted.between(Acts.LOADS, Acts.PRESSING)
        for asked in ("material", "pressure", "preset"):
            del pressing[asked]
        state.parted = wanted, (wanted.between(Acts.READING, Acts.READING), pressing)
    parts: tuple[dict[str, Any], dict[str, Any]] = state.parted[1]
    return parts
