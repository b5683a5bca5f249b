"""The whole-body model through BVH and Blender against force plates, beside the joints themselves.

Needs Blender's module and the reference data beside the repository; skips without them.
"""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

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
