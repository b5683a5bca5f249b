"""The sound of steps: when, how loud, how high, and never twice the same."""

import io
import time
import wave
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from softground_addon.core.errors import InputError
from softground_addon.core.events import sound, wave_file
from softground_addon.core.events.events import LANDINGS, events
from softground_addon.core.ground.presets import find
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.record.edits import step_id
from tests.core.walkers import pressed, walk

RATE = wave_file.RATE
GROUNDS = {"snow": "snow", "dry_sand": "sand", "wet_sand": "wet_sand", "mud": "mud", "soil": "soil"}


@pytest.fixture(scope="module")
def loads():
    return walk(steps=4)


@pytest.fixture(scope="module")
def grounds(loads):
    """By surface: events and steps of the same walk."""
    spectra = {}
    for name, surface in GROUNDS.items():
        _, footprints = pressed(loads, find(name).material, cell_size=0.03)
        table = events([loads], footprints, surface=surface, first_frame=1.0)
        spectra[surface] = (
            table,
            sound.steps_of(
                dict(zip(map(step_id, footprints), footprints, strict=True)), table, frame_rate=30.0, first_frame=1.0
            ),
        )
    return spectra


def centroid(heard):
    """Of the power above 200 Hz, where footstep sounds are compared: below is the thump."""
    power, pitch = np.abs(np.fft.rfft(heard)) ** 2, np.fft.rfftfreq(len(heard), 1 / RATE)
    above = pitch > 200
    return (power * pitch)[above].sum() / power[above].sum()


def lasting(heard):
    """From 5 % to 95 % of the energy [s]."""
    part = np.cumsum(heard**2) / np.sum(heard**2)
    return (np.searchsorted(part, 0.95) - np.searchsorted(part, 0.05)) / RATE


def later(step, by):
    """A step that comes some seconds later."""
    compacted = step.compacted + np.array([by, by, 0.0])
    return replace(step, time=step.time + by, struck=step.struck + by, lifted=step.lifted + by, compacted=compacted)


@pytest.mark.parametrize("surface", GROUNDS.values())
def test_each_step_is_heard_within_two_milliseconds_of_its_strike_and_not_before(grounds, surface):
    table, steps = grounds[surface]
    strikes = {row["step"]: row["time_s"] for row in table if row["phase"] in LANDINGS}
    assert len(strikes) == 4
    for step in steps:
        begin, heard = sound.step_sound(step)
        onset = (begin + np.flatnonzero(np.abs(heard) > 0.05 * np.abs(heard).max())[0]) / RATE
        assert 0 <= onset - strikes[step.name] + 1 / RATE < 0.002


@pytest.mark.parametrize("surface", GROUNDS.values())
def test_the_harder_the_louder(grounds, surface):
    step = grounds[surface][1][1]
    levels = [sound.step_sound(replace(step, force=step.force * part))[1].std() for part in (0.3, 0.6, 1.0, 1.7, 3.0)]
    assert np.all(np.diff(levels) > 0)
    assert levels[-1] / levels[0] == pytest.approx(10.0, rel=0.1)


@pytest.mark.parametrize(
    ("surface", "low", "high"),
    [("snow", 1000, 4000), ("soil", 500, 3000), ("sand", 2000, 7000), ("mud", 200, 1200), ("wet_sand", 800, 4000)],
)
def test_pitch_and_length_are_those_of_the_surface(grounds, surface, low, high):
    """Resonances of snow lie at 1-4 kHz, of gravel and soil at 0.5-3 kHz (Fontana and Bresin 2003, Turchet 2010);
    a step on loose ground is heard for most of its stance, 0.68 s here (Cook 2002)."""
    for step in grounds[surface][1]:
        heard = sound.step_sound(step)[1]
        assert low < centroid(heard) < high
        assert 0.2 < lasting(heard) < 0.75


