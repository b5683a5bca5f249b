"""Contacts from the skin of made-up animals whose gait is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softground_addon.core.skin.bearing import bearing, without_glimpses
from softground_addon.core.skin.contacts import SkinContacts, find_contacts
from softground_addon.core.skin.ground_level import ground_of
from softground_addon.core.skin.merging import merged
from softground_addon.core.skin.skin_motion import PartTracks, SkinMotion, track_parts

RATE, PERIOD, FRAMES = 30.0, 30, 90
LIFT = 0.12


def animal(
    legs: int,
    *,
    duty: float,
    stride: float,
    on_the_spot: bool = False,
    leaves: int = 0,
    seed: int = 0,
    riser: float = 0.0,
) -> tuple[SkinMotion, np.ndarray]:
    """An animal 1 m tall that walks along x, its feet plates of 8 cm, and when each foot stands (F, legs).

    `leaves` more parts lie inside of feet, as the leaf bones of imported rigs do. Each foot of two lands a `riser`
    higher than the other one stands.
    """
    chance = np.random.default_rng(seed)
    time = np.arange(FRAMES)[:, None] / PERIOD + np.arange(legs) * (1 / 2 if legs == 2 else 0.618) + 0.1
    phase = time % 1.0
    stands = phase < duty
    swing = np.clip((phase - duty) / (1 - duty), 0, 1)
    ahead = (np.floor(time) + (swing - np.sin(2 * np.pi * swing) / (2 * np.pi))) * stride
    if on_the_spot:
        ahead = ahead - time * stride
    stair = np.floor(time) + np.clip(2 * swing, 0, 1) if riser > 0 else np.floor(time) + np.clip(2 * swing - 1, 0, 1)
    lift = LIFT * np.sin(np.pi * swing) + riser * (2 * stair - np.arange(legs))
    plate = np.stack(np.meshgrid(np.linspace(-0.04, 0.04, 5), np.linspace(-0.02, 0.02, 3), [0.0, 0.03]), axis=-1)
    plate = plate.reshape(-1, 3)
    root = np.stack([np.arange(legs) // 2 * 0.4, np.where(np.arange(legs) % 2, -0.15, 0.15)], axis=-1)
    feet = np.zeros((FRAMES, legs, len(plate), 3))
    feet[..., :2] = root[:, None]
    feet[..., 0] += ahead[..., None]
    feet[..., 2] += lift[..., None]
    feet += plate
    body = chance.uniform((0.2, -0.2, 0.6), (0.6, 0.2, 1.0), (20, 3))
    trunk = np.broadcast_to(body, (FRAMES, 20, 3)).copy()
    trunk[:, :, 0] += (0.0 if on_the_spot else 1.0) * np.arange(FRAMES)[:, None] / PERIOD * stride
    trunk[:, :, 2] += 2 * riser * np.arange(FRAMES)[:, None] / PERIOD
    display_meshes = chance.integers(0, legs, leaves)
    points = [*np.moveaxis(feet, 1, 0), *(feet[:, leg, :4] + (0, 0, 0.001) for leg in display_meshes), trunk]
    part = np.repeat(np.arange(len(points)), [piece.shape[1] for piece in points])
    links = np.zeros((len(points), len(points)), dtype=bool)
    for number, leg in enumerate(display_meshes):
        links[legs + number, leg] = links[leg, legs + number] = True
    positions = np.concatenate(points, axis=1)
    height = float(np.median(np.ptp(positions[..., 2], axis=1)))
    return SkinMotion(positions, part, links, RATE, height), stands


def changed(skin: SkinMotion, *, scale: float, turn: float, lift: float) -> SkinMotion:
    """The same animal in another unit, direction and height."""
    cos, sin = np.cos(turn), np.sin(turn)
    turned = skin.positions @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) + (0, 0, lift)
    return SkinMotion(turned * scale, skin.part, skin.links, skin.rate, skin.height * scale)


def assert_gait(contacts: SkinContacts, stands: np.ndarray) -> None:
    """Every foot is a contact, and nothing else; it bears when it stands, within two frames at each end."""
    legs = stands.shape[1]
    assert sorted(set(contacts.group[:legs])) == list(range(legs)) == list(range(contacts.bears.shape[1]))
    assert contacts.group[-1] == -1, "the trunk does not touch the ground"
    for leg in range(legs):
        bears = contacts.bears[:, contacts.group[leg]]
        wide = np.convolve(stands[:, leg], np.ones(5), "same") > 0
        narrow = np.convolve(~stands[:, leg], np.ones(5), "same") == 0
        inside = slice(2, -2)
        assert (bears <= wide)[inside].all()
        assert (bears >= narrow)[inside].all()


@given(
    legs=st.integers(2, 8),
    duty=st.floats(0.5, 0.75),
    stride=st.floats(0.3, 0.9),
    on_the_spot=st.booleans(),
    leaves=st.integers(0, 4),
    scale=st.floats(-3, 3).map(lambda power: 10.0**power),
    turn=st.floats(0, 6.28),
    lift=st.floats(-2, 2),
    seed=st.integers(0, 99),
)
def test_the_gait_of_an_animal_is_found_in_its_skin(
    legs: int,
    duty: float,
    stride: float,
    on_the_spot: bool,
    leaves: int,
    scale: float,
    turn: float,
    lift: float,
    seed: int,
) -> None:
    skin, stands = animal(legs, duty=duty, stride=stride, on_the_spot=on_the_spot, leaves=leaves, seed=seed)
    contacts = find_contacts(changed(skin, scale=scale, turn=turn, lift=lift))
    assert contacts.level / scale == pytest.approx(lift, abs=0.005)
    assert_gait(contacts, stands)
    speed = stride * RATE / PERIOD if on_the_spot else 0.0
    assert np.linalg.norm(contacts.drift) / scale == pytest.approx(speed, abs=0.1 * speed + 0.01)


@given(
    duty=st.floats(0.55, 0.7),
    stride=st.floats(0.4, 0.9),
    riser=st.floats(0.05, 0.25),
    down=st.booleans(),
    scale=st.floats(-3, 3).map(lambda power: 10.0**power),
    turn=st.floats(0, 6.28),
)
def test_the_gait_is_found_on_stairs_and_how_high_each_foot_stands(
    duty: float, stride: float, riser: float, down: bool, scale: float, turn: float
) -> None:
    riser = -riser if down else riser
    skin, stands = animal(2, duty=duty, stride=stride, riser=riser)
    contacts = find_contacts(changed(skin, scale=scale, turn=turn, lift=0.3))
    assert_gait(contacts, stands)
    for leg in range(2):
        bears = contacts.bears[:, contacts.group[leg]]
        sole = skin.positions[:, skin.part == leg, 2].min(axis=1) + 0.3
        assert contacts.floor[bears, contacts.group[leg]] / scale == pytest.approx(sole[bears], abs=0.02)


@given(
    legs=st.integers(2, 8),
    duty=st.floats(0.3, 0.7),
    on_the_spot=st.booleans(),
    every=st.sampled_from([1, 2]),
    first=st.integers(0, 40),
    length=st.integers(40, 50),
    share=st.floats(0.4, 1.0),
    noise=st.floats(0, 2e-4),
    seed=st.integers(0, 99),
)
def test_the_gait_is_found_at_other_frame_rates_in_parts_of_the_shot_and_in_coarse_or_rough_skin(
    legs: int,
    duty: float,
    on_the_spot: bool,
    every: int,
    first: int,
    length: int,
    share: float,
    noise: float,
    seed: int,
) -> None:
    skin, stands = animal(legs, duty=duty, stride=0.6, on_the_spot=on_the_spot)
    chance, seen = np.random.default_rng(seed), slice(first, first + length, every)
    chosen = chance.random(len(skin.part)) < share
    chosen |= np.diff(skin.part, prepend=-1) > 0  # of each part at least a point of its underside
    positions = skin.positions[seen][:, chosen]
    positions = positions + chance.normal(0, noise * skin.height, positions.shape)
    contacts = find_contacts(SkinMotion(positions, skin.part[chosen], skin.links, RATE / every, skin.height))
    speed = 0.6 * RATE / PERIOD if on_the_spot else 0.0
    assert contacts.level == pytest.approx(0.0, abs=0.005 * skin.height)
    assert np.linalg.norm(contacts.drift) == pytest.approx(speed, abs=0.1 * speed + 0.01)
    assert_gait(contacts, stands[seen])


def with_limb(skin: SkinMotion, height: np.ndarray, twin: np.ndarray) -> SkinMotion:
    """With one more part, a plate beside the animal at a height (F,) [m]."""
    plate = np.zeros((len(height), 9, 3))
    plate[..., :2] = np.stack(np.meshgrid([-0.02, 0.0, 0.02], [0.58, 0.6, 0.62]), axis=-1).reshape(-1, 2)
    plate[..., 2] = height[:, None]
    positions = np.concatenate([skin.positions, plate], axis=1)
    part = np.append(skin.part, np.full(9, skin.part.max() + 1))
    links = np.pad(skin.links, (0, 1)) if skin.links is not None else None
    return SkinMotion(positions, part, links, skin.rate, skin.height, twin)


@pytest.mark.parametrize("seen", [slice(None), slice(18, 72), slice(0, None, 2), slice(1, None, 2), slice(30, 60)])
def test_a_hand_that_dips_to_the_ground_is_no_contact_where_its_twin_is_none(seen: slice) -> None:
    skin, stands = animal(2, duty=0.3, stride=0.6)
    landed = np.flatnonzero(stands[:, 0] & (np.arange(FRAMES) > 35))[0]
    dips = np.abs(np.arange(FRAMES) - landed - 4) < 3
    feet = np.array([1, 0])
    skin = with_limb(skin, np.where(dips, 0.0, 0.4), np.array([*feet, 2, -1]))  # the other hand is always high
    contacts = find_contacts(
        SkinMotion(skin.positions[seen], skin.part, skin.links, skin.rate / (seen.step or 1), 1.0, skin.twin)
    )
    assert sorted(contacts.group) == [-1, -1, 0, 1]
    assert (contacts.group[:2] >= 0).all()


@pytest.mark.parametrize("seen", [slice(None), slice(18, 72), slice(0, None, 2), slice(1, None, 2)])
def test_a_foot_that_only_brushes_the_ground_is_a_contact_beside_its_twin(seen: slice) -> None:
    skin, _ = animal(1, duty=0.999, stride=0.0)
    kicks = np.abs(np.arange(FRAMES) - 40) > 2
    for twin, contacts in ((np.array([2, 1, 0]), 2), (np.array([0, 1, 2]), 1)):  # without one, it is a brush
        both = with_limb(skin, np.where(kicks, 0.3, 0.0), twin)
        measured = find_contacts(
            SkinMotion(both.positions[seen], both.part, both.links, both.rate / (seen.step or 1), 1.0, twin)
        )
        assert measured.bears.shape[1] == contacts
        assert measured.bears[:, measured.group[0]].all()


def test_a_foot_that_kicks_and_stands_still_for_a_moment_is_a_contact() -> None:
    """It is seldom on the ground, as a brush, but moves only while it is in the air."""
    skin, _ = animal(1, duty=0.999, stride=0.0)
    away = np.clip(np.abs(np.arange(FRAMES) - 40) - 2, 0, 12)
    for drags, contacts in ((0.0, 2), (0.02, 1)):
        kicking = with_limb(skin, 0.02 * away, np.array([0, 1, 2]))
        kicking.positions[:, kicking.part == 2, 0] += (0.1 * away + drags * np.arange(FRAMES))[:, None]
        seen = find_contacts(kicking)
        assert seen.bears.shape[1] == contacts


@pytest.mark.parametrize("on_the_spot", [False, True])
def test_contacts_stay_when_only_the_end_of_the_shot_moves(on_the_spot: bool) -> None:
    skin, _ = animal(2, duty=0.6, stride=0.6, on_the_spot=on_the_spot)
    whole = find_contacts(skin)
    for end in range(45, FRAMES):
        contacts = find_contacts(SkinMotion(skin.positions[:end], skin.part, skin.links, skin.rate, skin.height))
        # The speed of the last frame is known from one side alone.
        assert (contacts.bears == whole.bears[:end])[:-1].all(), end


@pytest.mark.parametrize("seen", [1, 2, 3])
def test_a_foot_that_comes_down_as_the_shot_ends_bears_once_two_frames_show_it(seen: int) -> None:
    skin, stands = animal(2, duty=0.5, stride=0.6)
    end = next(frame for frame in range(50, FRAMES) if stands[frame, 0] and not stands[frame - 1, 0]) + seen
    contacts = find_contacts(SkinMotion(skin.positions[:end], skin.part, skin.links, skin.rate, skin.height))
    assert contacts.bears[-1, contacts.group[0]] == (seen > 1)


@pytest.mark.parametrize("pace", [0.05, 0.4])
@pytest.mark.parametrize("rate", [24, 60])
def test_the_last_moments_show_a_contact_where_the_foot_rests_in_them(pace: float, rate: int) -> None:
    time = np.arange(round(1.25 * rate)) / rate
    ends, stands = time > time[-1] - 0.05, (time > 0.3) & (time < 0.8)
    low = np.where(ends, pace * (time[-1] - time), np.where(stands, 0.0, 0.1))[:, None]
    rise = np.where(ends, pace, np.where(stands, 0.0, 2.0))[:, None]
    still = np.zeros((2, len(time), 1, 2))
    tracks = PartTracks(low, still[0], rise, still, 0.5, rate)
    bears = bearing(tracks, 0.0, np.zeros(2))
    assert bears[ends | stands].all()
    seen = without_glimpses(bears, tracks)
    assert seen[stands].all()
    assert seen[ends].all() == seen[ends].any() == (pace < 0.15)
    only = bears & ends[:, None]  # of a foot that shows nothing else
    assert (without_glimpses(only, tracks) == only).all()


@pytest.mark.parametrize("ends", [slice(0, 2), slice(-2, None)])
def test_a_loop_that_begins_or_ends_in_mid_step_shows_no_step_in_that_moment(ends: slice) -> None:
    """The last pose is the first: a foot that stands over the seam is seen to rest on one side of it alone."""
    low = np.full(26, 0.2)
    low[:5] = 0.001
    low[-2:] = 0.008, 0.001
    low = low[::-1] if ends.start == 0 else low
    around = np.concatenate([low[-2:-1], low, low[1:2]])
    rise = np.minimum(*np.abs([low - around[:-2], around[2:] - low])) * 24
    still = np.zeros((2, 26, 1, 2))
    tracks = PartTracks(low[:, None], still[0], rise[:, None], still, 0.25, 24.0, loops=True)
    seen = without_glimpses(bearing(tracks, 0.0, np.zeros(2)), tracks)[:, 0]
    assert seen.sum() == 5
    assert not seen[ends].any()


def run_on_the_spot(stance: int, rest: np.ndarray, pace: float, base: float = 0.0) -> PartTracks:
    """One foot over 60 frames that stands `stance` of 10 on a belt of 2 H/s, and is `rest` high in the others, as calm.

    From frame 40 on it is `base` higher.
    """
    stands = np.arange(60) % 10 < stance
    low = np.tile(np.concatenate([np.zeros(stance), rest]), 6)[:, None]
    low[40:] += base
    ways = np.zeros((2, 60, 1, 2))
    ways[..., 0, 0] = np.where(stands, 2.0, pace)
    return PartTracks(low, ways[0], np.zeros((60, 1)), ways, 0.3, 24.0)


@pytest.mark.parametrize(("start", "ground"), [((0.0, 0.0), 0.0), ((0.0, 0.3), 0.05), ((0.4, 0.0), 0.05)])
def test_the_ground_is_the_floor_of_the_world_where_both_feet_stand_on_it_as_the_shot_begins(
    start: tuple[float, float], ground: float
) -> None:
    """A kick whose standing foot hovers while the other one is in the air, as in cycles that nobody corrected."""
    low = np.zeros((24, 2))
    low[4:18, 0], low[4:18, 1] = 0.4, 0.05
    low[0] = start
    rise = np.where(low == 0.4, 1.0, 0.0)
    tracks = PartTracks(low, np.zeros((24, 2, 2)), rise, np.zeros((2, 24, 2, 2)), 0.15, 24.0)
    assert ground_of(tracks)[0] == pytest.approx(ground, abs=0.004)


@pytest.mark.parametrize("base", [0.0, -0.3])
def test_the_ground_moves_as_feet_do_that_stand_on_it_not_as_those_of_a_flight(base: float) -> None:
    hangs = 0.04 + 0.04 * np.sin(np.linspace(0, np.pi, 7))
    level, drift = ground_of(run_on_the_spot(3, hangs, -0.6, base))
    assert min(abs(level), abs(level - base)) < 0.004
    assert drift.tolist() == pytest.approx([2.0, 0.0])


def run_of(rate: float, sinks: float) -> tuple[SkinMotion, np.ndarray]:
    """A body 1 m tall that runs on the spot for a second and a half, and when each foot stands.

    Its second foot stands so much lower than the first [m].
    """
    time = np.arange(round(1.5 * rate)) / rate
    phase = (time[:, None] / 0.7 + (0.13, 0.63)) % 1.0
    stands, swing = phase < 0.3, np.clip((phase - 0.3) / 0.7, 0.0, 1.0)
    ahead = np.where(stands, 0.25 - phase / 0.6, -0.25 + swing - np.sin(2 * np.pi * swing) / (2 * np.pi) / 2)
    height = 0.3 * np.sin(np.pi * swing) ** 2 - (0.0, sinks)
    plate = np.stack(np.meshgrid([-0.06, 0.0, 0.06], [-0.03, 0.03], [0.0, 0.04]), axis=-1).reshape(-1, 3)
    feet = np.stack([ahead / 2, np.broadcast_to((-0.1, 0.1), ahead.shape), height], axis=-1)[:, :, None] + plate
    trunk = np.broadcast_to(
        np.random.default_rng(0).uniform((-0.1, -0.1, 0.6), (0.1, 0.1, 1.0), (20, 3)), (len(time), 20, 3)
    )
    positions = np.concatenate([feet[:, 0], feet[:, 1], trunk], axis=1)
    part = np.repeat([0, 1, 2], [len(plate), len(plate), 20])
    height_of_body = float(np.median(np.ptp(positions[..., 2], axis=1)))
    return SkinMotion(positions, part, np.zeros((3, 3), dtype=bool), rate, height_of_body), stands


@pytest.mark.parametrize("rate", [24.0, 25.0, 30.0, 48.0, 60.0, 120.0])
@pytest.mark.parametrize("sinks", [-0.06, -0.03, 0.0, 0.03, 0.06])
def test_the_ground_of_a_run_is_one_at_every_frame_rate_and_both_feet_print(rate: float, sinks: float) -> None:
    """Of feet that land alone, the higher one tells it: the other one sinks in."""
    skin, stands = run_of(rate, sinks)
    contacts = find_contacts(skin)
    assert contacts.level == pytest.approx(max(-sinks, 0.0), abs=0.012)
    for foot in range(2):
        seen = contacts.bears[:, contacts.group[foot]]
        assert contacts.group[foot] >= 0
        assert seen[stands[:, foot]].mean() > 0.7
        assert not seen[~np.convolve(stands[:, foot], np.ones(5), "same").astype(bool)].any()


@pytest.mark.parametrize("frames", [38, 49])
def test_who_stands_on_a_box_and_then_on_the_floor_stands_on_the_floor(frames: int) -> None:
    """Skin that rests far below a level speaks against it, even where it rests there for less time."""
    skin, _ = animal(1, duty=0.999, stride=0.0)
    skin.positions[:frames, :, 2] += 0.5
    assert find_contacts(skin).level == pytest.approx(0.0, abs=0.005)


@pytest.mark.parametrize(
    ("arms", "level"), [([-0.1], 0.0), ([-0.1] * 4, -0.1), ([-0.06, -0.06, -0.09, -0.09, -0.14, -0.14], 0.0)]
)
def test_who_sits_on_the_floor_sits_there_though_arms_hang_through_it(arms: list[float], level: float) -> None:
    """Three parts are on the world's floor all the time; more that lie at one height below it are the ground."""
    low = np.tile([0.0] * 3 + arms, (48, 1))
    still = np.zeros((48, 3 + len(arms), 2))
    tracks = PartTracks(low, still, np.zeros(low.shape), np.stack([still, still]), calm=0.15, rate=24.0)
    assert ground_of(tracks)[0] == pytest.approx(level, abs=0.004)


