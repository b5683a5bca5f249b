"""The film on a sole: closed forms of taking up and of fading, and no mass is lost."""

import numpy as np
import pytest

from softground_addon.core.carried.film import PRESSING, TRACE, Meeting, carry, share_left, taken_up, zone_of
from softground_addon.core.ground.surfaces import CARRIED_KINDS, LIQUIDS, SURFACES

FILMS = {name: record.carried for name, record in SURFACES.items() if record.carried}
MUD = FILMS["mud"]
AREAS = np.array([0.006, 0.004, 0.006, 0.004])


def on_floor(*shares):
    return [Meeting(float(frame), share * np.ones(4)) for frame, share in enumerate(shares)]


def test_mud_wet_sand_and_snow_stick_and_what_is_dry_does_not():
    assert set(FILMS) == {"mud", "wet_sand", "snow"}
    assert {film.kind for film in FILMS.values()} | set(LIQUIDS) == set(CARRIED_KINDS)


@pytest.mark.parametrize("film", FILMS.values(), ids=FILMS)
def test_a_sole_fills_up_as_a_geometric_series_and_holds_no_more_than_the_most(film):
    held = np.zeros(1)
    for count in range(1, 12):
        held = taken_up(held, film)
        assert held[0] == pytest.approx(film.most * (1 - (1 - film.taken / film.most) ** count), rel=1e-12)
    assert taken_up(film.most, film) == film.most


@pytest.mark.parametrize("film", FILMS.values(), ids=FILMS)
def test_equal_steps_fade_as_a_geometric_series_until_a_trace_is_left(film):
    share = share_left(2 * PRESSING, film)
    assert share == pytest.approx(film.deposited * (1 - np.exp(-2)))
    giving, carried = carry([Meeting(-1.0), *on_floor(*[share] * 400)], film, AREAS)
    films = np.array(giving)[1:, 0]
    count = int(np.ceil(np.log(TRACE * film.most / film.taken) / np.log(1 - share)))
    assert films[:count] == pytest.approx(film.taken * (1 - share) ** np.arange(count), rel=1e-12)
    assert not films[count:].any()
    assert carried.on_soles == pytest.approx(film.taken * (1 - share) ** count * AREAS.sum(), rel=1e-12)
    assert carried.on_soles < TRACE * film.most * AREAS.sum()


def test_a_sole_that_starts_dirty_fades_from_what_it_brings():
    giving, carried = carry(on_floor(*[0.2] * 3), MUD, AREAS, brought=0.5)
    assert np.array(giving)[:, 0] == pytest.approx(0.5 * MUD.most * 0.8 ** np.arange(3), rel=1e-12)
    assert carried.brought == pytest.approx(0.5 * MUD.most * AREAS.sum())
    assert carried.picked_up == 0.0


def test_what_is_brought_or_picked_up_is_left_shed_or_still_carried_whatever_a_sole_does():
    chance = np.random.default_rng(3)
    for _ in range(200):
        meetings = [
            Meeting(float(frame), chance.random(4)) if chance.random() < 0.7 else Meeting(frame, shed=chance.random())
            for frame in range(30)
        ]
        giving, carried = carry(meetings, MUD, AREAS, brought=chance.choice([0.0, chance.random()]))
        taken = carried.brought + carried.picked_up
        assert taken == pytest.approx(carried.left_behind + carried.shed + carried.on_soles, abs=1e-9)
        remaining = sum(
            film @ (AREAS * each.shares) for film, each in zip(giving, meetings, strict=True) if each.shares is not None
        )
        assert carried.left_behind == pytest.approx(remaining, abs=1e-12)
        assert carried.on_soles >= 0


def test_a_slide_leaves_up_to_twice_as_much_and_never_more_than_there_is():
    assert share_left(PRESSING, MUD, slid=0.5) == pytest.approx(1.5 * share_left(PRESSING, MUD))
    assert share_left(PRESSING, MUD, slid=9.0) == pytest.approx(2.0 * share_left(PRESSING, MUD))
    assert share_left(0.0, MUD) == 0.0
    assert share_left(1e9, FILMS["snow"], slid=9.0) <= 1.0


def test_zones_follow_each_other_from_the_heel_to_the_toes():
    assert zone_of(np.array([-0.01, 0.2, 0.4, 0.7, 0.9, 1.1])).tolist() == [0, 0, 1, 2, 3, 3]
