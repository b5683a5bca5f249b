"""Crumbs that relief scatters about prints and those that steps throw are one population: sizes and shapes."""

import zlib
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from softground_addon.core.debris import debris, step_throws
from softground_addon.core.ground.surfaces import SURFACES
from softground_addon.core.meshing import crumbs
from softground_addon.core.record.record import BakeRecord, dump, load
from softground_addon.core.relief import amounts
from softground_addon.core.relief.layers import Around
from softground_addon.core.relief.print_relief import relief_of_print
from tests.core.relief.test_steps import MATERIALS, SPACING
from tests.core.walkers import GRAVITY, pressed, walk


def exponent(diameters, smallest, largest):
    """The a of n(d) ~ d^-a between two sizes that is most likely, and its standard deviation."""
    sizes = np.log(diameters[(diameters >= smallest) & (diameters <= largest)])

    def unlikely(a):
        return a * sizes.sum() + len(sizes) * np.log((largest ** (1 - a) - smallest ** (1 - a)) / (1 - a))

    a, step = minimize_scalar(unlikely, bounds=(1.05, 6), method="bounded").x, 1e-2
    bend = (unlikely(a + step) + unlikely(a - step) - 2 * unlikely(a)) / step**2
    return a, bend**-0.5


def baked(surface):
    """The record of a walk as a bake stores it: prints and how they throw."""
    loads = walk(steps=8)
    _, footprints = pressed(loads, MATERIALS[surface], 0.005)
    throws = step_throws.throws_of([loads], footprints, surface=surface)
    return load(dump(BakeRecord(footprints, {}, throws=throws)))


def scattered(record, surface):
    """Prints with the crumbs about each."""
    return [
        relief_of_print(
            footprint,
            amounts.of_look(surface),
            blur_sigma=MATERIALS[surface].blur_sigma,
            finest=SPACING,
            seed=zlib.crc32(bytes([number])),
        )
        for number, footprint in enumerate(record.footprints)
    ]


@pytest.mark.parametrize("surface", ["snow", "soil"])
def test_sizes_of_both_together_follow_the_one_law(surface):
    record = baked(surface)
    lying = np.concatenate(
        [2 * lattice.radius[lattice.radius > 0] for each in scattered(record, surface) for lattice in each.crumbs]
    )
    sources = debris.sources(record.throws, record.steps, surface=surface, gravity=GRAVITY)
    thrown = 2 * debris.throw(sources, surface=surface, gravity=GRAVITY, height=lambda x, _: 0 * x).radius
    smallest, largest = max(lying.min(), SURFACES[surface].thrown.sizes[0]), min(lying.max(), thrown.max())
    assert smallest < 0.004
    assert largest > 0.007
    share = np.mean((lying > smallest) & (lying < largest)), np.mean((thrown > smallest) & (thrown < largest))
    assert min(share) > 0.02
    for sizes, bounds in ((lying, (lying.min(), lying.max())), (np.append(lying, thrown), (smallest, largest))):
        a, deviation = exponent(sizes, *bounds)
        assert deviation < 0.12
        assert a == pytest.approx(crumbs.SIZE_FALL, abs=2.5 * deviation)


def test_what_lies_about_a_print_is_the_upper_side_of_what_flies():
    """Each crumb, alone, is as high at its middle as its lump is there, less what is sunk of it."""
    (step, *_) = scattered(baked("soil"), "soil")
    lumps = crumbs.lumps("soil")
    lattice = step.crumbs[-1]
    crumbs_there = list(zip(*np.nonzero(lattice.radius), strict=True))
    for crumb in crumbs_there:
        place = [np.array([at[crumb]]) for at in (lattice.x, lattice.y)]
        nothing = np.zeros(1)
        around = Around(0, *place, nothing, nothing, nothing, nothing, 0.001, 1.0)
        lump = lumps[lattice.shape[crumb]].vertices
        axis = np.linalg.norm(lump[:, :2], axis=1)
        top = lump[(axis < 0.3) & (lump[:, 2] > 0), 2]
        radius, sunk = lattice.radius[crumb], lattice.sunk[crumb]
        is_other = np.ones(lattice.radius.shape, bool)
        is_other[crumb] = False
        alone = replace(lattice, radius=np.where(is_other, 0.0, lattice.radius))
        height = alone.heights(around)[0] / radius + sunk
        assert top.min() - 0.1 < height < top.max() + 0.1
    assert len(crumbs_there) > 30


@pytest.mark.parametrize("surface", sorted(SURFACES))
def test_shapes_are_closed_and_have_the_volume_of_their_size(surface):
    for lump in crumbs.lumps(surface):
        edges = np.concatenate([lump.faces[:, [0, 1]], lump.faces[:, [1, 2]], lump.faces[:, [2, 0]]])
        assert sorted(map(tuple, edges)) == sorted(map(tuple, edges[:, ::-1]))
        assert np.linalg.det(lump.vertices[lump.faces]).sum() / 6 == pytest.approx(4 / 3 * np.pi, rel=1e-9)
        assert len(lump.vertices) - len(edges) / 2 + len(lump.faces) == 2


def test_lattices_filled_alike_would_not_follow_the_law(monkeypatch):
    """Filled in proportion to the square root of their size they do; filled alike the exponent is 3."""
    monkeypatch.setattr(crumbs, "octaves", lambda largest, _: ((largest / 2**number, 1.0) for number in range(3)))
    record = replace(baked("soil"), throws=[])
    lying = np.concatenate(
        [2 * each.radius[each.radius > 0] for item in scattered(record, "soil") for each in item.crumbs]
    )
    assert exponent(lying, lying.min(), lying.max())[0] > 2.75