def test_the_ground_is_not_where_feet_dip_below_it_calmly_in_swing() -> None:
    dips = -0.05 - 0.03 * np.sin(np.linspace(0, np.pi, 4))
    level, drift = ground_of(run_on_the_spot(6, dips, -1.2))
    assert level == pytest.approx(0.0, abs=0.004)
    assert drift.tolist() == pytest.approx([2.0, 0.0])


@pytest.mark.parametrize("seconds", [0.04, 0.2])
def test_what_stands_still_bears_though_the_ground_moves_at_other_times(seconds: float) -> None:
    time = np.arange(72) / 48
    stands, walks = time < seconds, (time > 0.5) & (time < 1.2)
    low = np.stack([np.where(stands | walks, 0.0, 0.1), np.where(walks, 0.1, 0.0)], axis=-1)
    ways = np.zeros((2, 72, 2, 2))
    ways[..., 0] = np.where(low > 0, -2.0, 2.0)  # the other foot walks while this one does not
    ways[:, stands, 0, 0] = 0.0
    tracks = PartTracks(low, ways[0], np.where(low > 0, 1.0, 0.0), ways, 0.3, 48.0)
    bears = bearing(tracks, 0.0, np.array([2.0, 0.0]))[:, 0]
    assert bears[walks].all()
    assert bears[stands].all() == (seconds > 0.1)
    assert not bears[~stands & ~walks].any()


