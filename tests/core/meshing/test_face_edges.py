"""Edges of faces: each once, whatever is looked at together."""

import numpy as np
import pytest

from softground_addon.core.meshing import face_edges
from softground_addon.core.meshing.face_edges import face_edges as edges_of


def torus(across, along):
    """Corners and starts of the quads of a torus, in which each vertex has two edges of its own."""
    i, j = np.meshgrid(np.arange(along), np.arange(across), indexing="ij")
    steps = ((0, 0), (0, 1), (1, 1), (1, 0))
    corners = [(i + di) % along * across + (j + dj) % across for di, dj in steps]
    return np.stack(corners, axis=-1).ravel(), np.arange(0, 4 * across * along, 4)


@pytest.mark.parametrize("at_once", [7, 100, 1 << 19])
def test_a_torus_has_two_edges_for_each_vertex_and_each_is_used_twice(monkeypatch, at_once):
    monkeypatch.setattr(face_edges, "AT_ONCE", at_once)
    corner, start = torus(9, 14)
    edges, corner_edge = edges_of(corner, start)
    assert len(edges) == 2 * 9 * 14 == len(np.unique(edges, axis=0))
    assert (np.bincount(corner_edge) == 2).all()
    ends = np.stack([corner, np.roll(corner.reshape(-1, 4), -1, axis=1).ravel()], axis=-1)
    assert (np.sort(ends, axis=1) == edges[corner_edge]).all()


def test_no_faces_have_no_edges():
    edges, corner_edge = edges_of(np.zeros(0, np.intp), np.zeros(0, np.intp))
    assert edges.shape == (0, 2)
    assert corner_edge.shape == (0,)
