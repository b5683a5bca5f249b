"""The sound of footsteps from the forces and the ground of a bake.

What a step compacts crackles: a Poisson process of micro-impacts, at the rate at which the record says that ground gave
way. What slides hisses as the force changes. The heel thumps on what it has packed, and mud pops as the foot leaves.
On a hard floor, heel and ball click as they come down; wet soles squeak as they leave, muddy ones squelch, and sand
grinds.
See `core.ground.surfaces` for the sources.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..ground import surfaces
from ..ground.surfaces import Voice
from ..numerics.arrays import Array
from ..record.footprints import QUANTUM, Footprint
from .events import LANDINGS, Event
from .wave_file import RATE

ADULT_WEIGHT = 700.0
"""Peak force that sounds as loud as `LOUDNESS` [N]."""
LOUDNESS = 0.25
"""Amplitude of a step in which all parts peak together."""
LOADING_RATE = 10.0 * ADULT_WEIGHT
"""Change of force at which sliding sounds as loud [N/s]."""
FEWEST, MOST = 30, 4000
"""Micro-impacts of a step that crackles at all."""
STRONGEST = 1e4
"""Energy of the strongest micro-impact over that of the weakest."""
GRAINS = 48
"""Kinds of micro-impacts: pitch and decay of each."""
THUMP_DECAY = 0.035
"""Decay of a heel's thump on packed ground [s]."""
STRIKE = 0.06
"""The heel's force is the largest within this time after the strike [s]."""
SMOOTH = 0.006
"""Time over which the hiss follows the force [s]."""
LONGEST_NOISE = 2**18
"""Samples after which the noise of a long contact repeats."""
POP_LENGTH, POP_RISE = 0.05, (280.0, 950.0)
"""Time in which the suction of mud gives way [s], and the range in which its pitch rises [Hz]."""
FULL_POP = 0.05
"""Depth of mud that pops as loud as it gets [m]."""
TAIL = 0.1
"""Ringing after a foot has left [s]."""
CLICK = 0.006
"""Time within which a heel or a ball meets a hard floor [s]."""
CLICKS = {"heel_strike": 3.0, "land": 3.0, "foot_flat": 1.0}
"""Phases that click on a hard floor, by their shares of its energy."""
SQUEAK, SQUEAK_PITCH = 0.09, (1100.0, 2300.0)
"""Time in which a wet sole sticks and slips before it leaves [s], and the range of its pitch [Hz]; by ear."""
SPACING = 0.002
"""Between samples of a force that is known by its peaks [s]."""


@dataclass(frozen=True)
class SoundStep:
    """Sources of a step's sound.

    Attributes
    ----------
    name : str
        Id of the step, which seeds all that is random in its sound.
    struck : float or None
        Time of the strike [s]; None of one that was there already.
    lifted : float or None
        Time of leaving [s].
    time, force : (K,) float arrays
        Normal force over time [s], [N].
    compacted : (M, 3) float array
        Start and end [s] of volumes that give way [m³].
    depth : float
        Of its print [m].
    frame, position
        Scene frame and place [m] at which it begins.
    gains : tuple of float
        Of each channel.
    carried, film : str, float
        What the sole brings to a hard floor, and how much of it over the most.
    """

    name: str
    surface: str
    struck: float | None
    lifted: float | None
    time: Array
    force: Array
    compacted: Array
    depth: float
    frame: float
    position: Array
    gains: tuple[float, ...] = (1.0,)
    carried: str = ""
    film: float = 0.0

    @property
    def begin(self) -> float:
        """Time from which it sounds [s]."""
        return float(self.time[0]) if self.struck is None else self.struck