def test_a_toe_that_dips_through_the_ground_in_swing_leaves_the_ground_where_it_is() -> None:
    skin, stands = animal(2, duty=0.6, stride=0.6)
    positions = skin.positions.copy()
    toe = skin.part == 0
    dips = ~stands[:, 0]
    positions[np.ix_(dips, toe)] -= (0, 0, 0.15)
    contacts = find_contacts(SkinMotion(positions, skin.part, skin.links, skin.rate, skin.height))
    assert contacts.level == pytest.approx(0.0, abs=0.006)
    assert_gait(contacts, stands)


def test_a_foot_that_stands_in_two_pieces_is_one_contact() -> None:
    skin, _ = animal(2, duty=0.6, stride=0.6)
    heel = (skin.part == 0) & (np.arange(len(skin.part)) < 16)
    part = np.where(heel, skin.part.max() + 1, skin.part)
    order = np.argsort(part, kind="stable")
    links = np.pad(skin.links, (0, 1))
    links[0, -1] = links[-1, 0] = True
    contacts = find_contacts(SkinMotion(skin.positions[:, order], part[order], links, skin.rate, skin.height))
    assert contacts.group[0] == contacts.group[-1]
    assert contacts.bears.shape[1] == 2


def test_pieces_on_different_branches_that_move_alike_are_one_contact() -> None:
    """A sole on a bone for inverse kinematics, and the end of the leg that follows it; the other foot is not of it."""
    skin, _ = animal(2, duty=0.6, stride=0.6)
    heel = (skin.part == 0) & (np.arange(len(skin.part)) < 16)
    part = np.where(heel, skin.part.max() + 1, skin.part)
    order = np.argsort(part, kind="stable")
    links = np.zeros((4, 4), dtype=bool)
    beside = np.ones((4, 4), dtype=bool)  # even the feet lie side by side
    twins = np.array([1, 0, 2, 3]), np.array([1, -1, 2, 3])  # the right foot's twin may not be followed
    for twin, against, contacts in ((twins[0], beside, 2), (twins[1], beside, 2), (twins[0], None, 3)):
        skin_of_feet = SkinMotion(skin.positions[:, order], part[order], links, skin.rate, skin.height, twin, against)
        seen = find_contacts(skin_of_feet)
        assert seen.bears.shape[1] == contacts
        assert (seen.group[0] == seen.group[3]) == (against is not None)


