"""Footprints of whole motions: closed forms, and independence of everything that must not matter."""

from dataclasses import replace
from itertools import pairwise
from math import inf

import numpy as np
import pytest

from softground_addon.core.composers.simulation import simulate
from softground_addon.core.errors import InputError
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.imprints.sole_points import TOLERANCE
from softground_addon.core.motion.motion import LowSkin
from softground_addon.core.record.footprints import recompose
from tests.core.character import Slope
from tests.core.walkers import (
    GRAVITY,
    MASS,
    box_sole,
    equilibrium_depth,
    foot_sole,
    loads_of,
    memory_of,
    pose,
    pressed,
    sphere_sole,
    standing,
    through_scene_frames,
    walk,
)

SNOW = GroundMaterial(0.25e6, 0.05, 0.2)
SAND = GroundMaterial(2.25e6, 0.5, 0.05)
MUD = GroundMaterial(0.625e6, 0.35, 0.15)
WEIGHT = MASS * GRAVITY


def depths(footprints):
    return np.array([footprint.max_depth_m for footprint in footprints])


@pytest.mark.parametrize("feet", [1, 2])
@pytest.mark.parametrize("cell", [0.04, 0.02, 0.01, 0.005])
def test_a_standing_character_sinks_by_its_weight_per_area_over_the_stiffness(feet, cell):
    sole = box_sole(0.25, 0.0694)  # two of these are 347 cm²
    places = [[0.013, 0.1, 0.0], [0.021, -0.12, 0.0]][:feet]
    _, footprints = pressed(standing(sole, places, WEIGHT / feet, heading=0.3), SNOW, cell)
    expected = equilibrium_depth(WEIGHT, feet * 0.25 * 0.0694, SNOW)
    assert expected == pytest.approx({1: 0.05258, 2: 0.02629}[feet], rel=1e-3)
    assert depths(footprints) == pytest.approx(expected, rel=0.01)
    # Deep everywhere under the sole, not in one cell.
    volume = np.array([footprint.compressed_m3 for footprint in footprints])
    assert volume == pytest.approx(expected * 0.25 * 0.0694, rel=0.01)


def test_an_anatomical_foot_of_two_pieces_sinks_by_its_weight_per_area_too():
    sole = foot_sole("foot", "L")
    _, (footprint,) = pressed(standing(sole, [[0.0, 0.0, 0.0]], WEIGHT, seconds=2, heading=1.0), SNOW)
    assert footprint.max_depth_m == pytest.approx(equilibrium_depth(WEIGHT, sole.area, SNOW), rel=0.01)
    assert footprint.area_m2 == pytest.approx(sole.area, rel=0.01)


def dropped_sphere(mass, material, *, radius=0.25, height=2.5, frame_rate=60.0):
    """A sphere that lands on the first frame: its weight, and for tau what stops it (Eq. 8)."""
    sole = sphere_sole(radius)
    loads = standing(sole, [[0.03, -0.02, 0.0]], mass * GRAVITY, frame_rate=frame_rate, seconds=1.0)
    landing = loads.motion.times <= material.characteristic_time
    loads.forces.forces[landing, :, 2] += mass * np.sqrt(2 * GRAVITY * height) / material.characteristic_time
    _, (footprint,) = pressed(loads, material)
    return footprint.max_depth_m, footprint.rim_m3


def test_a_dropped_sphere_prints_deeper_the_heavier_it_is():
    depth = [dropped_sphere(mass, GroundMaterial(1e6, 0.25, 0.2))[0] for mass in (10, 25, 50, 100)]
    assert (np.diff(depth) > 0.001).all()


def test_a_dropped_sphere_prints_deeper_the_softer_the_ground():
    depth = [dropped_sphere(50, GroundMaterial(modulus, 0.25, 0.2))[0] for modulus in (2e6, 1e6, 0.5e6, 0.25e6)]
    assert (np.diff(depth) > 0.001).all()


def test_poissons_ratio_raises_the_rim_of_a_dropped_sphere_and_leaves_its_depth():
    depth, rim = np.transpose([dropped_sphere(50, GroundMaterial(1e6, nu, 0.2)) for nu in (0.0, 0.1, 0.25, 0.5)])
    assert depth == pytest.approx(depth[0], rel=1e-9)
    assert rim == pytest.approx(rim[-1] * np.array([0, 0.2, 0.5, 1]))
    assert rim[-1] > 0


