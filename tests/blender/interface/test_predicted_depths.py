"""The depth that the panel predicts for every shared motion, with the settings of two clicks, and what is pressed."""

import json
from pathlib import Path

import bpy
import pytest

from softground_addon.blender import settings
from softground_addon.blender.reading import analysis
from softground_addon.blender.reading.shots import ground_of
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.record.typical_depth import typical_of
from tests.blender import shots
from tests.validation.contact_sheets import open_clip

pytestmark = pytest.mark.slow

RIGS = shots.SHARED / "rigs"


def clips():
    """Captured motion and rigs of other people, by name."""
    listed = json.loads((RIGS / "rigs.json").read_text(encoding="utf-8")) if RIGS.is_dir() else []
    return {clip["clip"]: clip for clip in listed}


def files():
    """Measured trials as skeletons, and the other motion files, by name."""
    trials = [shots.MotionFile(f"gait/{path.name}", 0.01, "-Z", "Y") for path in shots.SHARED.glob("gait/*.bvh")]
    return {Path(motion.path).stem: motion for motion in [*trials, *shots.MOTION_FILES.values()]}


MOTIONS = files() | clips()


@pytest.mark.parametrize("name", sorted(MOTIONS))
def test_the_typical_step_is_as_deep_as_predicted(scene, name):
    if isinstance(MOTIONS[name], shots.MotionFile):
        shots.import_file(MOTIONS[name])
    else:
        scene = open_clip(MOTIONS[name], RIGS)
        bpy.context.view_layer.objects.active = next(obj for obj in scene.objects if obj.type == "ARMATURE")
    bpy.ops.softground.add_character()
    shot, wanted = analysis.read(scene), settings.snapshot(scene)
    results = simulate(shot.loads, ground_of(wanted, shot.shot), wanted.cell_size_m)
    pressed = typical_of([footprint for result in results for footprint in result.footprints])
    assert analysis.expected_depth(scene) == pytest.approx(pressed, rel=0.02)
