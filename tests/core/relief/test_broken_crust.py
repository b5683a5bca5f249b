"""A crust that breaks around prints: by the laws of plates, at once, without volume, only where it is brittle."""

from functools import cache

import numpy as np
import pytest

from softground_addon.core.composers.relief_plan import asked_of, plates_of
from softground_addon.core.ground import presets
from softground_addon.core.ground.field_tests import snow
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.numerics.cell_keys import cells_of
from softground_addon.core.playback.playback_curves import playback_curves_at
from softground_addon.core.playback.vertex_histories import vertex_histories
from softground_addon.core.record.pressed_ground import PressedGround, sample_at
from softground_addon.core.relief import amounts
from softground_addon.core.relief.broken_crust import (
    REACH,
    THICKNESS,
    elastic_modulus,
    overhang,
    plate_length,
    ring,
    tensile_strength,
)
from softground_addon.core.relief.print_shape import inside_of, nearest
from softground_addon.core.relief.steps import ReliefSettings, all_together, broken_cells, relief_of_steps, with_broken
from tests.core.relief.test_steps import around
from tests.core.walkers import pressed, walk

G = 9.81
PACKED = snow(3.16)
CRUST = plate_length(PACKED, G)
SIGMA = PACKED.blur_sigma
SHOWN = {"frame": 500.0, "frame_rate": 30.0, "cell_size": 0.005, "blur_sigma": SIGMA}
BRITTLE = {"wind-packed_snow", "crust_over_powder", "firm_snow", "piste"}


@cache
def steps(count=1):
    return tuple(pressed(walk(steps=2), PACKED, 0.005)[1][:count])


def relief(footprints, place, crust=CRUST, strength=1.0):
    wanted = ReliefSettings(amounts.of_look("snow"), strength, plates={"": crust or 0.0})
    return relief_of_steps(footprints, *place, wanted, blur_sigma=SIGMA)


def inputs_of(material, surface="snow", look="snow"):
    return {"relief_look": look, "relief_strength": 1.0, "tread_m": 0.0, "tread_pattern": "HIKING", "characters": (),
            "surface": surface, "material": vars(material), "gravity_m_s2": G}  # fmt: skip


def test_a_plate_breaks_where_a_long_one_on_springs_bends_most():
    modulus, foundation, length, count = 12e6, 2e5, 2.0, 1200
    step = length / count
    # D·w'''' + k·w = 0, with a force and no moment at the end, by finite differences.
    second = (np.eye(count, k=1) - 2 * np.eye(count) + np.eye(count, k=-1)) / step**2
    second[[0, -1]] = 0.0
    rigidity = modulus * THICKNESS**3 / (12 * (1 - 0.2**2))
    load = np.zeros(count)
    load[0] = 1.0 / step
    sunk = np.linalg.solve(rigidity * second.T @ second + foundation * np.eye(count), load)
    bent = np.abs(second @ sunk)
    assert ring(modulus, THICKNESS, foundation) == pytest.approx(step * bent.argmax(), rel=0.02)


def test_an_overhang_breaks_where_its_weight_bends_it_to_its_strength():
    density = 300.0
    length = overhang(density, THICKNESS, G)
    moment = density * G * THICKNESS * length**2 / 2
    assert 6 * moment / THICKNESS**2 == pytest.approx(tensile_strength(density))
    assert overhang(density, THICKNESS, G / 4) == pytest.approx(2 * length)


def test_strength_and_stiffness_are_those_that_were_measured():
    assert tensile_strength(917.0) == pytest.approx(79.7e3)
    assert 10e3 < tensile_strength(250.0) < 16e3
    assert 10e6 < elastic_modulus(280.0) < 15e6


def test_plates_are_hands_wide_and_wider_over_softer_ground():
    over_powder = plate_length(presets.load(presets.FOLDER / "crust_over_powder.json").material, G)
    assert 0.06 < CRUST < 0.12 < over_powder < 0.18


def test_only_hard_dry_snow_and_crusts_of_snow_are_brittle():
    for path in sorted(presets.FOLDER.glob("*.json")):
        preset = presets.load(path)
        assert any(plates_of(inputs_of(preset.material, preset.surface)).values()) == (path.stem in BRITTLE), path.stem


def test_a_print_that_is_no_deeper_than_its_crust_breaks_nothing():
    piste = presets.load(presets.FOLDER / "piste.json").material
    footprint = pressed(walk(steps=2), piste, 0.005)[1][0]
    assert footprint.max_depth_m < 0.04
    assert not len(broken_cells([footprint], asked_of(inputs_of(piste), [footprint]))[0])


def test_plates_have_no_volume():
    place = around(steps(), 0.0025, 0.5)
    (step,) = relief(steps(), place)
    sample = sample_at(steps(), *place, **SHOWN)
    (plates,) = step.plates
    assert abs(plates.change[:, 0].sum()) < 0.01 * sample.compression.sum()
    assert plates.change[:, 0].min() < -0.75 * THICKNESS
    assert 0.002 < plates.change[:, 0].max() < THICKNESS