def test_a_step_on_a_hard_floor_clicks_as_it_comes_down_and_no_print_is_needed(loads):
    """In time with its strike, short, and not as on any ground that gives way; as loud as the force."""
    hard = loads.contacts.touching & (np.arange(2) == 0)
    on_floor = replace(loads, contacts=replace(loads.contacts, touching=loads.contacts.touching & ~hard, hard=hard))
    table = events([on_floor], [], surface="snow", first_frame=1.0)
    strikes = [row for row in table if row["phase"] == "heel_strike" and row["contact"] == "foot.L"]
    steps = sound.steps_of({}, table, frame_rate=30.0, first_frame=1.0)
    assert [step.struck for step in steps] == pytest.approx([row["time_s"] for row in strikes], abs=1e-6)
    assert {step.surface for step in steps} == {"hard"}
    for step, row in zip(steps, strikes, strict=True):
        begin, heard = sound.step_sound(step)
        loud = np.abs(heard) > 0.05 * np.abs(heard).max()
        assert 0 <= (begin + np.flatnonzero(loud)[0]) / RATE - row["time_s"] + 1 / RATE < 0.004
        assert 300 < centroid(heard) < 3000
        assert lasting(heard) < 0.2
        assert step.position == pytest.approx(row["position"])
        assert trapezoid(step.force, step.time) == pytest.approx(
            sum(each["impulse_ns"] for each in table if each["contact"] == "foot.L" and each["phase"] != "toe_off") / 2,
            rel=0.2,
        )
    assert sound.step_sound(replace(steps[0], force=2 * steps[0].force))[1].std() == pytest.approx(
        2 * sound.step_sound(steps[0])[1].std(), rel=0.01
    )


@pytest.mark.parametrize("surface", ["snow", "soil"])
def test_what_crunches_gives_way_as_often_as_published(grounds, surface):
    """7 in 1024 samples at 22 kHz to 44 kHz, 150-300 each second (Cook 1997), while the middle 90 % is compacted."""
    for step in grounds[surface][1]:
        at, _ = sound.micro_impacts(step, SURFACES[surface].voice, np.random.default_rng(0))
        early, late = np.percentile(at, [5, 95])
        assert 150 <= 0.9 * len(at) / (late - early) <= 300


@pytest.mark.parametrize("surface", ["snow", "wet_sand", "mud", "soil"])
def test_energies_of_micro_impacts_fall_as_published(grounds, surface):
    """As E^-gamma with gamma of 1.2 to 1.8 (Fontana and Bresin 2003): the exponent that is likeliest for them."""
    random, step = np.random.default_rng(0), grounds[surface][1][1]
    energy = np.concatenate([sound.micro_impacts(step, SURFACES[surface].voice, random)[1] for _ in range(40)])
    gammas = np.linspace(1.05, 2.2, 116)
    weakened = np.array([np.mean(-gamma * np.log(energy)) for gamma in gammas])
    whole = (1.0 - sound.STRONGEST ** (1.0 - gammas)) / (gammas - 1.0)
    assert 1.2 <= gammas[np.argmax(weakened - np.log(whole))] <= 1.8 + 0.05


def test_micro_impacts_follow_the_ground_that_gives_way(grounds):
    """Where the record says that nothing gave way, snow does not crackle."""
    step = grounds["snow"][1][1]
    begin, end, middle = step.time[0], step.time[-1], (step.time[0] + step.time[-1]) / 2
    early = replace(step, compacted=np.array([[begin, middle, 1e-3]]), force=np.linspace(1, 700, len(step.time)))
    at = sound._times(early, np.linspace(0, 0.999, 101))
    assert at.min() >= begin - (end - begin) / len(step.time) - 1e-9
    assert at.max() <= middle + 0.01


def test_wet_soles_squeak_as_they_leave_a_floor_muddy_ones_squelch_and_sand_grinds(loads):
    rows = [row | {"surface": "hard", "step": ""} for row in events([loads], [], surface="snow", first_frame=1.0)]
    clean = sound.steps_of({}, rows, frame_rate=30.0, first_frame=1.0)[0]
    begin, heard = sound.step_sound(clean)

    def added(kind, film):
        return sound.step_sound(replace(clean, carried=kind, film=film))[1] - heard

    time = (begin + np.arange(len(heard))) / RATE - clean.lifted
    for kind, (low, high) in {"water": (1000, 4500), "mud": (250, 1200)}.items():
        loud, quiet = added(kind, 1.0), added(kind, 0.1)
        assert not loud[np.abs(time) > sound.SQUEAK].any()
        assert low < centroid(loud) < high
        assert 0 < np.abs(quiet).max() < 0.5 * np.abs(loud).max()
        assert not added(kind, 0.0).any()
    assert lasting(added("sand", 1.0)) > lasting(added("water", 1.0))


