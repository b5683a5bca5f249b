"""When the feet of other people's rigs are down, drawn beside where their skin rests: one picture for each clip.

    python -m tests.validation.contact_sheets RIGS.json FOLDER [CLIP ...]

RIGS.json lists clips: `clip`, the name; `file` beside it; `action`, its name on the first armature; `scale` of a BVH.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any

import bpy
import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

mpl.use("Agg")
from matplotlib import pyplot as plt

import softground_addon
from softground_addon.blender import jobs
from softground_addon.blender.characters.selection import set_up_automatically
from softground_addon.blender.reading.shots import estimate_shot, read_shot, settings_of
from softground_addon.core.checks.skin_check import BESIDE, NEAR
from softground_addon.core.ground.heightfield import Terrain
from softground_addon.core.loads.estimate import CharacterLoads
from softground_addon.core.motion.motion import LowSkin
from softground_addon.core.numerics.intervals import runs
from softground_addon.core.skin.skin_motion import CALM_SPEED

Array = NDArray[np.float64]

HIGHEST = 0.25
"""What is higher than this over the ground is left out, in body heights."""


def open_clip(clip: dict[str, Any], folder: Path) -> bpy.types.Scene:
    """A scene with nothing but a clip in it, over the frames of its action."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    file = str(folder / clip["file"])
    if file.endswith(".blend"):
        bpy.ops.wm.open_mainfile(filepath=file)
    elif file.endswith((".glb", ".gltf")):
        bpy.ops.import_scene.gltf(filepath=file)
    elif file.endswith(".fbx"):
        bpy.ops.import_scene.fbx(filepath=file)
    else:
        scale = clip.get("scale", 0.01)
        bpy.ops.import_anim.bvh(filepath=file, global_scale=scale, update_scene_fps=True, update_scene_duration=True)
    scene = bpy.context.scene
    armature = next(obj for obj in scene.objects if obj.type == "ARMATURE")
    animation = armature.animation_data or armature.animation_data_create()
    if "action" in clip:
        for track in animation.nla_tracks:
            track.mute = True
        action = bpy.data.actions[clip["action"]]
        animation.action = action
        if getattr(animation, "action_slot", 0) is None:
            animation.action_slot = action.slots[0]
    first, last = animation.action.frame_range
    scene.frame_start, scene.frame_end = int(first), ceil(last)
    bpy.context.view_layer.update()
    return scene


def read_clip(scene: bpy.types.Scene) -> tuple[CharacterLoads, Terrain]:
    """The loads of a scene's character as they are found by default, and the ground that fits it."""
    set_up_automatically(scene)
    wanted = settings_of(scene)
    shot = jobs.run(read_shot(wanted))
    return jobs.run(estimate_shot(wanted, shot))[0], shot.terrain


def draw_sheet(name: str, loads: CharacterLoads, terrain: Terrain, file: Path) -> None:
    """A row for each sole: how high it is, when it touches, and where skin near it rests.

    What the character as a whole floats or sinks by is taken out of the soles; what one foot does more is shown.
    """
    motion, touching, skin = loads.motion, loads.contacts.touching, loads.motion.skin
    height = skin.height if skin else 2 * motion.leg_length
    offset = np.median(loads.contacts.offset[touching.any(axis=0)]) if touching.any() else 0.0
    figure, rows = plt.subplots(
        len(motion.soles),
        1,
        figsize=(9, 1 + 1.4 * len(motion.soles)),
        sharex=True,
        squeeze=False,
        layout="constrained",
    )
    for row, sole, touches in zip(rows[:, 0], motion.soles, touching.T, strict=True):
        points = sole.landmark_positions()
        over = (points[..., 2] - terrain.heights(points[..., 0], points[..., 1])).min(axis=1) / height
        over -= offset / height
        row.plot(motion.frames, np.where(over < HIGHEST, over, np.nan), color="tab:blue", label="sole")
        for first, end in zip(*runs(touches), strict=True):
            row.axvspan(motion.frames[first], motion.frames[end - 1], color="tab:orange", alpha=0.35, linewidth=0)
        if skin is not None:
            frames, heights = _resting_near(skin, terrain, motion.frames, points.mean(axis=1)[:, :2])
            row.plot(frames, heights / height, "k.", markersize=4, label="resting skin")
        row.axhline(0, color="gray", linewidth=0.6)
        row.set_ylabel(sole.sole.name, rotation=0, ha="right")
        row.set_ylim(-0.06, HIGHEST)
    rows[-1, 0].set_xlabel("frame; heights in body heights; shaded: contact; dots: calm skin on the ground beside it")
    figure.suptitle(f"{name}: {height:.3g} m, {motion.mass:.3g} kg, soles {offset * 100:+.1f} cm over the ground")
    figure.savefig(file, dpi=80)
    plt.close(figure)


def _resting_near(skin: LowSkin, terrain: Terrain, frames: Array, places: Array) -> tuple[Array, Array]:
    """Frames and heights [m] of the skin that touches the ground calmly beside a sole."""
    x, y, z = np.moveaxis(skin.position, -1, 0)
    over = z - terrain.heights(x, y)
    at = np.stack([np.interp(skin.frames, frames, places[:, axis]) for axis in range(2)], axis=-1)
    beside = np.linalg.norm(skin.position[..., :2] - at[:, None], axis=-1) < BESIDE * skin.height
    rests = beside & (np.abs(over) < NEAR * skin.height) & (skin.rise < CALM_SPEED * skin.height)
    frame, _ = np.nonzero(rests)
    return skin.frames[frame], over[rests]


def main(listing: str, target: str, wanted: Sequence[str]) -> None:
    """Draw the sheets of all clips, or of those that are named."""
    path, folder = Path(listing).resolve(), Path(target)
    folder.mkdir(parents=True, exist_ok=True)
    for clip in json.loads(path.read_text()):
        if wanted and clip["clip"] not in wanted:
            continue
        file = folder / f"{clip['clip']}.png"
        draw_sheet(clip["clip"], *read_clip(open_clip(clip, path.parent)), file)
        print(file, flush=True)


if __name__ == "__main__":
    softground_addon.register()
    try:
        main(sys.argv[1], sys.argv[2], sys.argv[3:])
    finally:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        softground_addon.unregister()