def test_what_is_one_foot_on_the_left_is_one_on_the_right() -> None:
    """The right heel mostly bears when its toes have left, as no left one does."""
    bears = np.zeros((40, 4), dtype=bool)  # toes and heel of the left foot, and of the right one
    bears[0:12, 0] = bears[0:10, 1] = bears[20:32, 2] = bears[30:36, 3] = True
    links = np.zeros((4, 4), dtype=bool)
    links[0, 1] = links[1, 0] = links[2, 3] = links[3, 2] = True
    places, still = np.zeros((40, 4, 2)), np.zeros((40, 4))
    tracks = PartTracks(still, places, still, np.zeros((2, 40, 4, 2)), 0.15, 24.0)
    alone = merged(tracks, bears, links, np.zeros_like(links))
    assert alone[0] == alone[1]
    assert alone[2] != alone[3]
    both = merged(tracks, bears, links, np.zeros_like(links), np.array([2, 3, 0, 1]))
    assert both[0] == both[1] != both[2] == both[3]


def test_skin_that_never_comes_to_rest_has_no_contact() -> None:
    rise = np.arange(30.0)[:, None, None] * (0, 0, 0.1)
    points = np.random.default_rng(0).uniform(0, 1, (1, 40, 3)) + rise
    skin = SkinMotion(points, np.repeat([0, 1], 20), np.zeros((2, 2), dtype=bool), 30.0, 1.0)
    assert find_contacts(skin).bears.shape == (30, 0)