def steps_of(
    footprints: Mapping[str, Footprint], table: Sequence[Event], *, frame_rate: float, first_frame: float
) -> list[SoundStep]:
    """Sounding steps of a bake.

    Parameters
    ----------
    table : sequence of Event
        From `events.events`.
    frame_rate : float
        Scene frames per second [Hz].
    first_frame : float
        At which the sound begins.
    """
    struck = {row["step"]: row for row in table if row["phase"] in LANDINGS}
    lifted = {row["step"]: row for row in table if row["phase"] == "toe_off"}
    surface = next((row["surface"] for row in table if row["surface"] != surfaces.HARD), surfaces.DEFAULT)

    def seconds(frames: Array | float) -> Array:
        return (np.asarray(frames, float) - first_frame) / frame_rate

    def moment(row: Event | None) -> float | None:
        return None if row is None else float(seconds(row["frame"]))

    heard = []
    for name, step in footprints.items():
        volumes = _volumes(step)
        ends = np.asarray(step.pressing.frames)
        compacted = np.stack([seconds(ends - step.frame_step), seconds(ends), volumes], axis=1)
        time, force = seconds(step.load_frames), np.asarray(step.load_n, float)
        marks = moment(struck.get(name)), moment(lifted.get(name))
        place = step.start_frame, step.position
        heard.append(SoundStep(name, step.surface or surface, *marks, time, force, compacted, step.max_depth_m, *place))
    return [*heard, *(_on_hard(rows, frame_rate, first_frame) for rows in _hard_contacts(table))]


def _hard_contacts(table: Sequence[Event]) -> Iterator[list[Event]]:
    """The phases of each contact with a hard floor, from its landing on."""
    of_soles: dict[tuple[str, str], list[list[Event]]] = {}
    for row in table:
        contacts = of_soles.setdefault((row["character"], row["contact"]), [])
        if row["surface"] != surfaces.HARD or row["phase"] in (*LANDINGS, "scuff"):
            contacts.append([])  # no phase after this is of the contact before it
        if contacts and row["surface"] == surfaces.HARD and row["phase"] != "scuff":
            contacts[-1].append(row)
    for contacts in of_soles.values():
        yield from (rows for rows in contacts if rows and rows[0]["phase"] in LANDINGS)


def _on_hard(rows: Sequence[Event], frame_rate: float, first_frame: float) -> SoundStep:
    """The sound of a contact with a hard floor, whose force is known by its peak in each phase."""
    first = rows[0]
    start = (first["frame"] - first_frame) / frame_rate
    end = start + max(first["duration_s"], 2 * CLICK)
    phases = [row for row in rows if row["phase"] in ("foot_flat", "heel_off")]
    begins = np.array([start, *((row["frame"] - first_frame) / frame_rate for row in phases), end])
    peaks = [row["peak_force_n"] for row in (first, *phases)]
    middles = (begins[:-1] + begins[1:]) / 2
    time = np.arange(start, end + SPACING, SPACING)
    force = np.interp(time, [start, *middles, end], [0.0, *peaks, 0.0])
    energy = [CLICKS.get(row["phase"], 0.0) for row in (first, *phases)]
    clicks = np.stack([begins[:-1], begins[:-1] + CLICK, energy], axis=1)
    lifted = next((end for row in rows if row["phase"] == "toe_off"), None)
    name, place = f"{first['character']}/{first['contact']}@{first['frame']}", np.array(first["position"])
    brings = {"carried": first.get("carried", ""), "film": first.get("film", 0.0)}
    return SoundStep(name, surfaces.HARD, start, lifted, time, force, clicks, 0.0, first["frame"], place, **brings)


def footsteps(steps: Sequence[SoundStep], seconds: float, recordings: Sequence[tuple[str, Array]] = ()) -> Array:
    """The sound of steps, (N, C) at `wave_file.RATE`.

    Parameters
    ----------
    steps : sequence of SoundStep
        Of as many channels each.
    seconds : float
        Length of the sound.
    recordings : sequence of (str, (K,) float array)
        An artist's own sounds, by name, instead of computed ones; those named after the surface where there are any.
    """
    channels = max((len(step.gains) for step in steps), default=1)
    sound = np.zeros((round(seconds * RATE), channels))
    last = -1
    for step in steps:
        if recordings:
            begin, heard, last = _recorded(step, recordings, last)
        else:
            begin, heard = step_sound(step)
        first = max(0, -begin)
        part = sound[begin + first : max(0, begin + len(heard))]
        part += heard[first : first + len(part), None] * np.array(step.gains)
    loudest = float(np.abs(sound).max(initial=0.0))
    return sound / loudest if loudest > 1.0 else sound


