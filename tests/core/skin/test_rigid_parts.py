"""Parts of a surface that move as one, found from vertices over time alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softground_addon.core.numerics.rigid import displacement, rotation
from softground_addon.core.skin.rigid_parts import moves_as_one, rigid_motions, rigid_parts

BOX = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]) / 2
FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
FACES = FACES[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def turning(chance: np.random.Generator, poses: int) -> np.ndarray:
    """Rigid displacements that wander, from none, (F, 4, 4)."""
    turn = np.cumsum(chance.normal(0, 0.2, (poses, 3)), axis=0)
    way = np.cumsum(chance.normal(0, 0.2, (poses, 3)), axis=0)
    return displacement(rotation(turn - turn[0]), np.zeros(3), way - way[0])


def moved(motion: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ np.swapaxes(motion[:, :3, :3], 1, 2) + motion[:, None, :3, 3]


@given(boxes=st.integers(2, 12), seed=st.integers(0, 999), scale=st.sampled_from((0.01, 1.0, 100.0)))
@settings(max_examples=20, deadline=None)
def test_boxes_that_move_by_themselves_are_the_parts_at_any_size(boxes: int, seed: int, scale: float) -> None:
    chance = np.random.default_rng(seed)
    motions = [turning(chance, 8) for _ in range(boxes)]
    points = [BOX * chance.uniform(0.3, 1, 3) + (number % 4 * 1.5, number // 4 * 1.5, 0) for number in range(boxes)]
    positions = np.concatenate([moved(*each) for each in zip(motions, points, strict=True)], axis=1) * scale
    part = rigid_parts(positions, np.concatenate([FACES + 8 * number for number in range(boxes)]))
    assert part.tolist() == np.repeat(np.arange(boxes), 8).tolist()


def test_the_displacement_of_a_part_is_the_one_that_moved_it() -> None:
    motion = turning(np.random.default_rng(1), 30)
    assert rigid_motions(BOX, moved(motion, BOX)) == pytest.approx(motion, abs=1e-9)


@pytest.mark.parametrize(("apart", "count"), [(1.0, 1), (1.5, 2)])
def test_pieces_that_one_displacement_moves_are_one_part_where_they_lie_against_each_other(
    apart: float, count: int
) -> None:
    motion = turning(np.random.default_rng(2), 8)
    positions = moved(motion, np.concatenate([BOX, BOX + np.array((apart, 0, 0))]))
    assert len(np.unique(rigid_parts(positions, np.concatenate([FACES, FACES + 8])))) == count
    assert moves_as_one(positions)
    positions[-1, :8] += 0.05
    assert not moves_as_one(positions)


def test_a_limb_that_bends_at_one_row_of_its_vertices_is_two_parts() -> None:
    along = np.linspace(0, 2, 21)
    ring = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * 0.2
    points = np.array([(x, *corner) for x in along for corner in ring])
    first = (np.arange(20)[:, None] * 4 + np.arange(4)).ravel()
    around = first - first % 4 + (first + 1) % 4
    faces = np.concatenate([np.stack([first, around, around + 4], 1), np.stack([first, around + 4, first + 4], 1)])
    bend = rotation(np.linspace(0, 1, 10)[:, None] * (0, 0, 1.0))
    motion = displacement(bend, np.array((1.0, 0.1, 0.1)), np.tile((1.0, 0.1, 0.1), (10, 1)))
    still = np.tile(np.eye(4), (10, 1, 1))
    beyond = points[:, 0] > 1.05
    positions = np.where(beyond[:, None], moved(motion, points), moved(still, points))
    part = rigid_parts(positions, faces)
    assert len(np.unique(part[beyond])) == len(np.unique(part[~beyond & (points[:, 0] < 0.95)])) == 1
    assert part[0] != part[-1]