@pytest.mark.parametrize("loads", [walk(), walk(heading=0.7)], ids=["along x", "at 40 degrees"])
def test_depth_and_volume_do_not_depend_on_the_cell_size(loads):
    runs = [pressed(loads, SNOW, cell) for cell in (0.005, 0.01, 0.02, 0.04)]
    reference = runs[0]
    for ground, footprints in runs[1:]:
        assert depths(footprints) == pytest.approx(depths(reference[1]), rel=0.02)
        assert ground.volumes() == pytest.approx(reference[0].volumes(), rel=0.02)


@pytest.mark.parametrize("material", [SNOW, MUD])
def test_depth_and_volume_do_not_depend_on_the_frame_rate(material):
    runs = [pressed(walk(frame_rate=rate), material) for rate in (120.0, 60.0, 30.0, 24.0)]
    reference = runs[0]
    for ground, footprints in runs[1:]:
        assert depths(footprints) == pytest.approx(depths(reference[1]), rel=0.01)
        assert ground.volumes() == pytest.approx(reference[0].volumes(), rel=0.01)


def test_a_rig_sampled_at_scene_frames_prints_alike_at_all_frame_rates():
    runs = [pressed(through_scene_frames(walk(frame_rate=rate)), SNOW) for rate in (120.0, 60.0, 30.0, 24.0)]
    for _, footprints in runs[1:]:
        assert depths(footprints) == pytest.approx(depths(runs[0][1]), rel=0.01)


@pytest.mark.parametrize("cell", [0.01, 0.02])
def test_depth_and_volume_do_not_depend_on_place_or_heading(cell):
    reference = pressed(walk(), SNOW, cell)
    for heading, origin in ((0.35, (0.003, 0.0041, 0)), (np.pi / 4, (-512.3, 77.7, 3.0)), (3.0, (1e4, 1e4, -50.0))):
        terrain = FlatTerrain(origin[2])
        ground, footprints = pressed(walk(heading=heading, origin=origin), SNOW, cell, terrain)
        assert depths(footprints) == pytest.approx(depths(reference[1]), rel=0.01)
        assert ground.volumes() == pytest.approx(reference[0].volumes(), rel=0.01)


def test_a_shift_by_whole_cells_changes_nothing_but_the_place():
    here, (first,) = pressed(walk(steps=1, origin=(0.0013, 0.0007, 0.0)), SNOW)
    far, (other,) = pressed(walk(steps=1, origin=(-127.9987, 64.0007, 0.0)), SNOW)
    window = Window(other.window.column + 12800, other.window.row - 6400, *other.window[2:])
    assert window == first.window
    assert far.read(other.window) == pytest.approx(here.read(first.window), abs=1e-9)


def test_a_constant_float_of_the_animation_does_not_change_the_print():
    reference, _ = pressed(walk(steps=2), SNOW)
    floating, footprints = pressed(walk(steps=2, origin=(0, 0, 0.03)), SNOW)
    assert floating.volumes() == pytest.approx(reference.volumes(), rel=1e-6)
    assert [footprint.position[2] for footprint in footprints] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_the_prints_lie_under_the_feet_in_the_order_of_the_steps():
    _, footprints = pressed(walk(steps=6), SNOW)
    assert [footprint.sole for footprint in footprints] == ["foot.L", "foot.R"] * 3
    starts = [footprint.start_frame for footprint in footprints]
    assert starts == sorted(starts)
    heel = np.arange(6) * 1.3 * 1.1 / 2
    x, y, _ = np.transpose([footprint.position for footprint in footprints])
    assert ((x > heel + 0.05) & (x < heel + 0.22)).all()
    assert y == pytest.approx([0.09, -0.09] * 3, abs=0.01)
    assert [footprint.heading for footprint in footprints] == pytest.approx([0.0] * 6, abs=0.01)


def test_the_footprint_reports_its_load():
    loads = walk(steps=1)
    _, (footprint,) = pressed(loads, SNOW)
    force = loads.forces.forces[:, 0, 2]
    assert footprint.peak_force_n == force.max()
    assert footprint.load_n[np.argmax(footprint.load_n)] == force.max()
    assert footprint.load_frames[np.argmax(footprint.load_n)] == loads.motion.frames[force.argmax()]
    touching = loads.motion.frames[loads.contacts.touching[:, 0]]
    assert (footprint.start_frame, footprint.end_frame) == (touching[0], touching[-1])


