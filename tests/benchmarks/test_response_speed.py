"""What the response costs: at most a second per thousand frames after sampling."""

import time

import numpy as np
import pytest

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.legs.grounding import responding
from softground_addon.core.loads.estimate import estimate_loads
from softground_addon.core.numerics.key_reduction import kept_samples
from softground_addon.core.record.ground_history import GroundHistory
from softground_addon.core.response.response import GroundingOptions, TiltOptions, at_scene_frames, gaps, respond
from tests.benchmarks.bars import below
from tests.core.legs.test_grounding import walk

SNOW = GroundMaterial(youngs_modulus=375e3, poisson_ratio=0.05, characteristic_time=0.2)

pytestmark = pytest.mark.benchmark


def test_a_thousand_frames_respond_within_a_second():
    motion, _ = walk(1000)
    terrain = FlatTerrain(0.0)
    loads = estimate_loads(motion, terrain, force_model="WHOLE_BODY", material=SNOW)
    footprints = [f for result in simulate([loads], SoftGround(terrain, SNOW), 0.01) for f in result.footprints]
    started = time.thread_time()
    touching = at_scene_frames(loads.contacts.touching, loads.motion.frames, motion)
    history = GroundHistory(terrain, footprints)
    response = respond(motion, touching, history, tilt=TiltOptions(), grounding=GroundingOptions())
    gaps(responding(motion, response), touching, history)
    parts = [response.body, *(part for leg in response.legs.values() for part in (leg.thigh, leg.shank, leg.foot))]
    for part in parts:
        kept_samples(part[:, :3, :].reshape(len(part), -1), 2e-4)
    reduced = time.thread_time() - started
    assert np.abs(response.body[:, 2, 3]).max() > 0.01
    below("response of 1,000 frames, with gaps and keys", reduced, 1.0, "s")


def test_the_rig_with_its_layer_plays_at_most_a_tenth_slower(scene, tmp_path):
    import bpy

    from softground_addon.blender.animation_layer.constraint_layer import LayerKind, has_layer, remove_layer
    from tests.blender import responders, rigs

    rigs.make_rigify_file(tmp_path / "rigify.blend")
    armature = rigs.open_rigify(tmp_path / "rigify.blend", "Generated")
    responders.key_steps(armature, "torso", ["foot_ik.L", "foot_ik.R"])
    bpy.data.objects.remove(bpy.data.objects["Metarig"])
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 72
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    responders.bake(scene, output="RESPONSE")
    assert has_layer(armature)
    constraints = [
        constraint
        for bone in armature.pose.bones
        for constraint in bone.constraints
        if constraint.name == LayerKind.RESPONSE.value
    ]

    def frame_time():
        started = time.process_time()
        for frame in range(1, 73):
            scene.frame_set(frame)
        return (time.process_time() - started) / 72

    ratios = []
    for _ in range(5):  # in turns, as the machine changes
        times = {}
        for muted in (False, True):
            for constraint in constraints:
                constraint.mute = muted
            frame_time()
            times[muted] = frame_time()
        ratios.append(times[False] / times[True])
    remove_layer(armature)
    frame_time()
    below("playback of a rig with its layer over the rig alone", np.median(ratios), 1.1)