def test_contacts_are_the_same_in_whatever_order_the_groups_are_numbered() -> None:
    skin, _ = animal(3, duty=0.6, stride=0.6)
    groups = np.arange(skin.part.max() + 1)
    for order in (groups, groups[::-1], np.roll(groups, 1)):
        tracks, parts = track_parts(skin, order), track_parts(skin)
        assert (tracks.low[:, order] == parts.low).all()
        assert (tracks.ways[:, :, order] == parts.ways).all()


def test_what_is_near_the_ground_and_still_comes_down_has_not_landed() -> None:
    low = np.array([0.08, 0.05, 0.03, 0.013, 0.003, 0.0, -0.002, 0.001, 0.027, 0.05])
    rise = np.minimum(np.abs(np.diff(low, prepend=0.11)), np.abs(np.diff(low, append=0.08))) * 24
    still = np.zeros((2, len(low), 1, 2))
    tracks = PartTracks(low[:, None], still[0], rise[:, None], still, 0.35, 24.0)
    assert np.flatnonzero(bearing(tracks, 0.0, np.zeros(2))[:, 0]).tolist() == [4, 5, 6, 7]


@pytest.mark.parametrize(("apart", "level"), [(0.006, -0.003), (0.012, -0.006)])
def test_the_ground_lies_between_feet_that_stand_at_different_heights(apart: float, level: float) -> None:
    skin, stands = animal(2, duty=0.6, stride=0.6)
    skin.positions[:, skin.part == 1, 2] -= apart
    contacts = find_contacts(skin)
    assert contacts.level == pytest.approx(level, abs=0.001)
    assert_gait(contacts, stands)


