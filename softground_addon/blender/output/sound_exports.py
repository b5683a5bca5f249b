"""The sound of a bake's steps as a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ...core.errors import InputError
from ...core.events import sound, wave_file
from ...core.events.sound import SoundStep
from ...core.files import files
from .. import settings
from ..baking import bake_report
from ..ground import baked_ground, baked_steps
from ..placement import in_scene


def write(
    scene: bpy.types.Scene,
    path: Path,
    start: int,
    end: int,
    *,
    samples: Path | None = None,
    stereo: bool = False,
) -> None:
    """Write the sound of some frames, which begins with the first of them, of the steps on all grounds of a scene.

    Parameters
    ----------
    start, end : int
        First and last frame.
    samples : Path, optional
        Folder of recordings to play instead of computed sounds.
    stereo : bool
        True if each step comes from where the camera sees it.

    Raises
    ------
    InputError
        If there is no bake or it has no events, the folder has no recordings or the file is one of them, there is no
        camera, or the file cannot be written.
    """
    rate = settings.timeline_of(scene).frame_rate
    bakes = bake_report.heard_bakes(scene.softground)
    steps = [(step, bake.ground) for bake in bakes for step in _steps_of(bake, rate, start)]
    recordings = _recordings(samples, path) if samples else []
    heard_steps = _seen_by_camera(scene, steps) if stereo else [step for step, _ in steps]
    heard = sound.footsteps(heard_steps, (end - start + 1) / rate, recordings)
    with files.replacing(path) as partial:
        partial.write_bytes(wave_file.dump(heard))


def _steps_of(bake: bake_report.HeardBake, rate: float, start: int) -> list[SoundStep]:
    """Sounding steps of a bake, as `sound.steps_of` has them, in the frame of that bake."""
    record = baked_ground.record_of(bake.ground)
    prints = [(step.name, step.footprint) for step in record.steps if step.footprint]
    footprints = {name: each for name, each in prints if bake.has(each.character, each.start_frame)}
    table = baked_ground.events_in_frame(bake.ground, record)
    table = [row for row in table if bake.has(row["character"], row["frame"])]
    return sound.steps_of(footprints, table, frame_rate=rate, first_frame=start)


def _recordings(folder: Path, target: Path) -> list[tuple[str, np.ndarray]]:
    """All WAV files of a folder, by name; the sound is not to be written over one of them."""
    if not folder.is_dir():
        raise InputError(f"There is no folder '{folder}': choose one that holds WAV files of single steps.")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() == ".wav" and path.is_file())
    if not paths:
        raise InputError(f"There is no WAV file in '{folder}': choose a folder that holds recordings of single steps.")
    if files.identity(target) in map(files.identity, paths):
        raise InputError(
            f"'{target.name}' is one of your own sounds and would be overwritten: keep those in a folder of their own."
        )
    return [(path.name, wave_file.read(path)) for path in paths]


def _seen_by_camera(scene: bpy.types.Scene, steps: Sequence[tuple[SoundStep, bpy.types.Object]]) -> list[SoundStep]:
    """The steps on their grounds with the gains of two channels: to the side where the camera sees them, softer the
    farther they are."""
    camera = scene.camera
    if camera is None:
        raise InputError(
            f"Scene '{scene.name}' has no camera to hear the steps from: add one, or make the sound "
            "without Stereo from Camera."
        )
    frames = {ground: baked_steps.frame_of(ground) for _, ground in steps}
    frame, subframe = scene.frame_current, scene.frame_subframe
    seen = []
    try:
        for step, ground in steps:
            scene.frame_set(int(step.frame))
            here = in_scene(step.position, scene, frames[ground], ground)
            place = camera.matrix_world.inverted() @ Vector(here.tolist())
            seen.append((place.x, max(place.length, 1e-6)))
    finally:
        scene.frame_set(frame, subframe=subframe)
    nearest = min((distance for _, distance in seen), default=1.0)
    gains = (_gains(side / far, nearest / far) for side, far in seen)
    return [replace(step, gains=gain) for (step, _), gain in zip(steps, gains, strict=True)]


def _gains(side: float, loud: float) -> tuple[float, float]:
    """Gains of left and right, of equal power wherever the sound is between -1 and 1."""
    angle = (side + 1.0) * np.pi / 4
    return float(loud * np.cos(angle)), float(loud * np.sin(angle))
