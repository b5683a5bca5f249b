"""The frame that a bake is solved in, where it is not the world's: on ground that moves or is far from the origin, and
where gravity points elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.motion.ground_frame import GroundFrame, axes_of, rows, upright
from ...core.motion.ground_ride import EVEN, GroundRide
from ...core.numerics.arrays import Array
from ...core.numerics.rigid import unit
from ...core.settings import BakeSettings
from .. import jobs, settings
from ..ground.still_ground import mover_of
from ..placement import felt_gravity, still_frame, world_matrix
from ..sampling.rig_recording import record_props
from ..sampling.sampling_scene import object_named
from ..sampling.take import Take

STIFF = 1e-4
"""Largest change of a rigid ground's axes, relative to their length."""
STEEPEST = 60.0
"""Largest tilt of ground against the force on bodies there [degrees]: no height field holds on steeper ground."""
MESH = 100.0
"""Spacing of the places at which the frame lies for a ground that is still to be created [m]."""


def framed(wanted: BakeSettings) -> BakeSettings:
    """The settings, with the frame that their scene is to be read and solved in.

    Raises
    ------
    InputError
        If the ground moves in a way that no frame follows.
    """
    ground, bodies = np.eye(4), list(_bodies(wanted))
    direction = felt_gravity(wanted.gravity_direction, bodies)
    if wanted.ground:
        ground = world_matrix(settings.resolve(wanted.ground))
        if mover_of(settings.resolve(wanted.ground)) and (frame := _moving(wanted, -np.array(direction))):
            return replace(wanted, frame=frame)
    elif bodies:
        place = world_matrix(bodies[0])[:3, 3] * wanted.unit_scale_m
        ground[:3, 3] = np.round(place / MESH) * MESH / wanted.unit_scale_m
    frame = still_frame(ground, wanted, direction)
    if frame is None:
        return wanted
    in_metres = np.array(frame.matrix)
    in_metres[:3, 3] *= wanted.unit_scale_m
    return replace(wanted, frame=frame, camera=wanted.camera and wanted.camera.moved(in_metres))


def _moving(wanted: BakeSettings, up: Array) -> GroundFrame | None:
    """The frame of a ground with a mover; None where the ground stays where it is all the same."""
    assert wanted.ground
    ground, scale = settings.resolve(wanted.ground), wanted.unit_scale_m
    name, frames = ground.name, range(wanted.frames[0], wanted.frames[1] + 1)
    from_origin = np.eye(4)
    from_origin[:3, 3] = world_matrix(ground)[:3, 3]
    take = Take(wanted.scene, frames, replace(wanted.units, frame=GroundFrame(rows(np.linalg.inv(from_origin)))))
    beside = [*wanted.hard_grounds, *wanted.soft_grounds[1:]]
    matrices, *of_others = jobs.run(_paths(take, [ground, *map(settings.resolve, beside)]))
    axes = axes_of(matrices)
    shape = np.swapaxes(axes, -1, -2) @ matrices[:, :3, :3]
    if np.ptp(shape, axis=0).max() > STIFF * np.abs(shape).max():
        raise InputError(
            f"Ground '{name}' changes its size in these frames: take the keys off its scale, and off those of its "
            "parents, or choose a copy without them."
        )
    rounding = EVEN * np.spacing(np.abs(from_origin[:3, 3] + matrices[:, :3, 3]).max().astype(np.float32))
    for other, path in zip(beside, of_others, strict=True):
        apart = np.swapaxes(axes, -1, -2) @ (path - matrices)[:, :3]
        if np.ptp(apart, axis=0).max() > STIFF * np.abs(apart).max() + rounding:
            where = " in Hard Ground" if other in wanted.hard_grounds else ""
            raise InputError(
                f"'{other.name}'{where} does not move as ground '{name}' does: parent it to what that is parented to, "
                "or remove it from the list."
            )
    matrices = from_origin @ matrices
    if not np.ptp(matrices, axis=0).any():
        return None
    to_world = np.tile(np.eye(4), (len(frames), 1, 1))
    to_world[:, :3, :3] = axes
    to_world[:, :3, 3] = matrices[:, :3, 3] * scale
    numbers = np.array(frames, dtype=np.float64)

    def ride() -> GroundRide:
        return GroundRide.of(numbers, to_world, wanted.frame_rate, up, wanted.gravity_m_s2)

    own_up = ride().rest
    level = upright(own_up.mean(axis=0))
    if (leaning := _lean(own_up)).max() > STEEPEST:
        tilt, most = leaning.max(), f"and at most {STEEPEST:.0f}° can be baked at once"
        if _lean(up @ axes).max() > STEEPEST:
            raise InputError(
                f"Ground '{name}' tilts by up to {tilt:.0f}° against what pulls on it, at frame "
                f"{frames[leaning.argmax()]}, {most}: bake fewer frames, or choose a ground that turns less."
            )
        changes = np.linalg.norm(np.einsum("fij,fj->fi", axes, own_up) - up, axis=1) * wanted.gravity_m_s2
        raise InputError(
            f"Ground '{name}' changes its speed by {changes.max():.0f} m/s² around frame {frames[changes.argmax()]}, "
            f"which tilts what pulls on those who stand there by up to {tilt:.0f}°, {most}: key it before Start and "
            "after End, or make its curves linear (Graph Editor > Key > Interpolation Mode)."
        )
    to_world[:, :3, :3] = to_world[:, :3, :3] @ level.T
    in_units = to_world.copy()
    in_units[:, :3, 3] /= scale
    path = np.linalg.inv(in_units)
    place = path[0] @ matrices[0]
    frame = GroundFrame(rows(place), True, float(frames[0]), path, ride())
    return replace(frame, riding=_riding(take.scene.objects, ground, place))


def _lean(up: Array) -> Array:
    """Angle of each direction (F, 3) from their mean, (F,) [degrees]."""
    return np.degrees(np.arccos(np.clip(unit(up) @ upright(up.mean(axis=0))[2], -1.0, 1.0)))


def _paths(take: Take, objects: Sequence[bpy.types.Object]) -> jobs.Job[list[Array]]:
    """Where some objects are at each frame, in the frame of its units, (F, 4, 4) each [Blender units]."""
    names, name = [obj.name_full for obj in objects], objects[0].name
    reading = record_props(take, name, list(dict.fromkeys(names)))
    recording = yield from jobs.counted(reading, "sample", len(take.frames))
    metres = np.array([take.units.unit_scale_m] * 3 + [1.0])[:, None]
    return [recording.props[name] / metres for name in names]


def _riding(objects: settings.Objects, ground: bpy.types.Object, place: Array) -> dict[str, Array]:
    """Space of each mesh that the same object moves, to the frame in which the ground's own is at some place (4, 4)."""
    to_frame, mover = place @ np.linalg.inv(world_matrix(ground)), mover_of(ground)
    riders = (obj for obj in objects if obj.type == "MESH" and obj != ground and mover_of(obj) == mover)
    return {obj.name_full: to_frame @ world_matrix(obj) for obj in riders}


def _bodies(wanted: BakeSettings) -> Iterator[bpy.types.Object]:
    for character in wanted.characters:
        if owner := character.armature or character.body:
            yield settings.resolve(owner)
        yield from (object_named(sole.object) for sole in character.soles if sole.object)
