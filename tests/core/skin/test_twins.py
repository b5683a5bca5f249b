"""Mirror images among the parts of a body, without their names."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from softground_addon.core.skin.twins import twins


def body(chance: np.random.Generator, pairs: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A body with pairs of legs beside x = 0 and a trunk with a head: points, parts, and the twin of each."""
    pieces, twin = [], []
    for number in range(pairs):
        count = int(chance.integers(20, 200))
        limb = (chance.uniform(0.2, 0.4), number * 0.5, 0.3) + chance.uniform(-1, 1, (count, 3)) * (0.05, 0.05, 0.3)
        more = limb[: int(chance.uniform(0, 0.1) * count)]  # modelled a little finer on one side
        pieces += [limb * (-1, 1, 1), np.concatenate([limb, more])]
        twin += [2 * number + 1, 2 * number]
    for middle, size in ((0.25 * pairs, (0.1, 0.25 * pairs, 0.1)), (0.5 * pairs + 0.2, (0.08, 0.2, 0.2))):
        half = (0, middle, 0.8) + chance.uniform(-1, 1, (int(chance.integers(20, 200)), 3)) * size
        twin.append(len(pieces))
        pieces.append(np.concatenate([half, half * (-1, 1, 1)]))
    part = np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces])
    return np.concatenate(pieces), part, np.array(twin)


@given(pairs=st.integers(2, 6), turned=st.booleans(), seed=st.integers(0, 999))
def test_limbs_are_the_twins_of_their_mirror_images_however_the_rest_pose_is_turned(
    pairs: int, turned: bool, seed: int
) -> None:
    chance = np.random.default_rng(seed)
    points, part, twin = body(chance, pairs)
    if turned:
        turn, _ = np.linalg.qr(chance.normal(size=(3, 3)))
        points = points @ turn.T * 40 + chance.uniform(-9, 9, 3)
    renamed = chance.permutation(len(twin))  # whatever the order of the bones
    expected = np.empty_like(twin)
    expected[renamed] = renamed[twin]
    assert twins(points, renamed[part], len(twin)).tolist() == expected.tolist()


def test_parts_of_other_sizes_are_no_twins_and_empty_ones_have_none() -> None:
    chance = np.random.default_rng(0)
    points = chance.uniform(-0.1, 0.1, (70, 3))
    points[:, 0] += np.where(np.arange(70) < 50, -1, 1)
    pairs = twins(points, np.repeat([0, 2], [50, 20]), 3)
    assert pairs.tolist() == [0, 1, 2]