@pytest.mark.parametrize("rate", [24.0, 60.0])
def test_what_is_near_the_ground_and_goes_up_has_left(rate: float) -> None:
    """A foot that stands for a quarter of a second and then rises faster and faster."""
    time = np.arange(round(0.6 * rate)) / rate
    low = np.maximum(time - 0.25, 0.0) ** 2 * 1.6
    rise = np.minimum(np.abs(np.diff(low, prepend=0.0)), np.abs(np.diff(low, append=1.0))) * rate
    still = np.zeros((2, len(low), 1, 2))
    tracks = PartTracks(low[:, None], still[0], rise[:, None], still, 0.35, rate)
    bears = bearing(tracks, 0.0, np.zeros(2))[:, 0]
    assert bears[low == 0].all()
    assert not bears[low > 0.0075].any()


def test_a_foot_that_slides_on_from_one_rest_to_the_next_has_not_left_the_ground() -> None:
    frames = np.arange(60)
    lifted = (frames >= 40) & (frames < 50)
    low = np.stack([np.where(lifted, 0.05, 0.0), np.where(frames < 10, 0.05, 0.0)], axis=-1)
    rise = np.abs(np.gradient(low, axis=0)) * 24
    speed = np.stack([1 - np.cos(2 * np.pi * frames / 40), np.zeros(60)], axis=-1)  # eased between its keys
    ways = np.zeros((2, 60, 2, 2))
    ways[..., 0] = speed
    tracks = PartTracks(low, np.zeros((60, 2, 2)), rise, ways, 0.3, 24.0)
    bears = bearing(tracks, 0.0, np.zeros(2))[:, 0]
    assert bears[:39].all()
    assert not bears[41:49].any()
    raised = PartTracks(np.add(low, (0.01, 0.0)), tracks.place, rise, ways, 0.3, 24.0)
    assert not bearing(raised, 0.0, np.zeros(2))[15:25, 0].any()


