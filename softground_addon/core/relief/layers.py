"""Layers of a print's relief: each adds heights, from a few amounts that are typical of a ground.

Lengths of a layer are millimetres. A layer with no amounts is off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array
from ..numerics.interpolation import smooth_step
from .lattice_noise import Cells, cells, fractal, noise, uniform

MM = 1e-3


@dataclass(frozen=True)
class Around:
    """Places around one print, all (N,) arrays.

    Attributes
    ----------
    seed : int
        The print's own.
    x, y : array
        World place [m].
    foot_x, foot_y : array
        The nearest place on the outline [m].
    inward : array
        Distance to the broken outline, positive inside [m].
    pressed : array
        From 0 outside the broken wall to 1 inside.
    finest : float
        Least size that the ground shows [m].
    fineness : float
        See `PrintShape`.
    """

    seed: int
    x: Array
    y: Array
    foot_x: Array
    foot_y: Array
    inward: Array
    pressed: Array
    finest: float
    fineness: float

    def length(self, millimetres: float) -> float:
        """A length of the ground's grain at this print [m]."""
        return millimetres * MM * self.fineness

    def noise(self, number: int, size: float) -> Array:
        """Noise of a layer's own, of a size [mm]; nothing where that is too fine to be shown."""
        scale = self.length(size)
        return noise(self.seed + number, scale, self.x, self.y) if scale >= self.finest else np.zeros(len(self.x))

    def near(self, width: float) -> Array:
        """Nearness from 1 at the outline down to 0, about e^(-|d| / width) [mm]."""
        part = np.maximum(1.0 - np.abs(self.inward) / (4.0 * self.length(width)), 0.0)
        return np.asarray(part**3)

    def at(self, middle: float, spread: float) -> Array:
        """1 at a distance to the outline, down to 0 some way around it [mm]."""
        part = (self.inward - self.length(middle)) / (2.5 * self.length(spread))
        return np.asarray(np.maximum(1.0 - part * part, 0.0) ** 2)

    def patches(self, number: int, size: float, share: float = 0.5) -> Array:
        """0 and 1 in patches of a size [mm], with soft borders; 1 over about a share of the ground."""
        return smooth_step((self.noise(number, size) + 2.2 * (share - 0.5)) * 2.0 + 0.5)

    def across(self, number: int, size: float, stretch: float) -> Array:
        """Noise of a size along the outline [mm], so many times longer across it."""
        scale = self.length(size)
        if scale < self.finest:
            return np.zeros(len(self.x))
        x = self.foot_x + (self.x - self.foot_x) / stretch
        y = self.foot_y + (self.y - self.foot_y) / stretch
        return noise(self.seed + number, scale, x, y)


@dataclass(frozen=True)
class Edge:
    """Unevenness about the outline: `amount` high, of a `size`, out to about a `width` from it."""

    size: float
    amount: float
    octaves: int = 1
    gain: float = 0.6
    width: float = 12.0

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        size = around.length(self.size)
        bumps = fractal(around.seed + 101, size, self.octaves, self.gain, around.x, around.y, finest=around.finest)
        return bumps * around.near(self.width) * (1.0 - 0.5 * around.pressed) * around.length(self.amount)


@dataclass(frozen=True)
class Lumps:
    """Lumps of a `size` around the print, up to `height`, out to a `reach`."""

    size: float
    height: float
    reach: float = 45.0

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        zone = smooth_step(1.0 + around.inward / around.length(self.reach)) * (1.0 - around.pressed)
        bumps = np.maximum(around.noise(111, self.size), 0.0) + 0.35 * np.maximum(around.noise(112, self.size / 2), 0.0)
        return bumps * zone * around.length(self.height) / 1.8


@dataclass(frozen=True)
class Floor:
    """Unevenness of the floor: `amount` high, of a `size`."""

    size: float
    amount: float

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        bumps = around.noise(121, self.size) + 0.4 * around.noise(122, self.size / 2.6)
        return bumps * around.pressed * around.length(self.amount)


@dataclass(frozen=True)
class Apron:
    """Crumbs off the wall, `at` a distance inside the outline and some `spread` around it, in `patches`."""

    at: float
    spread: float
    height: float
    patches: float

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        rough = 0.7 + 0.35 * around.noise(131, 7.0) + 0.2 * around.noise(132, 3.5)
        cover = around.at(self.at, self.spread) * around.patches(133, self.patches)
        return cover * np.maximum(rough, 0.0) * around.length(self.height)