def test_plates_reach_from_the_hole_to_their_laws_length_and_behind_it():
    footprint = steps()[0]
    cells = cells_of(broken_cells([footprint], asked_of(inputs_of(PACKED), [footprint]))[0])
    far = 60
    window = footprint.window.expanded(far)
    distance = nearest(inside_of(np.pad(footprint.tile(footprint.pressing), far)), far)[0] * footprint.cell_size
    out = distance[cells[:, 1] - window.row, cells[:, 0] - window.column]
    assert out.max() < REACH * CRUST
    ring_of_plates = (distance > 0.2 * CRUST) & (distance < 0.6 * CRUST)
    assert np.count_nonzero((out > 0.2 * CRUST) & (out < 0.6 * CRUST)) > 0.6 / 4 * ring_of_plates.sum()
    behind = (distance > 1.2 * CRUST) & (distance < 1.5 * CRUST)
    assert np.count_nonzero((out > 1.2 * CRUST) & (out < 1.5 * CRUST)) < 0.6 / 4 * behind.sum()


def test_plates_lie_lower_toward_the_hole():
    footprint = steps()[0]
    place = around([footprint], 0.0025, 0.4)
    (step,) = relief([footprint], place)
    (plates,) = step.plates
    far = 60
    window = footprint.window.expanded(far)
    out = nearest(inside_of(np.pad(footprint.tile(footprint.pressing), far)), far)[0] * footprint.cell_size
    out = out[window.cells_under(*place[:, plates.point], footprint.cell_size)] / CRUST
    height = plates.change[:, 0]
    near, middle, edge = (np.median(height[(out > low) & (out < low + 0.2)]) for low in (0.05, 0.4, 0.7))
    assert near < middle < edge


def test_the_same_places_give_the_same_bytes_in_any_company():
    place = around(steps(2), 0.005, 0.4)
    whole = all_together(relief(steps(2), place), place.shape[1])
    half = np.arange(0, place.shape[1], 1)[::-1]
    assert np.array_equal(whole[half], all_together(relief(steps(2), place[:, half]), place.shape[1]))


def test_plates_break_within_two_frames_and_stay():
    place = around(steps(), 0.005, 0.4)
    of_steps = relief(steps(), place)
    (plates,) = of_steps[0].plates
    begin, end = plates.frames
    assert steps()[0].start_frame < end < steps()[0].end_frame
    assert 0 < end - begin <= 2.0
    histories = vertex_histories(steps(), *place, blur_sigma=SIGMA, relief=of_steps).movement
    plain = vertex_histories(steps(), *place, blur_sigma=SIGMA).movement
    still = np.setdiff1d(plates.point, plain.point)
    assert len(still) > 100
    change = dict(zip(plates.point.tolist(), plates.change[:, 0], strict=True))
    for frame, share in ((begin, 0.0), ((begin + end) / 2, 0.5), (end, 1.0), (end + 100, 1.0)):
        shown = histories.at(frame, place.shape[1])[still, 0]
        assert shown == pytest.approx(share * np.array([change[point] for point in still.tolist()]))


def test_playback_has_plates_beyond_the_cells_that_the_step_moves():
    place = around(steps(), 0.005, 0.4)
    of_steps = relief(steps(), place)
    at = of_steps[0].plates[0].point
    spans, _ = playback_curves_at(steps(), *place, blur_sigma=SIGMA, frame_rate=30.0, relief=of_steps)
    assert np.isin(at, spans.point).all()
    last = dict(zip(spans.point.tolist(), spans.last_height.tolist(), strict=True))
    shown = sample_at(steps(), *place, **SHOWN).with_relief(*all_together(of_steps, place.shape[1]).T).display
    assert np.abs(shown[at] - [last[point] for point in at.tolist()]).max() < 1e-5


def test_the_trail_holds_the_cells_of_plates():
    trail, shown = PressedGround.at(steps(), **SHOWN).trail(1e-4), asked_of(inputs_of(PACKED), steps())
    cells, edges = broken_cells(steps(), shown)
    assert 0.2 * len(cells) < len(edges) < 0.6 * len(cells)
    wider = with_broken(trail, steps(), shown)
    assert wider.covers(*((cells_of(cells) + 0.5) * 0.005).T).all()
    assert np.isin(trail.moved, wider.moved).all()
    assert len(wider.moved) > len(trail.moved)


def test_a_later_step_leaves_no_plates_in_its_hole_and_breaks_none_in_an_earlier_one():
    first, second = pressed(walk(steps=2, speed=0.35), PACKED, 0.005)[1][:2]
    place = around([first, second], 0.005, 0.4)
    both = relief([first, second], place)
    plates = both[1].plates[0].point
    assert len(plates)
    for step, its in zip((first, second), both, strict=True):
        deep = sample_at([step], *place, **SHOWN).display
        deep[its.point] += its.change[:, 0]
        hole = deep[plates] < -0.9 * step.max_depth_m
        assert not np.abs(both[1].plates[0].change[hole]).max(initial=0.0) > 1e-3
    loose = (
        ReliefSettings(amounts.of_look("snow"), plates={"": CRUST})
        .crust_around(first)
        .at(*place[:, both[0].plates[0].point], 0.005)[1]
    )
    assert not np.isin(plates, both[0].plates[0].point[loose]).any()


def test_off_is_off():
    place = around(steps(), 0.005, 0.4)
    assert not len(broken_cells(steps(), asked_of(inputs_of(PACKED, look=""), steps()))[0])
    assert not relief(steps(), place, None)[0].plates
    assert not relief(steps(), place, strength=0.0)[0].plates[0].change.any()


@pytest.mark.parametrize("look", SURFACES)
def test_other_surfaces_have_no_crust(look):
    assert any(plates_of(inputs_of(PACKED, look)).values()) == (look == "snow")