def test_rolling_over_the_foot_presses_the_heel_before_the_toes():
    loads = walk(steps=1, frame_rate=120.0)
    first = {}
    for result in simulate([loads], SoftGround(FlatTerrain(), SAND), 0.01):
        depths = result.ground.sample(np.array([0.02, 0.12, 0.23]), np.full(3, 0.09))[0]
        for name, depth in zip(("heel", "middle", "toes"), depths, strict=True):
            if depth > 0:
                first.setdefault(name, result.frame)
    assert first["heel"] < first["middle"] < first["toes"]


def test_a_second_step_in_the_same_place_adds_only_what_exceeds_the_first():
    sole = box_sole(0.25, 0.09)
    count = 4 * 60 + 1
    touching = np.zeros((count, 1), bool)
    touching[10:80] = touching[130:200] = True
    transforms = np.tile(pose((0, 0, 0)), (count, 1, 1, 1))

    def step_twice(first, second):
        force = np.zeros((count, 1))
        force[10:80], force[130:200] = first, second
        return pressed(loads_of([sole], [transforms], force, touching, 30.0), SNOW)

    ground, (_, same) = step_twice(500.0, 500.0)
    assert same.compressed_m3 == 0
    ground, (_, lighter) = step_twice(500.0, 300.0)
    assert lighter.compressed_m3 == 0
    ground, (first, heavier) = step_twice(500.0, 700.0)
    assert heavier.max_depth_m == pytest.approx(first.max_depth_m * 2 / 5, rel=1e-6)
    assert ground.read(heavier.window)[0].max() == pytest.approx(
        equilibrium_depth(700.0, sole.patches[0].area, SNOW), rel=1e-6
    )


def test_characters_that_do_not_meet_print_as_if_alone_in_any_order():
    first, other = walk(steps=2), walk(steps=2, origin=(0.2, 3.0, 0.0), heading=0.5, name="other")
    alone = [pressed(loads, SNOW)[1] for loads in (first, other)]
    for order in ([first, other], [other, first]):
        _, footprints = pressed(order, SNOW)
        for name, expected in zip(("walker", "other"), alone, strict=True):
            of_character = [footprint for footprint in footprints if footprint.character == name]
            assert [f.compressed_m3 for f in of_character] == [f.compressed_m3 for f in expected]
            assert [f.rim_m3 for f in of_character] == [f.rim_m3 for f in expected]


@pytest.mark.parametrize("frame_rate", [24.0, 120.0])
def test_soles_that_press_the_same_ground_at_once_take_turns_step_by_step(frame_rate):
    # The heavy one alone decides the depth where both press, whatever the order and the frame rate.
    heavy, light = (
        standing(box_sole(0.25, 0.09), [[x, 0, 0]], force, frame_rate=frame_rate, name=str(force))
        for x, force in ((0.0, 800.0), (0.05, 300.0))
    )
    grounds = [pressed(order, SNOW)[0].read(Window(-30, -20, 60, 40))[0] for order in ([heavy, light], [light, heavy])]
    assert grounds[0] == pytest.approx(grounds[1], abs=1e-4)
    assert grounds[0].max() == pytest.approx(equilibrium_depth(800.0, 0.0225, SNOW), rel=0.01)


def test_a_character_that_appears_later_prints_at_its_own_frames():
    early, late = walk(steps=1), walk(steps=1, origin=(0, 3, 0), name="late")
    late = replace(late, motion=replace(late.motion, frames=late.motion.frames + 10))
    results = list(simulate([early, late], SoftGround(FlatTerrain(), SNOW), 0.01))
    assert [result.frame for result in results] == list(np.arange(early.motion.frames[0], late.motion.frames[-1] + 1))
    starts = {footprint.character: footprint.start_frame for r in results for footprint in reversed(r.footprints)}
    assert starts["late"] == starts["walker"] + 10
    assert not results[3].touching[1].any()
    assert not results[3].forces[1].any()


