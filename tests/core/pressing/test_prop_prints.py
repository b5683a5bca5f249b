"""Rigid bodies on the ground: bowls, ruts and grooves in closed form, whatever the cells and the frame rate."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from softground_addon.core.composers.prediction import pressed_contacts
from softground_addon.core.ground.material import FIRM_RATIO, GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.imprints.indentation import Springs, stress
from softground_addon.core.numerics.rigid import rotation
from tests.core.character import Slope
from tests.core.prop_bodies import box, prop_sole, rolling, sphere
from tests.core.walkers import loads_of, pose, pressed

GROUND = GroundMaterial(1e6, 0.25, 0.2)
PER_FORCE = GROUND.layer_depth / GROUND.youngs_modulus
"""Volume that a force presses down [m³/N]: Eq. 10 over any contact."""


def resting(sole, position, force, *, turn=(0, 0, 0), seconds=1.0, frame_rate=30.0):
    """A body that lies still under a constant force."""
    place = pose(position)
    place[:3, :3] = rotation(np.asarray(turn, float))
    count = round(seconds * 120) + 1
    return loads_of(
        [sole], [np.tile(place, (count, 1, 1, 1))], np.full((count, 1), force), np.ones((count, 1), bool), frame_rate
    )


def sphere_sinkage(radius, force):
    """Depth d at which the cap pi·d²(3R - d)/3 carries the force."""
    return brentq(lambda d: np.pi * d**2 * (3 * radius - d) / 3 - force * PER_FORCE, 0.0, radius)


@pytest.mark.parametrize("cell", [0.04, 0.02, 0.01, 0.005])
@pytest.mark.parametrize("force", [500.0, 2240.0])
def test_a_sphere_leaves_a_cap_of_itself_whatever_the_cells(force, cell):
    radius = 0.25
    ground, (print_,) = pressed(resting(prop_sole(*sphere(radius)), [0.03, -0.02, radius], force), GROUND, cell)
    depth = sphere_sinkage(radius, force)
    touching = np.pi * (2 * radius * depth - depth**2)
    assert print_.compressed_m3 == pytest.approx(force * PER_FORCE, rel=1e-5)
    assert print_.area_m2 == pytest.approx(touching, rel=0.01)
    assert print_.rim_m3 == pytest.approx(0.5 * print_.compressed_m3, rel=1e-6)
    # The hollow is the cap itself: its depth at distance r from the middle is what the sphere reaches down there.
    r = np.linspace(0, 0.8 * np.sqrt(touching / np.pi), 9)
    cap = depth - radius + np.sqrt(radius**2 - r**2)
    assert ground.sample(0.03 + r, 0 * r - 0.02)[0] == pytest.approx(cap, abs=0.6 * cell**2 / (2 * radius) + 2e-4)


@pytest.mark.parametrize("turn", [(0, 0, 0), (np.pi, 0, 0), (np.pi / 2, 0, 0), (0.3, -2.0, 1.1)])
def test_a_sphere_prints_alike_however_it_is_turned(turn):
    _, (print_,) = pressed(resting(prop_sole(*sphere(0.25)), [0, 0, 0.25], 1000.0, turn=turn), GROUND)
    assert print_.max_depth_m == pytest.approx(sphere_sinkage(0.25, 1000.0), rel=0.01)


@pytest.mark.parametrize("size", [(0.3, 0.2, 0.1)])
@pytest.mark.parametrize(
    ("turn", "sides"), [((0, 0, 0), (0, 1)), ((np.pi / 2, 0, 0), (0, 2)), ((0, np.pi / 2, 0), (1, 2))]
)
def test_a_box_prints_with_the_side_that_it_lies_on(size, turn, sides):
    area = size[sides[0]] * size[sides[1]]
    _ground, (print_,) = pressed(resting(prop_sole(*box(*size)), [0.01, 0.02, 0.5], 800.0, turn=turn), GROUND)
    assert print_.area_m2 == pytest.approx(area, rel=0.02)
    assert print_.max_depth_m == pytest.approx(800.0 / area * PER_FORCE, rel=0.02)


@pytest.mark.parametrize("share", [0.02, 0.5, 0.9])
def test_a_box_on_the_edge_of_the_ground_digs_in_no_deeper_than_beside_it(share):
    size = 0.4
    loads = resting(prop_sole(*box(size, size, size)), [0, 0, size / 2], 800.0)
    terrain = Slope(edge=(share - 0.5) * size)
    (whole,), (print_,) = (pressed(loads, GROUND, 0.01, ground)[1] for ground in (None, terrain))
    assert print_.max_depth_m == pytest.approx(whole.max_depth_m, rel=0.01)
    assert print_.area_m2 == pytest.approx(share * whole.area_m2, abs=1.1 * 0.01 * size)
    assert print_.compressed_m3 == pytest.approx(share * whole.compressed_m3, rel=0.01, abs=0.03 * whole.compressed_m3)
    assert pressed_contacts([loads], SoftGround(terrain, GROUND), 0.005).typical == pytest.approx(
        print_.max_depth_m, rel=0.03
    )


def test_a_tilted_box_presses_a_wedge_that_carries_the_same_load():
    angle, width, force = np.radians(20), 0.2, 300.0
    _, (print_,) = pressed(resting(prop_sole(*box(0.4, width, 0.2)), [0, 0, 0.5], force, turn=(0, angle, 0)), GROUND)
    # Both faces at the lowest edge: slopes tan(a) and cot(a), so that V = width·s²/2·(cot a + tan a).
    sinkage = np.sqrt(2 * force * PER_FORCE / (width * (1 / np.tan(angle) + np.tan(angle))))
    assert print_.compressed_m3 == pytest.approx(force * PER_FORCE, rel=1e-5)
    assert print_.area_m2 == pytest.approx(width * sinkage * (1 / np.tan(angle) + np.tan(angle)), rel=0.05)


def test_a_firm_layer_and_what_is_painted_share_the_load():
    rng = np.random.default_rng(1)
    clearance, area = rng.uniform(0, 0.05, 500), rng.uniform(1e-5, 1e-4, 500)
    stiffness, depth = rng.uniform(0.2, 3, 500), rng.uniform(0.5, 1.5, 500)
    material = replace(GROUND, firm_depth=0.02)
    springs = Springs(clearance - clearance.min(), area, stiffness, depth)
    sinkage = springs.sinkage(4000.0, material)
    carried = stress(springs.compression(sinkage, material), material, stiffness=stiffness, depth=depth) @ area
    assert carried == pytest.approx(4000.0, rel=1e-9)
    assert stress(np.array([0.03]), material) == pytest.approx(1e6 / 0.3 * (0.02 + FIRM_RATIO * 0.01))


def test_no_load_sinks_a_body_below_the_layer():
    material = replace(GROUND, layer_depth=0.05)
    _, (print_,) = pressed(resting(prop_sole(*box(0.2, 0.2, 0.2)), [0, 0, 0.1], 1e7), material)
    assert print_.max_depth_m == pytest.approx(0.05, abs=1e-9)


def rut_depth(ground, middle=0.75):
    """Mean depth of a rut in the middle of its length, and the largest difference along it [m]."""
    x = np.arange(middle - 0.2, middle + 0.2, 0.01)
    depth = ground.sample(x, 0 * x)[0]
    return depth.mean(), np.ptp(depth)


def rut_in_closed_form(radius, width, force, speed, material):
    """Depth that Eq. 11 reaches at a place over which the bottom of a wheel passes."""
    per_force = material.layer_depth / material.youngs_modulus

    def clearance(x):
        return radius - np.sqrt(radius**2 - x**2)

    def volume(sinkage):
        half = np.sqrt(2 * radius * sinkage - sinkage**2)
        return width * 2 * quad(lambda x: sinkage - clearance(x), 0, half)[0]

    sinkage = brentq(lambda d: volume(d) - force * per_force, 1e-6, 0.9 * radius)
    half = np.sqrt(2 * radius * sinkage - sinkage**2)

    def rate(time, depth):
        aim = sinkage - clearance(speed * time - half)
        return aim / material.characteristic_time if depth[0] < aim else 0.0

    return solve_ivp(rate, (0, 2 * half / speed), [0.0], max_step=half / speed / 500).y[0, -1]


@pytest.mark.parametrize("frame_rate", [24, 60])
@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_a_wheel_leaves_one_rut_of_even_depth_at_any_frame_rate(frame_rate, speed):
    seconds = 1.5 / speed
    ground, prints = pressed(rolling(frame_rate, speed, seconds), GROUND)
    depth, unevenness = rut_depth(ground)
    assert depth == pytest.approx(rut_in_closed_form(0.35, 0.06, 400.0, speed, GROUND), rel=0.03)
    assert unevenness < 0.05 * depth
    assert sum(print_.rim_m3 for print_ in prints) == pytest.approx(
        0.5 * sum(p.compressed_m3 for p in prints), rel=1e-6
    )


RATES_AND_CELLS = ((24, 0.01), (120, 0.01), (24, 0.005))


def test_a_rut_is_as_deep_at_24_as_at_120_frames_per_second_and_in_cells_of_any_size():
    depths = [
        rut_depth(pressed(rolling(rate), GROUND, cell)[0])[0] for rate, cell in ((24, 0.01), (120, 0.01), (24, 0.005))
    ]
    assert depths[1] == pytest.approx(depths[0], rel=0.01)
    assert depths[2] == pytest.approx(depths[0], rel=0.02)


def test_what_slides_leaves_the_groove_of_its_own_bottom():
    ground, _ = pressed(rolling(24, speed=1.0, slide=True), GROUND)
    depth, unevenness = rut_depth(ground)
    assert depth == pytest.approx(rut_in_closed_form(0.35, 0.06, 400.0, 1.0, GROUND), rel=0.03)
    assert unevenness < 0.05 * depth


def dropped_again_and_again(times, material):
    """A ball set down on one spot, lifted and set down again: compressed volume after each time."""
    cycle, held = 36, 24  # steps
    sole = prop_sole(*sphere(0.15, rings=32))
    count = times * cycle
    touching = (np.arange(count) % cycle < held) & (np.arange(count) > 0)
    poses = np.tile(pose([0.0, 0.0, 0.15]), (count, 1, 1, 1))
    _, prints = pressed(loads_of([sole], [poses], 600.0 * touching[:, None], touching[:, None], 30.0), material)
    return np.array([print_.compressed_m3 for print_ in prints])


@pytest.mark.parametrize("hardening", [0.0, 10.0])
def test_twenty_times_on_one_spot_stays_stable(hardening):
    added = dropped_again_and_again(20, replace(GROUND, characteristic_time=0.3, hardening=hardening))
    assert len(added) == 20
    assert (added >= 0).all()
    assert added[1:].sum() <= added[0] * 0.6
    if hardening:
        assert added[1] < 0.3 * added[0]


@pytest.mark.parametrize("hardening", [0.0, 10.0])
def test_a_long_track_is_cut_into_prints_that_join_without_a_seam(hardening, monkeypatch):
    material = replace(GROUND, hardening=hardening)
    loads = rolling(24, speed=2.0)
    ground, prints = pressed(loads, material)
    monkeypatch.setattr("softground_addon.core.loads.tracks.LONGEST_TRACK", 1.0)
    cut, pieces = pressed(loads, material)
    assert len(prints) == 1
    assert len(pieces) > 3
    assert cut.volumes() == pytest.approx(ground.volumes(), rel=1e-5)
    x = np.arange(0.1, 2.9, 0.01)
    assert cut.sample(x, 0 * x) == pytest.approx(ground.sample(x, 0 * x), abs=1e-5)
