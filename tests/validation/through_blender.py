"""Motions as a user's rig gives them: imported from BVH into Blender, mapped and sampled by the add-on."""

from __future__ import annotations

from pathlib import Path

import bpy

from softground_addon.blender.rigs.rig_mapping import map_rig
from softground_addon.blender.sampling.rig_sampling import sample_character
from softground_addon.blender.sampling.take import Take
from softground_addon.core.motion.motion import CharacterMotion


def motion_of_bvh(
    file: Path,
    *,
    mass: float,
    rate: float | None = None,
    scale: float = 0.01,
    forward: str = "-Z",
    up: str = "Y",
) -> CharacterMotion:
    """Import a BVH into an empty scene and read it with the automatic set-up.

    Parameters
    ----------
    file : Path
    mass : float
        [kg]
    rate : float, optional
        Frames per second of the scene [Hz], by default as the file says.
    scale : float
        Metres per unit of the file.
    forward, up : str
        Axes of the file, as the importer calls them.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_anim.bvh(
        filepath=str(file),
        global_scale=scale,
        axis_forward=forward,
        axis_up=up,
        use_fps_scale=False,
        update_scene_fps=rate is None,
        update_scene_duration=True,
    )
    scene = bpy.context.scene
    if rate is not None:
        scene.render.fps = max(1, round(rate))
        scene.render.fps_base = scene.render.fps / rate
    armature = bpy.context.view_layer.objects.active
    start, end = armature.animation_data.action.frame_range
    take = Take.about(armature, scene, range(round(start), round(end) + 1))
    sampling = sample_character(take, armature, map_rig(armature), mass=mass)
    while True:
        try:
            next(sampling)
        except StopIteration as finished:
            return finished.value