@dataclass(frozen=True)
class Streaks:
    """Lines down the wall: of a `size` along the outline, so many times longer (`stretch`) across it."""

    size: float
    stretch: float
    amount: float
    outside: float
    inside: float

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        middle, half = (self.inside - self.outside) / 2, (self.inside + self.outside) / 2
        part = np.maximum(1.0 - ((around.inward - around.length(middle)) / around.length(half)) ** 2, 0.0)
        lines = around.across(141, self.size, self.stretch) + 0.8 * around.across(142, 2.1 * self.size, self.stretch)
        return lines * part * around.length(self.amount)


@dataclass(frozen=True)
class Fans:
    """Slides off the wall, at its foot as fans of a `width`, out to a `reach` inside the outline."""

    width: float
    reach: float
    height: float

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        share = around.inward / around.length(self.reach)
        body = smooth_step(3.0 * share) * smooth_step(2.0 - 2.0 * share)
        return np.maximum(around.across(151, self.width, 4.0), 0.0) * body * around.length(self.height)


@dataclass(frozen=True)
class Lip:
    """A lip that the lifting sole has drawn up, along a `share` of the outline."""

    at: float
    spread: float
    height: float
    share: float

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        where = around.patches(161, 42.0, self.share) * (0.65 + 0.35 * around.across(162, 9.0, 5.0))
        return around.at(self.at, self.spread) * np.maximum(where, 0.0) * around.length(self.height)


@dataclass(frozen=True)
class Cracks:
    """Cracks around the print, in plates of a `size` that are tilted and lifted, out to a `reach`, in `patches`."""

    size: float
    reach: float
    narrow: float
    wide: float
    depth: float
    patches: float
    tilt: float = 0.15
    lowest: float = -1.0
    highest: float = 2.4

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        size = around.length(self.size)
        out = np.maximum(-around.inward, 0.0) / around.length(self.reach)
        zone = np.maximum(1.0 - 0.35 * out * out, 0.0) ** 2 * smooth_step(1.3 - 0.4 * out)
        zone = zone * around.patches(171, self.patches, 0.62) * (1.0 - around.pressed)
        x, y = (
            place + sum(amount * MM * around.noise(number + 2 * octave, scale) for octave, scale, amount in _BENT)
            for place, number in ((around.x, 172), (around.y, 173))
        )
        plates = cells(around.seed + 178, size, x, y)
        width = (self.wide + (self.narrow - self.wide) * np.clip(out, 0.0, 1.0)) * MM
        shown = np.maximum(width, 0.55 * around.finest)
        open_ = np.maximum(1.0 - (plates.to_edge / (2.0 * shown)) ** 2, 0.0) ** 2 * np.sqrt(width / shown)
        return (self._plates(around, plates) - open_ * around.length(self.depth)) * zone

    def _plates(self, around: Around, plates: Cells) -> Array:
        """Height of each plate [m]."""
        lift, along, across = (uniform(seed, plates.number) for seed in (1, 2, 3))
        slope = (2.0 * along - 1.0) * plates.x + (2.0 * across - 1.0) * plates.y
        return self.tilt * slope + around.length(self.lowest) + lift * around.length(self.highest - self.lowest)


@dataclass(frozen=True)
class Fissures:
    """Cracks that run out from the outline, about a `spacing` apart, out to a `reach`, in `patches`.

    The ring that is pushed outward and up is stretched along the outline, and opens across that.
    """

    spacing: float
    reach: float
    width: float
    depth: float
    patches: float

    def heights(self, around: Around) -> Array:
        """Heights [m]."""
        out = -around.inward / around.length(self.reach)
        lines = np.abs(around.across(201, 0.5 * self.spacing, LONG)) * around.length(0.5 * self.spacing)
        width = self.width * MM * (1.0 - 0.7 * np.clip(out, 0.0, 1.0))
        shown = np.maximum(width, 0.55 * around.finest)
        open_ = np.maximum(1.0 - (lines / shown) ** 2, 0.0) ** 2 * np.sqrt(width / shown)
        zone = smooth_step(2.0 - 2.0 * out) * (1.0 - around.pressed) * around.patches(203, self.patches)
        return -open_ * zone * around.length(self.depth)


LONG = 20.0
"""Length that fissures would run, over their spacing."""

_BENT = ((0, 16.0, 6.0), (1, 5.0, 1.8))
"""Noise that bends the borders of plates: number, size and amount [mm]."""


@dataclass(frozen=True)
class Crumbs:
    """Crumbs about the outline, out to about a `width` from it, fewer inside: see `ScatteredCrumbs`.

    `share` is the density of the largest on the outline (see `scattered`), `within` the part of it inside.
    """

    share: float
    width: float = 16.0
    within: float = 0.25


Layer = Edge | Lumps | Floor | Apron | Streaks | Fans | Lip | Cracks | Fissures
