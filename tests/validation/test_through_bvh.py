"""The whole-body model through BVH and Blender against force plates, beside the joints themselves.

Needs Blender's module and the reference data beside the repository; skips without them.
"""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from library.softground import Body, estimate_loads, read_bvh
from tests.validation.test_forces_of_gait import DATA, read, scored
from tests.validation.through_blender import motion_of_bvh

pytestmark = pytest.mark.skipif(not DATA.exists(), reason=f"needs the reference data in {DATA}")

WORSE = 1.3
"""How many times the joints' error a skeleton of rigid bones may have, ..."""
STIFF_SPINES = {"run_rajagopal": 1.5}
"""... but where neck and shoulders, which hang on one stiff bone, move against each other in a run."""


@pytest.mark.parametrize("name", [file.stem for file in sorted(DATA.glob("*.csv"))])
@pytest.mark.slow
def test_a_skeleton_of_rigid_bones_is_about_as_near_as_the_joints(name):
    trial = read(name)
    motion = motion_of_bvh(trial.bvh, mass=trial.mass, rate=trial.rate)
    assert scored(trial, motion).rms_bw_foot <= STIFF_SPINES.get(name, WORSE) * scored(trial).rms_bw_foot


@pytest.mark.parametrize("name", ["walk_subject01", "run_rajagopal"])
def test_the_library_reads_a_bvh_as_blender_and_the_add_on_do(name):
    """Two readers of the file that share no line; Blender keeps single precision."""
    trial = read(name)
    here, back = (
        read_bvh(trial.bvh, mass=trial.mass).motion,
        motion_of_bvh(trial.bvh, mass=trial.mass, rate=trial.rate),
    )
    assert here.joints.keys() == back.joints.keys()
    for joint, path in back.joints.items():
        np.testing.assert_allclose(here.joints[joint], path, atol=1e-5, err_msg=joint)
    for mine, theirs in zip(here.soles, back.soles, strict=True):
        np.testing.assert_allclose(mine.landmark_positions(), theirs.landmark_positions(), atol=1e-5)
    direct, two = (estimate_loads(Body(motion, motion)) for motion in (here, back))
    for mine, theirs in zip(direct.soles, two.soles, strict=True):
        np.testing.assert_allclose(mine.contacts, theirs.contacts, atol=2 / 120)  # thresholds round to the next step
        assert np.sqrt(((mine.force - theirs.force) ** 2).mean()) < 0.01 * trial.mass * 9.81