def test_each_frame_reports_where_the_ground_changed():
    previous = {}
    for result in simulate([walk(steps=2)], SoftGround(FlatTerrain(), MUD), 0.01):
        for window in result.ground.tile_windows():
            state = result.ground.read(window)
            rows, columns = np.nonzero((state != previous.get(window, 0.0)).any(axis=0))
            for row, column in zip(rows + window.row, columns + window.column, strict=True):
                assert any(w.intersects(Window(column, row, 1, 1)) for w in result.changed)
            previous[window] = state


def test_no_load_changes_no_bit_and_leaves_no_footprint():
    ground, footprints = pressed(standing(box_sole(0.25, 0.09), [[0, 0, 0]], 0.0), SNOW)
    assert not ground.tiles
    assert not footprints


def test_a_sole_in_the_air_leaves_nothing_whatever_its_force():
    loads = standing(box_sole(0.25, 0.09), [[0, 0, 0]], 700.0)
    loads.contacts.touching[:] = False
    ground, footprints = pressed(loads, SNOW)
    assert not ground.tiles
    assert not footprints


class HalfPlane:
    """Level ground that ends at x = 0 in nothing or in a wall."""

    def __init__(self, beyond):
        self.beyond = beyond

    def heights(self, x, y):
        return np.where(x < 0, 0.0, self.beyond * (1 + 0 * x)) + 0 * y


