"""The centre of mass of bodies whose segments one can add up by hand."""

import dataclasses

import numpy as np
import pytest

from softground_addon.core.dynamics.centre_of_mass import centre_of_mass, fitted_to_free_fall, mass_points
from tests.core.character import character, flat_sole

SOLES = [flat_sole(np.zeros((1, 3)))]

STANDING = {
    "hips": (0, 0, 0.92),
    "neck": (0, 0, 1.52),
    "head": (0, 0, 1.62),
    **{
        f"{joint}_{side}": (x, sign * y, z)
        for side, sign in (("l", 1), ("r", -1))
        for joint, (x, y, z) in {
            "shoulder": (0, 0.18, 1.44),
            "elbow": (0, 0.18, 1.16),
            "wrist": (0, 0.18, 0.89),
            "hip": (0, 0.08, 0.92),
            "knee": (0, 0.08, 0.50),
            "ankle": (0, 0.08, 0.08),
            "ball": (0.13, 0.08, 0.02),
        }.items()
    },
}


def body(joints):
    paths = {name: np.array([place], dtype=float) for name, place in joints.items()}
    hips = paths.pop("hips", None)
    return character(SOLES, hips=None if hips is None else hips[0], **paths)


def com(joints):
    return centre_of_mass(body(joints))[0]


def test_the_fractions_are_de_leva_s_and_add_up_to_the_whole_body():
    parts = mass_points(body(STANDING))
    fractions = np.bincount(parts.parts, weights=parts.fractions)
    assert fractions.sum() == pytest.approx(1.0)
    assert fractions[:3].sum() == pytest.approx(0.4346, abs=1e-3)
    assert fractions[3:] == pytest.approx([0.0694, 0.0542, 0.0324, 0.0122, 0.2832, 0.0866, 0.0274], abs=1e-3)


def test_a_standing_man_s_centre_is_at_56_percent_of_his_height():
    trunk = 0.4346 * (0.5138 * 0.92 + 0.4862 * (1.52 + 1.44) / 2)
    head = 0.0694 * (1.52 + 0.20 * 0.60)
    arms = 2 * (0.0271 * (1.44 - 0.5772 * 0.28) + 0.0162 * (1.16 - 0.4574 * 0.27) + 0.0061 * (1.16 - 1.25 * 0.27))
    legs = 2 * (0.1416 * (0.92 - 0.4095 * 0.42) + 0.0433 * (0.50 - 0.4395 * 0.42) + 0.0137 * (0.08 - 0.35 * 0.06))
    fractions = 0.4346 + 0.0694 + 2 * (0.0271 + 0.0162 + 0.0061 + 0.1416 + 0.0433 + 0.0137)
    place = com(STANDING)
    assert place[2] == pytest.approx((trunk + head + arms + legs) / fractions)
    assert place[2] / 1.75 == pytest.approx(0.56, abs=0.01)
    assert place[1] == pytest.approx(0)


@pytest.mark.parametrize("missing", [["head"], ["wrist_l", "wrist_r"], ["ball_l", "ball_r"], ["elbow_l", "wrist_l"]])
def test_an_unmapped_end_moves_the_centre_by_centimetres_at_most(missing):
    joints = {name: place for name, place in STANDING.items() if name not in missing}
    assert np.linalg.norm(com(joints) - com(STANDING)) < 0.03


def test_four_legs_without_a_neck_carry_the_trunk_between_hips_and_shoulders():
    legs = {
        f"{joint}_{side}": (x, y, 0.6)
        for side, y in (("l", 0.1), ("r", -0.1))
        for joint, x in (("hip", 0), ("shoulder", 0.8))
    }
    place = com({"hips": (0, 0, 0.6), **legs})
    assert 0.25 < place[0] < 0.55  # near the middle, not at the hind legs
    assert place[1] == pytest.approx(0)


