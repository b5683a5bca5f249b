"""What is known of a shot before it is baked: its loads on the ground and the depth to expect.

A shot is read when the user asks for something that needs it, and kept while Blender runs, outside the file. It counts
as known until what it was read from changes; what the add-on itself writes leaves it known.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy

from ...core.errors import InputError
from ...core.files import report
from ...core.ground.material import GroundMaterial, Pressure
from ...core.loads.cell_limits import pressed_area
from ...core.loads.estimate import CharacterLoads
from ...core.prediction import TAKES_NO_PRINT, PropLoad, StanceLoad, deepest, matching_modulus, stance_loads
from ...core.simulation import simulate
from .. import jobs, settings
from ..characters.character_setup import characters_of
from . import staleness
from .shots import Shot, estimate_shot, ground_of, read_shot

TRIALS = 4
"""Bakes that a match may compute: two are enough unless feet slide."""
CLOSE_ENOUGH = 0.005
"""Relative error of a matched depth."""


@dataclass(frozen=True)
class Analysis:
    """A shot that was read.

    Attributes
    ----------
    sources : frozenset of hashable
        What it was read from, as far as it is seen in the settings: several where the add-on itself changed them.
    hashes : frozenset of str
        Of the animation, the meshes and the ground that it was read from, likewise.
    terms : hashable
        What the loads depend on beside that.
    shot : Shot
    loads : list of CharacterLoads
    stances : list of StanceLoad or PropLoad
    area : float
        That the soles cover on the ground, with each step counted [m²].
    """

    sources: frozenset[Hashable]
    hashes: frozenset[str]
    terms: Hashable
    shot: Shot
    loads: list[CharacterLoads]
    stances: list[StanceLoad | PropLoad]
    area: float


_known: dict[int, Analysis] = {}
"""By session uid of the scene; a cache only: everything in it can be read again."""

_depths: dict[tuple[int, GroundMaterial, Pressure], float] = {}
"""Depths that were asked for lately, by identity of an analysis' stances; emptied with it."""


def forget() -> None:
    """Read shots anew from now on."""
    _known.clear()
    _depths.clear()


def look_again() -> None:
    """Forget the shots that were read from something else than what is there now, as after an undo."""
    scenes = {scene.session_uid: scene for scene in bpy.data.scenes}
    for uid, analysis in list(_known.items()):
        scene = scenes.get(uid)
        if scene is None or known(scene) is None or _hash_of(scene) not in analysis.hashes:
            del _known[uid]


def is_empty() -> bool:
    """Whether no shot is known."""
    return not _known


def known(scene: bpy.types.Scene) -> Analysis | None:
    """The scene's analysis if it was read and still holds, with the masses and force models that it was last asked for.

    Only looks; see `current`.
    """
    analysis = _known.get(scene.session_uid)
    return analysis if analysis and _source(scene) in analysis.sources else None


def current(scene: bpy.types.Scene) -> Analysis | None:
    """The scene's analysis if it was read and still holds, with the masses and force models of the moment."""
    analysis = known(scene)
    if analysis is None or analysis.terms == _terms(scene):
        return analysis
    try:
        return _keep(scene, analysis.shot, analysis.sources, analysis.hashes)
    except InputError:
        del _known[scene.session_uid]
        return None


def read(scene: bpy.types.Scene) -> Analysis:
    """The scene's analysis, read now if it is not known.

    Raises
    ------
    InputError
        If the shot could not be baked either; names what is wrong and the remedy.
    """
    analysis = current(scene)
    if analysis is None:
        shot = jobs.run(read_shot(scene))
        analysis = _keep(scene, shot, frozenset([_source(scene)]), frozenset([_hash_of(scene)]))
    return analysis


@contextmanager
def own_changes(scene: bpy.types.Scene) -> Iterator[None]:
    """What is changed within leaves the shot as it was read: prints, response, and a ground that is made to fit it."""
    if scene.session_uid in _known:
        _tell_of_changes(scene)  # of what others have changed until now, while it still counts
    analysis = known(scene)
    yield
    if analysis is None:
        return
    _tell_of_changes(scene)
    source = _source(scene)
    if source in analysis.sources:
        _known[scene.session_uid] = analysis
    elif analysis.shot.surface is None:
        sources, hashes = analysis.sources | {source}, analysis.hashes | {_hash_of(scene)}
        _known[scene.session_uid] = replace(analysis, sources=sources, hashes=hashes)