def step_sound(step: SoundStep) -> tuple[int, Array]:
    """The sound of one step: the sample at which it begins, and its samples (N,)."""
    begin = step.begin
    end = max(float(step.time[-1]), step.lifted or 0.0, begin) + TAIL
    clock = begin + np.arange(round((end - begin) * RATE)) / RATE
    voice, random = voice_of(step.surface), _random(step)
    heard = np.zeros(len(clock))
    if voice.crackle:
        heard += voice.crackle * _crackle(step, voice, random, begin, len(clock))
    heard += voice.noise * _hiss(step, voice, random, clock)
    if step.struck is not None:
        heard += voice.thump * _thump(step, voice, random, clock - begin)
    if voice.pop and step.lifted is not None:
        heard += voice.pop * _pop(step, random, clock - step.lifted, step.depth)
    if step.film:
        heard += _brought(step, voice, random, clock)
    return round(begin * RATE), LOUDNESS * heard


def voice_of(surface: str) -> Voice:
    """Voice of a surface, or of a hard floor."""
    return surfaces.HARD_VOICE if surface == surfaces.HARD else surfaces.find(surface).voice


def loudness(step: SoundStep) -> float:
    """Loudness of a step, 1 for an adult's at rest: it follows the force."""
    return float(step.force.max(initial=0.0)) / ADULT_WEIGHT


