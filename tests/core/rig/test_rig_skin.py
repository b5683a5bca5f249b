"""What of a rig's skin is its body, and when its feet stand."""

from __future__ import annotations

import numpy as np
import pytest

from softground_addon.core.numerics.rigid import rotation
from softground_addon.core.rig.bones import RestBone
from softground_addon.core.rig.recording import Recording, SceneUnits
from softground_addon.core.rig.rig_skin import FollowedSkin, RigSkin, of_body
from softground_addon.core.rig.skin_stances import _standing
from softground_addon.core.skin.skin_motion import SkinMotion

UNITS = SceneUnits(frame_rate=24.0, time_stretch=1.0, gravity_m_s2=9.81, unit_scale_m=1.0)
HEADS = {"root": (0.0, 0.0, 0.0), "hips": (0.0, 0.0, 1.0), "leg": (0.0, 0.0, 0.4), "head": (0.0, 0.0, 1.6)}


@pytest.mark.parametrize(
    ("goes", "body"),
    [
        (["hips", "leg", "head"], ["hips", "leg", "head"]),  # away from a floor on the root bone
        (["head"], ["root", "hips", "leg", "head"]),  # a ball that somebody throws who stands still
        ([], ["root", "hips", "leg", "head"]),
    ],
)
def test_a_body_leaves_behind_what_is_less_than_it(goes, body):
    bones = {
        name: RestBone("root" if name != "root" else "", np.eye(4), np.array(head), np.add(head, (0, 1, 0)), 1.0)
        for name, head in HEADS.items()
    }
    vertices = np.concatenate([np.random.default_rng(0).uniform(-0.1, 0.1, (9, 3)) + head for head in HEADS.values()])
    part = np.repeat(np.arange(len(HEADS)), 9)
    weights = tuple((np.flatnonzero(part == number), np.ones(9)) for number in range(len(HEADS)))
    skin = RigSkin(vertices, np.zeros((0, 3), int), tuple(HEADS), weights, part, np.zeros(len(part), bool))
    poses = np.tile(np.eye(4, dtype=np.float32), (8, len(HEADS), 1, 1))
    for name in goes:
        poses[:, list(HEADS).index(name), 3, 0] = np.linspace(0.0, 4.0, 8)
    recording = Recording(np.arange(8.0), tuple(HEADS), poses, np.tile(np.eye(4), (8, 1, 1)), {}, UNITS)
    assert [name for name, is_body in zip(HEADS, of_body(skin, bones, recording)[::9], strict=True) if is_body] == body


def test_a_foot_stands_where_it_lies_flat_however_large_the_head_is_above_it() -> None:
    """Where it leans into the ground, more of its points are about as low as that."""
    foot = np.array([(x, y, z) for x in np.linspace(-0.15, 0.15, 5) for y in (-0.05, 0.05) for z in (0.0, 0.08)])
    leans = [rotation(np.array([0.0, angle, 0.0])) for angle in np.radians((20, 12, 0, 0, -12))]
    positions = np.stack([foot @ lean.T for lean in leans])
    skin = SkinMotion(positions, np.zeros(len(foot), dtype=np.intp), None, 24.0, 3.0)
    bears = np.ones(len(leans), dtype=bool)
    assert _standing(FollowedSkin(skin, ("foot",)), np.array([True]), bears, np.zeros(len(leans))) == 2