@pytest.mark.parametrize("share", [0.02, 0.5, 0.9])
@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_the_load_that_falls_beyond_the_edge_of_the_ground_leaves_with_it(share, slope):
    angle, length = np.arctan(slope), 0.24
    loads = standing(box_sole(length, 0.08), [[0, 0, 0]], 400.0, normal=(-np.sin(angle), 0.0, np.cos(angle)))
    loads.motion.soles[0].transforms[:] = pose((0, 0, 0), 0.0, angle)
    _, (whole,) = pressed(loads, MUD, 0.005, Slope(slope=slope))
    end = (share - 0.5) * length * np.cos(angle)
    ground, (footprint,) = pressed(loads, MUD, 0.005, Slope(slope=slope, edge=end))
    assert not ground.read(Window(int(end // 0.005) + 1, -60, 120, 120)).any()
    assert footprint.max_depth_m == pytest.approx(whole.max_depth_m, rel=0.01)
    assert footprint.max_depth_m == pytest.approx(
        equilibrium_depth(400.0 * np.cos(angle), length * 0.08, MUD), rel=0.02
    )
    assert footprint.area_m2 == pytest.approx(share * whole.area_m2, abs=1.1 * 0.005 * 0.08)
    assert footprint.compressed_m3 == pytest.approx(share * whole.compressed_m3, abs=0.01 * whole.compressed_m3 + 3e-6)
    assert footprint.rim_m3 == pytest.approx(2 * 0.35 * footprint.compressed_m3, rel=1e-9)
    assert footprint.peak_force_n == whole.peak_force_n


def test_a_rolling_pressure_at_the_edge_of_the_ground_is_that_of_the_whole_sole():
    loads = standing(box_sole(0.24, 0.08), [[0, 0, 0]], 400.0)
    loads.forces.centre_of_pressure[..., 0] = -0.02
    read = []
    for edge in (np.inf, 0.0):
        results = list(simulate([loads], SoftGround(Slope(edge=edge), MUD, "CENTRE_OF_PRESSURE", None), 0.01))
        read.append(results[-1].ground.read(Window(-11, -3, 10, 6))[0])
    assert np.ptp(read[0]) > 0.1 * read[0].max()
    assert read[1] == pytest.approx(read[0], rel=0.02)


def test_toes_that_stand_beyond_the_edge_lift_the_heel_off_the_ground():
    loads = standing(box_sole(0.24, 0.08), [[0, 0, 0]], 400.0)
    loads.motion.soles[0].transforms[:] = pose((0, 0, 0.06), 0.0, -0.5)
    _, footprints = pressed(loads, MUD, 0.01, Slope(edge=0.0))
    assert not footprints


def test_a_rim_that_finds_no_ground_to_rise_on_is_reported_instead_of_lost():
    class Island:
        def heights(self, x, y):
            return np.where((abs(x) < 0.05) & (abs(y) < 0.05), 0.0, np.nan)

    _, (footprint,) = pressed(standing(box_sole(0.4, 0.4), [[0, 0, 0]], 100.0), MUD, 0.01, Island())
    assert footprint.compressed_m3 > 0
    assert footprint.rim_m3 == 0
    assert footprint.unplaced_rim_m3 == pytest.approx(0.7 * footprint.compressed_m3, rel=1e-9)


def test_on_a_slope_only_the_force_along_the_normal_presses_on_the_surface():
    slope = 0.4
    angle = np.arctan(slope)

    class Hill:
        def heights(self, x, y):
            return slope * x + 0 * y

    sole = box_sole(0.25, 0.09)
    normal = np.array([-np.sin(angle), 0.0, np.cos(angle)])
    loads = standing(sole, [[0, 0, 0]], 600.0, normal=normal)
    loads.motion.soles[0].transforms[:] = pose((0, 0, 0), 0.0, angle)
    _, (footprint,) = pressed(loads, SNOW, 0.01, Hill())
    assert footprint.max_depth_m == pytest.approx(equilibrium_depth(600.0 * np.cos(angle), 0.0225, SNOW), rel=0.01)
    assert footprint.area_m2 == pytest.approx(0.0225, rel=0.01)


def test_a_sliding_sole_leaves_a_continuous_track_however_long():
    sole = box_sole(0.25, 0.09)
    count = 4 * 90 + 1
    x = np.linspace(0, 9.0, count)
    transforms = pose(np.stack([x, 0.5 * x, 0 * x], -1), np.arctan(0.5))[:, None]
    loads = loads_of([sole], [transforms], np.full((count, 1), 500.0), np.ones((count, 1), bool), 30.0)
    ground, (footprint,) = pressed(loads, SNOW)
    along = np.linspace(1.0, 8.0, 200)
    track = ground.sample(along, 0.5 * along)[0]
    assert track.min() > 0.8 * track.max() > 0
    assert footprint.rim_m3 == pytest.approx(0.1 * footprint.compressed_m3, rel=1e-9)
    assert memory_of(ground) < 1.5e6


@pytest.mark.parametrize(("slide", "seconds", "prints"), [(0.2, 1.0, 1), (1.1, 1.0, 3), (1.1, 0.2, 2), (1.1, 0.1, 1)])
def test_a_foot_of_a_body_of_known_height_that_slides_prints_place_after_place(slide, seconds, prints):
    count = round(seconds * 120) + 1
    x = np.linspace(0, slide, count)
    transforms = pose(np.stack([x, 0 * x, 0 * x], -1))[:, None]
    loads = loads_of([box_sole(0.25, 0.09)], [transforms], np.full((count, 1), 500.0), np.ones((count, 1), bool), 30.0)
    skin = LowSkin(loads.motion.frames, np.zeros((count, 1, 3)), np.zeros((count, 1)), 0.3, 1.78)
    known = replace(loads, motion=replace(loads.motion, skin=skin))
    whole, (first,) = pressed(loads, SNOW)
    ground, pressed_prints = pressed(known, SNOW)
    assert len(pressed_prints) == prints
    places = np.array([0.0] + [footprint.position[0] for footprint in pressed_prints] + [slide])
    assert np.diff(places).max() < slide / prints + 0.05  # evenly along the way
    step = 1 / 4
    for footprint, after in pairwise(pressed_prints):
        assert after.start_frame - footprint.end_frame == pytest.approx(step)
    along = np.linspace(0.0, slide, 50)
    np.testing.assert_allclose(ground.sample(along, 0 * along)[0], whole.sample(along, 0 * along)[0], rtol=0.25)
    assert sum(footprint.compressed_m3 for footprint in pressed_prints) == pytest.approx(first.compressed_m3, rel=0.1)


def test_tiny_and_giant_characters_print_alike_in_proportion():
    # Lengths times k, forces times k² (the same stress) on layers k times as deep: depths times k.
    for k in (0.05, 20.0):
        material = replace(SNOW, layer_depth=0.3 * k, rim_reach=0.04 * k)
        _, (footprint,) = pressed(standing(box_sole(0.25, 0.09), [[0, 0, 0]], 500.0), SNOW)
        sole = box_sole(0.25 * k, 0.09 * k, spacing=0.005 * k)
        _, (other,) = pressed(standing(sole, [[0, 0, 0]], 500.0 * k**2), material, 0.01 * k)
        assert other.max_depth_m == pytest.approx(k * footprint.max_depth_m, rel=1e-6)
        assert other.compressed_m3 == pytest.approx(k**3 * footprint.compressed_m3, rel=1e-6)


def test_a_mouse_on_coarse_cells_presses_its_volume():
    sole = box_sole(0.02, 0.008, spacing=0.0005)
    volumes = [
        pressed(standing(sole, [[0.004, 0.003, 0]], 0.3, heading=0.4), SNOW, cell)[0].volumes()[0]
        for cell in (0.001, 0.03)
    ]
    assert volumes[0] == pytest.approx(volumes[1], rel=0.02)
    assert volumes[0] > 0


def test_characters_on_different_time_grids_are_refused_with_a_remedy():
    with pytest.raises(InputError, match=r"'other'.*sample all characters"):
        next(simulate([walk(), walk(frame_rate=25.0, name="other")], SoftGround(FlatTerrain(), SNOW), 0.01))


def test_nobody_and_no_cell_size_are_refused_with_a_remedy():
    with pytest.raises(InputError, match="no loads to press"):
        next(simulate([], SoftGround(FlatTerrain(), SNOW), 0.01))
    with pytest.raises(InputError, match="cell size"):
        next(simulate([walk()], SoftGround(FlatTerrain(), SNOW), -inf))


def test_a_motion_of_one_frame_gives_one_undisturbed_result():
    loads = standing(box_sole(0.25, 0.09), [[0, 0, 0]], 500.0, seconds=0)
    (result,) = simulate([loads], SoftGround(FlatTerrain(), SNOW), 0.01)
    assert not result.ground.tiles


def test_a_simulation_goes_on_from_a_recomposed_ground():
    first, second = (walk(steps=2, origin=(x, 0, 0)) for x in (0.0, 0.05))
    ground, footprints = pressed(first, MUD)
    recomposed = recompose(footprints)
    for state in (ground, recomposed):
        for _ in simulate([second], SoftGround(FlatTerrain(), MUD), state.cell_size, pressed=state):
            pass
    for window in ground.tile_windows():
        assert np.abs(ground.read(window) - recomposed.read(window)).max() < 1e-8


@pytest.mark.parametrize("pitch", [np.pi, np.radians(86)])
def test_a_loaded_sole_that_faces_away_from_the_ground_leaves_no_footprint(pitch):
    loads = standing(box_sole(0.25, 0.09), [[0, 0, 0]], 500.0)
    loads.motion.soles[0].transforms[:] = pose((0, 0, 0), 0.0, pitch)
    ground, footprints = pressed(loads, SNOW)
    assert not ground.tiles
    assert not footprints


def test_a_loaded_sole_beside_the_ground_leaves_no_footprint():
    loads = standing(box_sole(0.2, 0.08), [[1.0, 0, 0]], 500.0)
    ground, footprints = pressed(loads, SNOW, 0.01, HalfPlane(np.nan))
    assert not ground.tiles
    assert not footprints


@pytest.mark.parametrize("pitch", [20.0, 40.0, 60.0])
@pytest.mark.parametrize("cell_size", [0.005, 0.01])
def test_the_contact_of_a_sole_on_its_toe_tip_grows_as_it_sinks(pitch, cell_size):
    """All that is posed within the sinkage s of the tip touches, (s + tolerance)/tan(pitch) of the sole along the way:
    s·width·(s + tolerance)/tan(pitch) = F·L0/E."""
    length, width, force = 0.5, 0.1, 760.0
    sole = box_sole(length, width)
    angle = np.radians(pitch)
    count = 241
    middle = length / 2 * np.array([np.cos(angle), 0.0, np.sin(angle)])
    transforms = np.tile(pose(middle * (-1, 1, 1), 0.0, -angle), (count, 1, 1, 1))
    loads = loads_of([sole], [transforms], np.full((count, 1), force), np.ones((count, 1), bool), 30.0)
    _, (step,) = pressed(loads, SNOW, cell_size)
    tolerance = TOLERANCE * length
    pressed_volume = force * SNOW.layer_depth / SNOW.youngs_modulus
    expected = -tolerance / 2 + np.sqrt(tolerance**2 / 4 + pressed_volume * np.tan(angle) / width)
    assert step.max_depth_m == pytest.approx(expected, rel=0.03)
    assert step.area_m2 * step.max_depth_m == pytest.approx(pressed_volume, rel=0.03)