def _random(step: SoundStep) -> np.random.Generator:
    digest = hashlib.sha256(f"{step.name} {step.surface}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "big"))


def _volumes(footprint: Footprint) -> Array:
    """Newly compacted volume at each recorded frame [m³]."""
    changes = footprint.pressing
    total = np.concatenate([[0], np.cumsum(np.asarray(changes.amounts), dtype=np.int64)])
    volumes = np.diff(total[np.asarray(changes.first)]) * (QUANTUM * footprint.cell_size**2)
    return np.asarray(np.maximum(volumes, 0.0))


def micro_impacts(step: SoundStep, voice: Voice, random: np.random.Generator) -> tuple[Array, Array]:
    """Times at which ground gives way in a step [s], and the energies over the least, both (K,)."""
    volume = float(step.compacted[:, 2].sum())
    if volume <= 0:
        return np.zeros(0), np.zeros(0)
    impacts = int(np.clip(random.poisson(voice.density * volume * 1e3), FEWEST, MOST))
    at = _times(step, random.random(impacts))
    power = 1.0 - voice.gamma  # inverse of the cumulative distribution of E^-gamma from 1 to STRONGEST
    return at, (1.0 + random.random(impacts) * (STRONGEST**power - 1.0)) ** (1.0 / power)


def _crackle(step: SoundStep, voice: Voice, random: np.random.Generator, begin: float, count: int) -> Array:
    """Micro-impacts, of which all together have the energy of one at full loudness for each tenth of a second."""
    at, energy = micro_impacts(step, voice, random)
    if not len(at):
        return np.zeros(count)
    low, high = np.log(voice.crackle_band)
    pitch = np.exp(low + (high - low) * random.random(GRAINS))
    decay = np.array(voice.crackle_decay) @ np.stack([part := random.random(GRAINS), 1 - part])
    time = np.arange(round(5 * voice.crackle_decay[1] * RATE)) / RATE
    grains = np.exp(-time / decay[:, None]) * np.sin(2 * np.pi * pitch[:, None] * time)
    amplitude = np.sqrt(energy / energy.sum()) * random.choice((-1.0, 1.0), len(at))
    samples = np.rint(np.maximum(at - begin, 0.0) * RATE).astype(np.intp)[:, None] + np.arange(len(time))
    values = amplitude[:, None] * grains[random.integers(0, GRAINS, len(at))]
    heard = np.bincount(samples.ravel(), values.ravel(), minlength=count)[:count]
    return np.asarray(2.5 * loudness(step) * heard)


def _times(step: SoundStep, part: Array) -> Array:
    """Times at which parts (K,) of the compaction are done [s]: within a recorded frame, as the force rises."""
    time, rise = step.time, np.maximum(np.diff(step.force, prepend=0.0), 0.0)
    rise = rise + 0.02 * max(float(rise.max(initial=0.0)), 1e-9)
    done = np.zeros(len(time))
    for start, end, volume in step.compacted:
        inside = (time > start + 1e-9) & (time <= end + 1e-9)
        weight = np.where(inside, rise, 0.0) if inside.any() else (np.abs(time - end) <= np.abs(time - end).min()) * 1.0
        done += volume * weight / weight.sum()
    whole = np.concatenate([[0.0], np.cumsum(done)])
    edges = np.concatenate([[time[0] - (time[1] - time[0] if len(time) > 1 else 0.0)], time])
    return np.asarray(np.interp(part * whole[-1], whole, edges))


def _hiss(step: SoundStep, voice: Voice, random: np.random.Generator, clock: Array) -> Array:
    """Noise in the surface's band that follows the rate of the force."""
    count = len(clock)
    whole = min(1 << (count - 1).bit_length(), LONGEST_NOISE)  # of a power of two, spectra are fast
    spectrum = np.fft.rfft(random.standard_normal(whole))
    pitch = np.fft.rfftfreq(whole, 1 / RATE)
    low, high = voice.noise_band
    band = 1.0 / np.sqrt((1.0 + (low / np.maximum(pitch, 1.0)) ** 6) * (1.0 + (pitch / high) ** 6))
    noise = np.resize(np.fft.irfft(spectrum * band, whole), count)
    noise /= max(float(noise.std()), 1e-12)
    change = np.abs(np.gradient(step.force, step.time)) if len(step.time) > 1 else np.zeros(1)
    envelope = _lagging(np.interp(clock, step.time, change, left=change[0], right=0.0), round(SMOOTH * RATE))
    return np.asarray(0.35 * noise * envelope / LOADING_RATE)


def _lagging(values: Array, width: int) -> Array:
    """Mean over a width before each sample, taken twice: it lags, so that nothing is heard before the strike."""
    for _ in range(2):
        total = np.concatenate([np.zeros(width), np.cumsum(values)])
        values = (total[width:] - total[:-width]) / width
    return values


def _thump(step: SoundStep, voice: Voice, random: np.random.Generator, since: Array) -> Array:
    """A short low tone, as loud as the heel's force."""
    assert step.struck is not None
    strike = step.force[(step.time >= step.struck) & (step.time <= step.struck + STRIKE)]
    low, high = voice.thump_pitch
    pitch = low + (high - low) * random.random()
    fall = pitch * (since + 0.3 * THUMP_DECAY * (1 - np.exp(-since / THUMP_DECAY)))  # as the packed layer gives way
    force = float(strike.max(initial=0.0)) / ADULT_WEIGHT
    return np.asarray(force * np.exp(-since / THUMP_DECAY) * np.sin(2 * np.pi * fall))


def _brought(step: SoundStep, voice: Voice, random: np.random.Generator, clock: Array) -> Array:
    """What a film on the sole adds on a hard floor."""
    if step.carried in surfaces.GRINDING:
        return step.film * _hiss(step, voice, random, clock)
    if step.lifted is None:
        return np.zeros(len(clock))
    if step.carried in surfaces.SQUELCHING:
        return _pop(step, random, clock - step.lifted + POP_LENGTH, FULL_POP * step.film)
    low, high = SQUEAK_PITCH
    part = np.clip((clock - step.lifted) / SQUEAK + 1.0, 0.0, 1.0)
    pitch = low + (high - low) * random.random()
    phase = 2 * np.pi * pitch * SQUEAK * (part + 0.1 * part**2)  # it rises as less of the sole is down
    tone = sum(np.sin(number * phase) / number for number in (1, 2, 3))
    return np.asarray(0.3 * np.sqrt(step.film) * loudness(step) * np.sin(np.pi * part) ** 2 * tone)


def _pop(step: SoundStep, random: np.random.Generator, since: Array, depth: float) -> Array:
    """A tone whose pitch rises as the cavity closes, louder the deeper the foot was."""
    low, high = (pitch * (0.85 + 0.3 * random.random()) for pitch in POP_RISE)
    part = np.clip(since / POP_LENGTH, 0.0, 1.0)
    phase = POP_LENGTH * (low * part + (high - low) * part**3 / 3)
    shape = np.where((since >= 0) & (since < POP_LENGTH), np.sin(np.pi * part) ** 2, 0.0)
    return np.asarray(min(depth / FULL_POP, 1.0) * loudness(step) * shape * np.sin(2 * np.pi * phase))


def _recorded(step: SoundStep, recordings: Sequence[tuple[str, Array]], last: int) -> tuple[int, Array, int]:
    """A recording scaled by the force, another than the one before where there are several, and its number."""
    fitting = [number for number, (name, _) in enumerate(recordings) if step.surface in name.lower()]
    choice = fitting or list(range(len(recordings)))
    others = [number for number in choice if number != last] or choice
    number = others[int(_random(step).integers(0, len(others)))]
    loud = 0.0 if step.struck is None else min(1.0, LOUDNESS * loudness(step))
    return round(step.begin * RATE), loud * recordings[number][1], number