@pytest.mark.parametrize("lifted", [0.0, 0.05])
def test_a_heel_that_dips_through_the_ground_bears_on_whichever_of_its_skin_is_there(lifted: float) -> None:
    """What is at the ground's level is one vertex now, another one then, with a jump of speed in between."""
    rate, frames = 60.0, np.arange(60)
    stands, jumps = (frames >= 20) & (frames < 40), (frames == 21) | (frames == 24)
    low = np.where(stands, 0.0, 0.1) + lifted * jumps
    rise = np.where(stands, 0.05, 2.0) + jumps
    still = np.zeros((2, 60, 1, 2))
    tracks = PartTracks(low[:, None], still[0], rise[:, None], still, 0.3, rate)
    bears = bearing(tracks, 0.0, np.zeros(2))[:, 0]
    assert not bears[~stands].any()
    assert bears[25:40].all()
    assert bears[20:25].all() == (lifted == 0)


@pytest.mark.parametrize("loops", [False, True])
def test_what_bears_at_the_end_of_a_loop_bears_on_at_its_beginning(loops: bool) -> None:
    """A foot that is too fast at first to touch, not too fast to stay, beside one that stands on the belt."""
    foot = np.repeat([0.0, 0.06, 0.0], [3, 7, 3])
    low = np.stack([foot, np.zeros(13)], axis=-1)
    ways = np.zeros((2, 13, 2, 2))
    ways[..., 0] = np.where(low > 0, -8.0, 2.0)
    ways[:, :3, 0, 0] = 0.2
    tracks = PartTracks(low, ways[0], np.where(low > 0, 2.0, 0.0), ways, 0.3, 24.0, loops)
    bears = bearing(tracks, 0.0, np.array([2.0, 0.0]))[:, 0]
    assert bears[-3:].all()
    assert bears[:3].all() == bears[:3].any() == loops