def test_no_two_steps_are_alike_and_the_same_bake_gives_the_same_bytes(grounds):
    steps = grounds["snow"][1]
    once, again = (wave_file.dump(sound.footsteps(steps, 3.0)) for _ in range(2))
    assert once == again
    step = steps[1]
    other = replace(step, name="walker/foot.L@99.0")
    first, second = sound.step_sound(step)[1], sound.step_sound(other)[1]
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.5


def test_a_file_is_read_by_pythons_own_reader(grounds):
    heard = sound.footsteps(grounds["soil"][1], 3.0)
    with wave.open(io.BytesIO(wave_file.dump(heard))) as file:
        assert (file.getframerate(), file.getsampwidth(), file.getnchannels()) == (48_000, 3, 1)
        content = np.frombuffer(file.readframes(file.getnframes()), np.uint8).reshape(-1, 3)
    whole = np.zeros((len(content), 4), np.uint8)
    whole[:, 1:] = content
    np.testing.assert_allclose(whole.view("<i4")[:, 0] / 2**31, heard[:, 0], rtol=0, atol=2e-7)
    assert len(heard) == 3 * RATE


def test_two_channels_have_the_gains_that_are_asked_for(grounds):
    steps = [replace(each, gains=(0.3, 0.6)) for each in grounds["sand"][1]]
    heard = sound.footsteps(steps, 3.0)
    assert heard.shape == (3 * RATE, 2)
    np.testing.assert_allclose(heard[:, 1], 2 * heard[:, 0], rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("seconds", [0.05, 0.5, 100.0])
def test_steps_beyond_the_ends_are_cut(grounds, seconds):
    steps = [later(each, by) for by in (-5, -1, 1) for each in grounds["mud"][1]]
    assert np.isfinite(sound.footsteps(steps, seconds)).all()


def test_an_artists_own_sounds_play_at_the_strikes_as_loud_as_the_forces(grounds, tmp_path):
    tone = np.sin(np.arange(4410) * 0.2)
    for name, part in (("snow_a", 0.5), ("snow_b", 0.25), ("wood", 1.0)):
        with wave.open(str(tmp_path / f"{name}.wav"), "wb") as file:
            file.setnchannels(2)
            file.setsampwidth(2)
            file.setframerate(44_100)
            file.writeframes(np.repeat(np.rint(tone * part * 32767), 2).astype("<i2").tobytes())
    recordings = [(path.name, wave_file.read(path)) for path in sorted(tmp_path.iterdir())]
    assert all(np.abs(recording).max() == pytest.approx(1.0) for _, recording in recordings)
    assert len(recordings[0][1]) == pytest.approx(4410 * 48 / 44.1, abs=2)
    steps = grounds["snow"][1]
    heard = sound.footsteps(steps, 3.0, recordings)[:, 0]
    for step in steps:
        begin = round(step.struck * RATE)
        part = heard[begin : begin + 4000]
        assert np.abs(part).max() == pytest.approx(sound.LOUDNESS * step.force.max() / 700.0, rel=0.01)
        assert not heard[begin - 100 : begin].any()


@pytest.mark.parametrize("spoil", [lambda content: b"nothing", lambda content: content[:24] + bytes(4) + content[28:]])
def test_a_recording_that_is_none_is_named(tmp_path, spoil):
    path = tmp_path / "step.wav"
    path.write_bytes(spoil(wave_file.dump(np.zeros((9, 1)))))
    with pytest.raises(InputError, match=r"step\.wav' cannot be read"):
        wave_file.read(path)


def test_a_minute_of_walking_takes_less_than_five_seconds(grounds):
    steps = [replace(later(each, 2 * k), name=f"{each.name}{k}") for k in range(28) for each in grounds["snow"][1]]
    begun = time.process_time()
    sound.footsteps(steps, 60.0)
    assert len(steps) > 110
    assert time.process_time() - begun < 5.0
