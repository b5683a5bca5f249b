"""Clips for which the oracle of ../shared says that a bake is wrong: frame by frame, what their skin does."""

import json
import re
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job

SHARED = Path(__file__).parents[3] / "shared"
sys.path.append(str(SHARED / "tools"))
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (SHARED / "tools" / "zoo.py").exists(), reason="needs ../shared"),
]
GRAVITY = 9.81


@dataclass(frozen=True)
class Clip:
    """Steps of a bake, and its skin as the oracle looks at it: lengths in body heights."""

    steps: list
    level: float
    height: float
    rate: float
    skin: np.ndarray
    """Every vertex at every frame (F, V, 3) [m]."""
    rise: np.ndarray
    """How fast each rises or falls, the slower of both steps (F, V) [H/s]."""

    @property
    def over(self):
        return (self.skin[..., 2] - self.level) / self.height

    def touching(self):
        """Where the oracle sees skin rest, (F, V)."""
        import mesh_oracle

        return (abs(self.over) < mesh_oracle.NEAR) & (self.rise < mesh_oracle.CALM)

    def middle(self, step):
        """The frame at which the oracle looks at a step."""
        return round((step["frame_start"] + step["frame_end"]) / 2)

    def unseen(self):
        """The one step that the oracle denies."""
        denied = [step for step in self.steps if not self._beside(step, self.middle(step))]
        (step,) = denied
        return step

    def _beside(self, step, frame):
        import mesh_oracle

        skin = self.skin[frame][self.touching()[frame], :2]
        apart = np.linalg.norm(skin - np.array(step["position"])[:2], axis=1)
        return apart.min(initial=np.inf) < mesh_oracle.BESIDE * self.height


@cache
def clip_of(listing, name, tmp):
    import zoo

    folder = SHARED / "data" / listing
    clip = next(clip for clip in json.loads((folder / "rigs.json").read_text()) if clip["clip"] == name)
    zoo.imported(clip, folder, tmp / f"{name}.blend")
    scene = bpy.context.scene
    bpy.ops.softground.add_character()
    scene.softground.sink_feet, scene.softground.relief = False, "OFF"
    report = jobs.run(bake_job.bake(scene)).report
    left_out = clip.get("leave_out", "^$")
    wears = [o for o in scene.objects if o.type == "MESH" and (o.find_armature() or o.parent_type == "BONE")]
    wears = [o.name for o in wears if not re.search(left_out, o.name) and not o.hide_viewport]
    frames = range(scene.frame_start, scene.frame_end + 1)
    clouds = []
    for frame in frames:
        scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        points = []
        for obj in (scene.objects[name].evaluated_get(graph) for name in wears):
            at = np.empty(len(obj.data.vertices) * 3, np.float32)
            obj.data.attributes["position"].data.foreach_get("vector", at)
            points.append(at.reshape(-1, 3) @ np.array(obj.matrix_world)[:3, :3].T + np.array(obj.matrix_world)[:3, 3])
        clouds.append(np.concatenate(points))
    skin = np.array(clouds)
    height = float(np.median(np.ptp(skin[..., 2], axis=1)))
    rate = scene.render.fps / scene.render.fps_base
    ways = np.abs(np.diff(skin[..., 2], axis=0)) * rate / height
    rise = np.minimum(np.concatenate([ways[:1], ways]), np.concatenate([ways, ways[-1:]]))
    level = float(np.median([step["position"][2] for step in report["steps"]]))
    return Clip(report["steps"], level, height, rate, skin, rise)


@pytest.fixture
def clip(addon, request, tmp_path_factory):
    return clip_of(*request.param, tmp_path_factory.getbasetemp())


@pytest.mark.parametrize("clip", [("rigs", "boxman_run")], indirect=True)
def test_no_answer_can_be_right_for_a_run_whose_skin_is_never_calm_on_the_ground(clip):
    """The oracle wants each step to have calm skin; here none is at any frame, whatever steps are there."""
    assert not clip.touching().any()
    lowest = clip.over.min(axis=1)
    for step in clip.steps:  # though the skin goes down to the ground at each step, and only then
        assert abs(lowest[clip.middle(step)]) < 0.012
    down = np.flatnonzero(lowest < 0.015)
    assert all(any(s["frame_start"] - 1 <= frame <= s["frame_end"] + 1 for s in clip.steps) for frame in down)


@pytest.mark.parametrize("clip", [("rigs", "robot_run")], indirect=True)
def test_the_step_of_a_robot_that_the_oracle_misses_is_the_one_that_holds_it_up(clip):
    """Its foot goes through the floor and is never calm; while it is down the robot is thrown up again."""
    step = clip.unseen()
    during = np.arange(int(step["frame_start"]), int(step["frame_end"]) + 1)
    foot = np.sign(clip.skin[..., 0]) == np.sign(step["position"][0])
    lowest = np.where(foot, clip.over, np.inf).min(axis=1)
    assert (lowest[during] < 0.01).all()
    assert (clip.rise[during][abs(clip.over[during]) < 0.015] > 0.15).all()
    fall = np.gradient(clip.skin[..., 2].mean(axis=1)) * clip.rate
    before, after = during[0] - 1, during[-1] + 1
    in_flight = -GRAVITY * (after - before) / clip.rate
    assert fall[before] < 0 < fall[after], "it is thrown up again"
    assert fall[after] - fall[before] > in_flight + GRAVITY * len(during) / clip.rate


@pytest.mark.parametrize("clip", [("rigs", "rogue_run")], indirect=True)
def test_the_rest_of_a_rogue_that_has_no_step_is_a_foot_that_swings_ahead(clip):
    """On the spot, what stands goes back as the belt does; the toe that scuffs the floor overtakes it."""
    touching = clip.touching()
    alone = []
    for frame, near in enumerate(touching):
        here = [s for s in clip.steps if s["frame_start"] - 1 <= frame <= s["frame_end"] + 1]
        apart = [np.linalg.norm(clip.skin[frame, near, :2] - s["position"][:2], axis=1).min(initial=9) for s in here]
        if near.any() and min(apart, default=9) > 0.15 * clip.height:
            alone.append(frame)
    assert len(alone) == 1
    (frame,) = alone
    ahead = np.gradient(clip.skin[..., 1], axis=0) * clip.rate
    planted = [ahead[clip.middle(step)][touching[clip.middle(step)]].mean() for step in clip.steps]
    assert min(planted) > 0 > ahead[frame][touching[frame]].max(), (planted, ahead[frame][touching[frame]])


@pytest.mark.parametrize("clip", [("rigs2", "cyber_kick")], indirect=True)
def test_a_foot_that_stands_only_at_the_first_frame_cannot_be_calm_there(clip):
    """Both feet stand on the floor as the kick begins; the oracle knows the kicking one by the frame after it alone."""
    step = clip.unseen()
    foot = np.sign(clip.skin[..., 0]) == np.sign(step["position"][0])
    kicks, stands = (np.where(side, clip.over, np.inf).min(axis=1) for side in (foot, ~foot))
    assert abs(kicks[0] - stands[0]) < 0.002
    assert abs(kicks[-1] - kicks[0]) < 0.002, "the clip is a loop: it stands there, too"
    low = (abs(clip.over[0]) < 0.015) & foot[0]
    assert (clip.rise[0][low] > 0.15).all()
    assert (np.abs(np.diff(clip.skin[-2:, low, 2], axis=0)) * clip.rate / clip.height < 0.2).all()
