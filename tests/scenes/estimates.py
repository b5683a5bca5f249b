"""The add-on's own reading of a generated motion: contacts and forces as a bake finds them."""

from __future__ import annotations

import numpy as np

from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial

SNOW = GroundMaterial(youngs_modulus=0.25e6, poisson_ratio=0.05, characteristic_time=0.2)


def loads_in_blender(scene, body, motion, terrain=None):
    """Loads of a character that plays a motion, mapped and sampled as a user's."""
    from sample_scenes.character import create_character
    from sample_scenes.keys import write_action
    from softground_addon.blender.jobs import run
    from softground_addon.blender.rigs.rig_mapping import map_rig
    from softground_addon.blender.sampling.rig_sampling import sample_character
    from softground_addon.blender.sampling.take import Take
    from softground_addon.core.loads.estimate import estimate_loads

    armature = create_character("Body", body, scene.collection)
    write_action(armature, motion, "Motion", first_frame=0)
    scene.render.fps = round(motion.frame_rate)
    scene.render.fps_base = round(motion.frame_rate) / motion.frame_rate
    take = Take.about(armature, scene, range(len(motion.hips)))
    sampled = run(sample_character(take, armature, map_rig(armature), mass=body.mass))
    return estimate_loads(sampled, terrain or FlatTerrain(0.0), force_model="WHOLE_BODY", material=SNOW)


def vertical_in_body_weights(loads):
    """Vertical force of each sole at each step, (N, S)."""
    return loads.forces.forces[..., 2] / (loads.motion.mass * loads.motion.gravity)


def whole_strides(loads, stride, start=0.3):
    """Steps that make a whole number of strides, away from both ends."""
    rate = 1 / loads.motion.time_step
    end = len(loads.motion.frames) - round(start * rate)
    count = int((end / rate - start) / stride)
    return np.arange(round(start * rate), round((start + count * stride) * rate))
