"""How fine the mesh of carved ground is: as the cells around prints, coarser where only bodies carve."""

from types import SimpleNamespace

import numpy as np
import pytest

from softground_addon.core.carving.fineness import fineness
from softground_addon.core.ground.sparse_grid import Window
from softground_addon.core.numerics.cell_keys import keys_of


def footprint(window, *, touches):
    """A print or a carve that changes all cells of a window."""
    every = np.arange(window.cells, dtype=np.int32)
    changes = SimpleNamespace(cells=every)
    cells = every if touches else every[:0]
    return SimpleNamespace(
        window=window, compression=changes, rim=SimpleNamespace(cells=every[:0]), contact_cells=cells
    )


@pytest.mark.parametrize(("cell", "carved"), [(0.005, 0.01), (0.0025, 0.005), (0.01, None), (0.02, None)])
def test_ground_that_only_bodies_carve_has_vertices_1_cm_apart_or_two_cells(cell, carved):
    sole, trench = Window(0, 0, 20, 50), Window(-40, -60, 100, 200)
    prints = [footprint(sole, touches=True), footprint(trench, touches=False)]
    columns, rows = np.meshgrid(np.arange(-40, 60), np.arange(-60, 140))
    moved = np.unique(keys_of(np.stack([columns, rows], axis=-1)))
    everywhere, spacing, closer = fineness(moved, prints, cell)
    assert everywhere.touches(np.array([[-0.001, -0.001]]), np.array([[0.001, 0.001]])).all()
    if carved is None:
        assert (spacing, closer) == (cell, None)
    else:
        where, closest = closer
        assert (spacing, closest) == pytest.approx((carved, cell))
        corners = np.array([[0, 0], [19, 49], [-3, -3], [-30, -50], [50, 130]]) * cell + cell / 2
        assert where.touches(corners, corners).tolist() == [True, True, True, False, False]
        nowhere, _ = fineness(moved, prints[1:], cell)[2]
        assert not nowhere.touches(corners, corners).any()
    assert fineness(moved, prints[:1], cell)[1:] == (cell, None)