def test_an_animal_on_four_legs_bears_six_tenths_in_front():
    legs = {
        f"{joint}_{side}": (x, y, z)
        for side, y in (("l", 0.1), ("r", -0.1))
        for joint, x, z in (
            ("hip", 0, 0.6), ("knee", 0, 0.4), ("ankle", 0, 0.05), ("ball", 0, 0.02),
            ("shoulder", 0.7, 0.6), ("elbow", 0.7, 0.4), ("wrist", 0.7, 0.1),
        )
    }  # fmt: skip
    standing = body({"hips": (0, 0, 0.6), "neck": (0.7, 0, 0.65), "head": (0.9, 0, 0.85), **legs})
    animal = centre_of_mass(dataclasses.replace(standing, four_legged=True))[0]
    assert animal[0] / 0.7 == pytest.approx(0.6, abs=0.02)
    assert centre_of_mass(standing)[0][0] / 0.7 < 0.5


def test_with_the_hips_only_the_mass_is_in_the_hips():
    assert com({"hips": (1, 2, 3)}) == pytest.approx([1, 2, 3])


def test_without_joints_the_soles_carry_the_mass():
    assert com({}) == pytest.approx(np.mean([(-0.1, 0, 0), (0.06, 0, 0), (0.12, 0, 0)], axis=0))


def test_the_centre_moves_with_the_body_whatever_is_mapped():
    for names in (["hips"], ["hips", "neck"], ["hip_l", "hip_r", "knee_l"], ["head"], list(STANDING)):
        joints = {name: np.array(STANDING[name], dtype=float) for name in names}
        moved = {name: np.add(place, (1, 2, 3)) for name, place in joints.items()}
        assert com(moved) - com(joints) == pytest.approx([1, 2, 3])


def test_a_body_that_falls_freely_by_the_table_keeps_the_table():
    parts = mass_points(body(STANDING))
    falling = np.tile((0.0, 0.0, -9.81), (50, parts.parts.max() + 1, 1))
    assert fitted_to_free_fall(parts, falling, 9.81)[0].fractions == pytest.approx(parts.fractions)


def test_flight_tells_that_the_legs_are_heavier_than_the_table_says():
    """Legs and trunk pull at each other so that a body with 20 % heavier thighs and shanks falls freely."""
    parts = mass_points(body(STANDING))
    table = np.bincount(parts.parts, weights=parts.fractions)
    heavy = table * np.where(np.isin(np.arange(len(table)), (7, 8)), 1.2, 1.0)
    heavy /= heavy.sum()
    random = np.random.default_rng(1)
    relative = random.normal(size=(400, len(table), 3)) * 5.0
    relative -= np.einsum("p,npc->nc", heavy, relative)[:, None]
    fitted, *_ = fitted_to_free_fall(parts, relative + np.array([0.0, 0.0, -9.81]), 9.81)
    assert np.bincount(fitted.parts, weights=fitted.fractions) == pytest.approx(heavy, abs=2e-3)
    assert fitted.fractions.sum() == pytest.approx(1.0)


def test_flight_tells_that_the_flesh_bounces_less_than_the_joints():
    """Joints that fall 1.2 times as fast as gravity: the part of the body that moves as they do is nearly 1/1.2."""
    parts = mass_points(body(STANDING))
    falling = np.tile((0.0, 0.0, -1.2 * 9.81), (400, parts.parts.max() + 1, 1))
    fitted, moving, _ = fitted_to_free_fall(parts, falling, 9.81, whole=False)
    assert moving == pytest.approx(1 / 1.2, abs=0.005)
    assert fitted.fractions.sum() == pytest.approx(1.0)
    assert fitted_to_free_fall(parts, falling, 9.81)[1] == pytest.approx(1.0)


def test_a_body_whose_legs_nothing_shows_moves_as_a_whole():
    parts = mass_points(body({name: STANDING[name] for name in ("hips", "neck")}))
    falling = np.tile((0.0, 0.0, -1.2 * 9.81), (400, parts.parts.max() + 1, 1))
    assert fitted_to_free_fall(parts, falling, 9.81, whole=False)[1] == pytest.approx(1.0)