def _tell_of_changes(scene: bpy.types.Scene) -> None:
    """Have Blender call the handlers for what was changed by now."""
    for layer in scene.view_layers:
        layer.update()


def expected_depth(scene: bpy.types.Scene, material: GroundMaterial | None = None) -> float | None:
    """Depth of the deepest print to expect [m] in a material, or the scene's; None where the shot is not known."""
    analysis = current(scene)
    if analysis is None:
        return None
    key = _key(scene, analysis, material)
    if key not in _depths:
        _depths[key] = deepest(analysis.stances, *key[1:])
    return _depths[key]


def known_depth(scene: bpy.types.Scene) -> float | None:
    """The expected depth [m] if it was asked for since anything has changed that it depends on. Only looks."""
    analysis = known(scene)
    if analysis is None or analysis.terms != _terms(scene):
        return None
    return _depths.get(_key(scene, analysis))


def _key(
    scene: bpy.types.Scene, analysis: Analysis, material: GroundMaterial | None = None
) -> tuple[int, GroundMaterial, Pressure]:
    return id(analysis.stances), material or settings.material_of(scene), scene.softground.pressure


def match_depth(scene: bpy.types.Scene, depth: float) -> float:
    """The modulus [Pa] that gives the deepest print a depth [m] in a bake of the scene.

    Raises
    ------
    InputError
        If there is none, or the shot cannot be read.
    """
    analysis = read(scene)
    material = settings.material_of(scene)
    aim = depth
    for _ in range(TRIALS):
        material = replace(
            material, youngs_modulus=matching_modulus(analysis.stances, material, aim, scene.softground.pressure)
        )
        reached = _simulated_depth(scene, analysis, material)
        if not reached > 0:
            raise InputError(TAKES_NO_PRINT)
        if abs(reached - depth) <= CLOSE_ENOUGH * depth:
            break
        aim *= depth / reached  # sliding feet print less deep than predicted
    return material.youngs_modulus


def _simulated_depth(scene: bpy.types.Scene, analysis: Analysis, material: GroundMaterial) -> float:
    ground = replace(ground_of(scene, analysis.shot), material=material)
    results = simulate(analysis.loads, ground, settings.cell_size_of(scene))
    return max((footprint.max_depth_m for result in results for footprint in result.footprints), default=0.0)


def _keep(scene: bpy.types.Scene, shot: Shot, sources: frozenset[Hashable], hashes: frozenset[str]) -> Analysis:
    """Work the loads of a shot out and know it from now on."""
    loads = jobs.run(estimate_shot(scene, shot))
    stances = stance_loads(loads, shot.terrain, settings.cell_size_of(scene), shot.variation)
    analysis = Analysis(sources, hashes, _terms(scene), shot, loads, stances, pressed_area(loads))
    _known[scene.session_uid] = analysis
    _depths.clear()
    return analysis


def _hash_of(scene: bpy.types.Scene) -> str:
    """What a shot is read from, as far as it is not seen in the settings."""
    return report.hash_inputs(staleness.of_movers(scene), staleness.of_ground(scene))


def _source(scene: bpy.types.Scene) -> Hashable:
    """What a shot is read from, as far as it is seen in the settings; what else was edited is told by a handler."""
    options = scene.softground
    return (
        (options.frame_start, options.frame_end, settings.frame_rate_of(scene), settings.time_stretch_of(scene)),
        (settings.gravity_of(scene), scene.unit_settings.scale_length),
        options.ground and (options.ground.session_uid, *(tuple(row) for row in options.ground.matrix_world)),
        (options.painted.stiffness, options.painted.layer_depth, options.painted.rim),
        tuple(
            (
                character.armature and character.armature.session_uid,
                tuple((joint.name, joint.bone, joint.end) for joint in character.joints),
                tuple(
                    (s.name, s.side, s.kind, s.bone, s.toe_bone, s.object and s.object.name) for s in character.soles
                ),
            )
            for character in characters_of(scene)
        ),
    )


def _terms(scene: bpy.types.Scene) -> Hashable:
    tau = scene.softground.material.characteristic_time
    return tuple(
        (
            character.mass,
            character.force_model,
            tau if character.force_model == "IMPULSE" or character.armature is None else None,
        )
        for character in characters_of(scene)
    )
