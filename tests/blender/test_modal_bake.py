"""A bake that is left at any of its steps has changed nothing."""

import bpy
import pytest

from softground_addon.blender import bake_job
from tests.blender import fingerprints
from tests.blender.shots import walker


@pytest.mark.parametrize("own_ground", [False, True])
def test_a_bake_left_at_any_step_but_the_last_leaves_the_file_as_it_was(scene, own_ground):
    walker(scene, frames=24)
    bpy.ops.softground.add_character()
    if own_ground:
        bpy.ops.softground.create_ground()
    before = fingerprints.of_file()
    stages = set()
    for steps in (1, 2, 10, 24, 25, 30, 40, *range(45, 400)):
        job = bake_job.bake(scene)
        try:
            progress = [next(job) for _ in range(steps)][-1]
        except StopIteration:
            break
        job.close()
        if progress.overall >= 1.0:
            break
        stages.add(progress.stage)
        assert fingerprints.of_file() == before, progress
    assert stages == {"sample", "simulate", "write"}
