"""A body that no armature moves, as a rig: here boxes that walk, of which everything is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from softground_addon.core.motion.motion import CENTRE
from softground_addon.core.rig.bare_body import bare_body, body_motion, recorded
from softground_addon.core.rig.mapping import RigMapping, SoleSource
from softground_addon.core.rig.recording import SceneUnits
from softground_addon.core.rig.skin_mass import DENSITY, skin_mass

CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]) / 2
FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
FACES = FACES[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
BOXES = {  # size and middle
    "trunk": ((0.4, 0.25, 0.8), (0.0, 0.0, 1.4)),
    "leg.L": ((0.12, 0.25, 0.95), (0.12, 0.0, 0.475)),
    "leg.R": ((0.12, 0.25, 0.95), (-0.12, 0.0, 0.475)),
}
UNITS = SceneUnits(frame_rate=24.0, time_stretch=1.0, gravity_m_s2=9.81, unit_scale_m=1.0)
STANDS, STRIDE, FRAMES = 12, 0.5, 97


def walk() -> tuple[np.ndarray, np.ndarray]:
    """World positions (F, 24, 3) of three boxes that walk along y, and where each is (F, 3, 3): while a leg stands for
    12 frames, the other one swings."""
    frame = np.arange(FRAMES)
    ways = np.zeros((FRAMES, 3, 3))
    ways[:, 0, 1] = frame * STRIDE / (2 * STANDS)
    for leg, offset in ((1, 0), (2, STANDS)):
        turn, within = np.divmod(frame + offset, 2 * STANDS)
        swing = np.clip((within - STANDS) / STANDS, 0, 1)
        ways[:, leg, 1] = (turn + swing - offset / (2 * STANDS)) * STRIDE
        ways[:, leg, 2] = 0.15 * np.sin(np.pi * swing) ** 2
    boxes = np.stack([CORNERS * size + middle for size, middle in BOXES.values()])
    return (boxes + ways[:, :, None]).reshape(FRAMES, -1, 3), ways


@pytest.fixture(scope="module")
def walking():
    positions, ways = walk()
    triangles = np.concatenate([FACES + 8 * number for number in range(3)])
    body = bare_body(positions[::4], triangles, [(name, 8) for name in BOXES])
    return body, recorded(body, positions[:, body.followed], range(FRAMES), UNITS), ways


def test_the_parts_are_the_boxes_and_follow_them(walking):
    body, recording, ways = walking
    assert list(body.bones) == list(BOXES)
    assert not body.is_rigid
    for number, (name, (_, middle)) in enumerate(BOXES.items()):
        assert recording.bone(name)[:, :3, 3] == pytest.approx(ways[:, number] + middle, abs=1e-6)


def test_its_mass_and_its_centre_are_those_of_the_volume(walking):
    body, recording, ways = walking
    volumes = np.array([np.prod(size) for size, _ in BOXES.values()])
    assert skin_mass(body.skin, body.bones, recording.of(np.array([0]))) == pytest.approx(
        DENSITY * volumes.sum(), rel=0.05
    )
    soles = tuple(SoleSource(name, "", name, parts=(name,)) for name in ("leg.L", "leg.R"))
    motion = finished(body_motion("Robot", body, RigMapping(soles=soles), recording, mass=80.0))
    middles = np.array([middle for _, middle in BOXES.values()]) + ways
    assert motion.joints[CENTRE] == pytest.approx(np.einsum("p,fpi->fi", volumes / volumes.sum(), middles), abs=1e-4)
    assert motion.stature == pytest.approx(1.8, abs=1e-6)


def test_its_soles_are_the_undersides_of_the_boxes_and_bear_while_they_stand(walking):
    body, recording, ways = walking
    soles = tuple(SoleSource(name, "", name, parts=(name,)) for name in ("leg.L", "leg.R"))
    motion = finished(body_motion("Robot", body, RigMapping(soles=soles), recording, mass=80.0))
    for leg, sole in enumerate(motion.soles, 1):
        assert sole.sole.length == pytest.approx(0.25, abs=0.01)
        assert sole.sole.area == pytest.approx(0.25 * 0.12, rel=0.1)
        assert sole.lowest() == pytest.approx(ways[:, leg, 2], abs=1e-3)
        stands = np.arange(FRAMES) % (2 * STANDS)
        middle_of_stance = (stands if leg == 1 else (stands + STANDS) % (2 * STANDS)) == STANDS // 2
        assert sole.bears[middle_of_stance].all()
        assert not sole.bears[ways[:, leg, 2] > 0.05].any()


def finished(work):
    while True:
        try:
            next(work)
        except StopIteration as end:
            return end.value


def test_a_part_keeps_its_name_when_others_join_its_object():
    positions, _ = walk()
    triangles = np.concatenate([FACES + 8 * number for number in range(3)])
    one_object = bare_body(positions[::4], triangles, [("Robot", 24)])
    assert list(one_object.bones) == ["Robot 0", "Robot 8", "Robot 16"]
    known = bare_body(positions[::4], triangles, [("Robot", 24)], known=["Robot 12"])
    assert list(known.bones) == ["Robot 0", "Robot 12", "Robot 16"]
