"""Grounds of several kinds: each half of a walk as on its ground alone, and exact volumes across the borders."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.carving import carves
from softground_addon.core.carving.carver import Walls
from softground_addon.core.checks.volumes import check_volumes
from softground_addon.core.composers.edited_steps import with_edits
from softground_addon.core.composers.simulation import simulate
from softground_addon.core.errors import InputError
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.presets import FOLDER, find, load
from softground_addon.core.ground.regions import HARD, GroundKind, Regions, numbered
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.ground.terrain import MeshTerrain
from softground_addon.core.ground.variation import PaintedSurface
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit, step_id
from softground_addon.core.record.footprints import QUANTUM, recompose
from softground_addon.core.record.record import BakeRecord
from tests.core.pressing.test_ground_invariants import random_loads
from tests.core.prop_bodies import rolling
from tests.core.walkers import box_sole, equilibrium_depth, standing, walk

MUD, SNOW = GroundMaterial(0.625e6, 0.35, 0.15), GroundMaterial(0.2e6, 0.05, 0.2, rim_reach=0.06)
FOUR = tuple(
    GroundKind(preset.surface, preset.material) for preset in map(find, ("snow", "dry_sand", "settled_snow", "mud"))
)


EVERY = [GroundKind(preset.surface, preset.material) for preset in map(load, sorted(FOLDER.glob("*.json")))]


def stripes(borders, kinds, *, width=20.0):
    """A level ground whose kind changes at places along x [m]."""
    x = np.array([-width, *borders, width])
    vertices = np.array([(across, along, 0.0) for across in x for along in (-width, width)])
    first = 2 * np.repeat(np.arange(len(x) - 1), 2)
    corners = np.tile([[0, 2, 3], [0, 3, 1]], (len(x) - 1, 1)) + first[:, None]
    terrain = MeshTerrain.from_mesh(vertices, corners, of_faces=np.repeat(np.arange(len(x) - 1), 2))
    return SoftGround(terrain, kinds[0].material, "CENTRE_OF_PRESSURE", regions=Regions(kinds, terrain))


def pressed(loads, ground, cell=0.01):
    footprints = []
    for result in simulate([loads], ground, cell):
        footprints += result.footprints
    return result.ground, footprints


def alone(ground, kind):
    return replace(ground, material=kind.material, regions=None)


def same(first, other):
    """True if two prints change the ground by the same bits."""
    return all(
        np.array_equal(np.asarray(getattr(a, name)), np.asarray(getattr(b, name)))
        for a, b in ((first.compression, other.compression), (first.rim, other.rim))
        for name in ("frames", "cells", "amounts")
    )


def test_each_part_of_a_walk_is_as_on_its_ground_alone_bit_for_bit():
    loads = walk(steps=9)
    _, plain = pressed(loads, alone(stripes([], FOUR[:1]), FOUR[0]))
    middles = [step.position[0] for step in plain]
    borders = [(middles[n] + middles[n + 1]) / 2 for n in (1, 3, 5)]
    ground = stripes(borders, FOUR)
    _, prints = pressed(loads, ground)
    expected = np.searchsorted(borders, middles)
    assert [step.surface for step in prints] == [FOUR[number].surface for number in expected]
    assert set(expected) == set(range(len(FOUR)))
    check_volumes(prints, ground)
    for number, step in zip(expected, prints, strict=True):
        raised = 2.0 * FOUR[number].material.poisson_ratio * step.compressed_m3
        assert step.rim_m3 + step.unplaced_rim_m3 == pytest.approx(raised, rel=1e-6)
    for kind in range(len(FOUR)):
        _, others = pressed(loads, alone(ground, FOUR[kind]))
        assert all(same(prints[number], others[number]) for number in np.flatnonzero(expected == kind))


def test_a_foot_on_a_border_prints_each_side_by_its_own():
    kinds = (GroundKind("mud", MUD), GroundKind("snow", SNOW))
    sole = box_sole(0.24, 0.08)
    loads = standing(sole, [[0.02, 0, 0]], 400.0, seconds=3.0)
    ground, (step,) = pressed(loads, replace(stripes([0.0], kinds), pressure="UNIFORM"))
    deep = [equilibrium_depth(400.0, sole.patches[0].area, kind.material) for kind in kinds]
    cells = np.arange(-9.5, 13.5) * 0.01
    across = ground.sample(cells, np.zeros(len(cells)))[0]
    assert across[cells < -0.012] == pytest.approx(deep[0], rel=1e-3)
    assert across[cells > 0.012] == pytest.approx(deep[1], rel=1e-3)
    thirds = deep[0] + np.array([1, 2]) / 3 * (deep[1] - deep[0])
    assert across[np.abs(cells) < 0.01] == pytest.approx(thirds, rel=1e-3)
    assert step.surface == "snow"
    compressed, x = step.tile(step.compression).sum(axis=0) * 1e-4, step.window.centres(0.01)[0]
    snow = np.select([x < -0.01, x < 0, x < 0.01], [0, 1 / 3, 2 / 3], 1.0)
    ratio = MUD.poisson_ratio + snow * (SNOW.poisson_ratio - MUD.poisson_ratio)
    assert step.rim_m3 == pytest.approx(2.0 * float(ratio @ compressed), rel=1e-6)


def test_one_kind_is_as_if_there_were_no_regions_bit_for_bit():
    loads, kind = walk(steps=4), FOUR[3]
    ground = stripes([0.5], (kind,))
    numbers = replace(ground.regions.where, values=np.zeros_like(ground.regions.where.values))
    field, prints = pressed(loads, replace(ground, regions=Regions((kind,), numbers)))
    plain, others = pressed(loads, alone(ground, kind))
    assert all(same(each, other) for each, other in zip(prints, others, strict=True))
    assert all((field.read(window) == plain.read(window)).all() for window in plain.tile_windows())


def test_slots_of_one_preset_are_one_kind():
    kinds, numbers = numbered(FOUR[0], {1: FOUR[1], 2: FOUR[0], 3: None, 5: FOUR[1]})
    assert kinds == FOUR[:2]
    assert numbers == {1: 1.0, 2: 0.0, 3: HARD, 5: 1.0}


def test_shares_are_one_in_sum_and_go_over_evenly_across_two_cells():
    regions, window = stripes([0.3], FOUR[:2]).regions, Window(-2, 3, 10, 4)
    assert regions.under(Window(-5, 0, 4, 4), window, 0.1) == ([0], None)
    assert regions.under(Window(5, 0, 4, 4), window, 0.1) == ([1], None)
    kinds, shares = regions.under(window, window, 0.1)
    assert kinds == [0, 1]
    assert shares.sum(axis=0) == pytest.approx(1.0)
    assert shares[1] == pytest.approx(np.tile([0, 0, 0, 0, 1 / 3, 2 / 3, 1, 1, 1, 1], (4, 1)))


def test_layers_are_as_deep_as_those_of_the_kinds_and_walls_those_of_the_kind_under_a_step():
    deep, shallow = (
        GroundKind(surface, replace(SNOW, layer_depth=depth)) for surface, depth in (("snow", 0.8), ("sand", 0.2))
    )
    ground, window = stripes([0.3], (deep, shallow)), Window(-2, 3, 10, 4)
    assert ground.layer_depths(window, 0.1)[0] == pytest.approx([0.8, 0.8, 0.8, 0.8, 0.6, 0.4, *[0.2] * 4])
    assert ground.layer_depths(Window(5, 0, 4, 4), 0.1) == 0.2
    assert alone(ground, deep).layer_depths(window, 0.1) == 0.8
    for x, kind in ((0.22, deep), (0.38, shallow)):
        _, (step,) = pressed(standing(box_sole(0.3, 0.1), [x, 0.0, 0.0], 700.0), ground)
        of_step = carves._walls(step, ground, "mud")
        assert of_step == Walls.of(SURFACES[kind.surface], kind.material, ground.gravity)


def test_beside_the_ground_there_is_no_other_kind():
    ground = stripes([0.0], FOUR[:2], width=1.0)
    for window, kinds in ((Window(5, 0, 20, 4), [1]), (Window(50, 0, 4, 4), [0])):
        assert ground.regions.under(window, window, 0.1) == (kinds, None)
    window = Window(-2, 8, 4, 6)
    _, shares = ground.regions.under(window, window, 0.1)
    assert shares[1, :3] == pytest.approx(np.tile([0, 1 / 3, 2 / 3, 1], (3, 1)))
    assert shares[:, 3:] == pytest.approx(0.5)


def test_masks_work_on_every_kind():
    ground = stripes([0.0], (GroundKind("mud", MUD), GroundKind("snow", SNOW)))
    factors = np.tile([0.5, 1.0, 0.5], (6, 1))
    x = np.array([-20.0, 0.0, 20.0])
    vertices = np.array([(across, along, 0.0) for across in x for along in (-20.0, 20.0)])
    terrain = MeshTerrain.from_mesh(
        vertices,
        np.array([[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]]),
        values=factors,
        of_faces=np.array([0, 0, 1, 1]),
    )
    painted = replace(
        ground, terrain=terrain, variation=PaintedSurface(terrain), regions=Regions(ground.regions.kinds, terrain)
    )
    for place, material in ((-0.5, MUD), (0.5, SNOW)):
        loads = standing(box_sole(0.24, 0.08), [[place, 0, 0]], 300.0)
        (plain,), (softer,) = pressed(loads, ground)[1], pressed(loads, painted)[1]
        assert softer.max_depth_m == pytest.approx(2 * plain.max_depth_m, rel=1e-6)
        assert softer.rim_m3 == pytest.approx(material.poisson_ratio * softer.compressed_m3, rel=1e-9)


def rut_depth(ground, x):
    cells = np.arange(-20, 20) * 0.005
    return float(ground.sample(np.full(len(cells), x), cells)[0].max())


def test_a_wheel_that_rolls_over_a_border_leaves_each_rut_as_on_that_ground_alone():
    loads = rolling(30.0)
    kinds = (GroundKind("mud", MUD), GroundKind("snow", SNOW))
    ground = stripes([0.75], kinds)
    across, prints = pressed(loads, ground)
    for x, kind in ((0.4, kinds[0]), (1.1, kinds[1])):
        expected = rut_depth(pressed(loads, alone(ground, kind))[0], x)
        assert rut_depth(across, x) == pytest.approx(expected, rel=0.02)
    check_volumes(prints, ground)


@settings(max_examples=12)
@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.floats(-0.5, 2.0), min_size=1, max_size=3, unique=True).map(sorted),
    st.lists(st.sampled_from(EVERY), min_size=4, max_size=4, unique=True),
    st.sampled_from([0.0, 5.0]),
)
def test_volumes_limits_and_the_record_hold_on_any_grounds_wherever_the_borders_lie(seed, borders, four, hardening):
    kinds = tuple(replace(kind, material=replace(kind.material, hardening=hardening)) for kind in four)
    kinds = kinds[: len(borders) + 1]
    soft = stripes(borders, kinds)
    ground, footprints = pressed(random_loads(seed), soft, cell=0.03)
    check_volumes(footprints, soft)
    recomposed = recompose(footprints, cell_size=0.03)
    for window in ground.tile_windows():
        state = ground.read(window)
        deepest = np.array([kind.material.deepest for kind in kinds])
        x = window.centres(0.03)[0]
        near = np.stack([deepest[np.searchsorted(borders, x + off)] for off in (-0.031, 0.0, 0.031)]).max(axis=0)
        assert (state[0] <= near * (1 + 1e-9)).all()
        assert recomposed.read(window) == pytest.approx(state, abs=QUANTUM)
    compressed, rim = ground.volumes()
    assert rim == pytest.approx(sum(step.rim_m3 for step in footprints), rel=1e-6, abs=1e-15)
    assert compressed == pytest.approx(sum(step.compressed_m3 for step in footprints), rel=1e-6, abs=1e-15)


def test_a_step_that_is_moved_over_a_border_is_pressed_into_what_is_there():
    loads, ground = walk(steps=5), stripes([0.9], (FOUR[3], FOUR[2]))
    _, prints = pressed(loads, ground)
    moved = next(step for step in prints if step.position[0] < 0.5)
    bake = with_edits(BakeRecord(tuple(prints), {}), {step_id(moved): StepEdit(move_m=(3.0, 1.0))}, ground, 0.01)
    (now,) = bake.pressed_again.values()
    assert (moved.surface, now.surface) == ("mud", "snow")
    assert now.max_depth_m > 1.5 * moved.max_depth_m
    loaded = record.load(record.dump(bake))
    assert [step.surface for step in loaded.footprints] == [step.surface for step in prints]
    assert [step.surface for step in loaded.pressed_again.values()] == ["snow"]


def test_a_record_that_names_no_known_surface_is_damaged():
    _, prints = pressed(walk(steps=1), stripes([], FOUR[:1]))
    content = record.dump(BakeRecord([replace(prints[0], surface="custard")], {}))
    with pytest.raises(InputError, match="damaged"):
        record.load(content)


def grid(borders, kinds, faces=200, size=10.0):
    """As `stripes`, of faces of 5 cm."""
    axis = np.linspace(-size / 2, size / 2, faces + 1)
    x, y = np.meshgrid(axis, axis)
    vertices = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    first = (np.arange(faces)[:, None] * (faces + 1) + np.arange(faces)).reshape(-1, 1)
    triangles = np.concatenate(
        [first + np.array(corners) for corners in ((0, 1, faces + 2), (0, faces + 2, faces + 1))]
    )
    of_faces = np.searchsorted(borders, vertices[triangles].mean(axis=1)[:, 0])
    terrain = MeshTerrain.from_mesh(vertices, triangles, of_faces=of_faces)
    return SoftGround(terrain, kinds[0].material, "CENTRE_OF_PRESSURE", regions=Regions(kinds, terrain))


@pytest.mark.alone
@pytest.mark.parametrize("make", [stripes, grid])
def test_looking_regions_up_takes_at_most_three_hundredths_of_the_simulation(make, monkeypatch):
    loads, ground, spent = walk(steps=8), make([1.2, 2.5, 3.8], FOUR), []
    looked_up = Regions.under

    def timed(*asked):
        began = time.process_time()
        result = looked_up(*asked)
        spent.append(time.process_time() - began)
        return result

    monkeypatch.setattr(Regions, "under", timed)
    shares = []
    for _ in range(5):
        spent.clear()
        began = time.process_time()
        pressed(loads, ground, cell=0.005)
        shares.append(sum(spent) / (time.process_time() - began))
    assert len(spent) == 8
    assert min(shares) < 0.03
