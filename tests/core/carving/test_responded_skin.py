"""Skin as it responds, and which of it comes near the ground."""

from __future__ import annotations

import numpy as np
import pytest

from softground_addon.core.carving.responded_skin import RespondedSkin, WornSkin
from softground_addon.core.ground.heightfield import FlatTerrain, SlopingTerrain
from softground_addon.core.legs.grounding import Response
from softground_addon.core.rig.bare_body import bare_body, recorded
from softground_addon.core.rig.mapping import RigMapping
from softground_addon.core.rig.recording import SceneUnits
from tests.core.character import character, flat_sole

CORNERS = np.array([(x, y, z) for x in (-2.0, 2.0) for y in (-0.5, 0.5) for z in (0.7, 1.7)])
FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
UNITS = SceneUnits(frame_rate=24.0, time_stretch=1.0, gravity_m_s2=9.81, unit_scale_m=1.0)


@pytest.mark.parametrize(
    ("terrain", "is_near"),
    [
        (FlatTerrain(0.0), False),
        (FlatTerrain(0.4), True),
        (SlopingTerrain(0.0, np.array([0.5, 0.0])), True),  # uphill it is in the ground, far as its middle is from it
        (FlatTerrain(0.0, (-2.0, -1.0), (1.0, 1.0)), True),  # nothing is known beyond the edge
    ],
)
def test_skin_is_near_the_ground_if_any_part_of_its_bone_is(terrain, is_near):
    positions = np.repeat(CORNERS[None], 3, axis=0)
    body = bare_body(positions, FACES[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3), [("trunk", 8)])
    recording = recorded(body, positions[:, body.followed], range(3), UNITS)
    still = np.tile(np.eye(4), (3, 1, 1))
    motion = character([flat_sole(np.zeros((3, 3)))])
    worn = WornSkin("Giant", body.skin, body.bones, RigMapping(), recording)
    skin = RespondedSkin(worn, motion, Response(np.arange(3.0), still, {}, np.zeros((3, 2))))
    assert (skin.near(terrain, 0.4) == is_near).all()
