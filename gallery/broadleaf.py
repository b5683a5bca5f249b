"""Broad-leaved trees and bushes for the distance: a forked stem and a crown of leaves in clumps."""

from __future__ import annotations

from math import pi

import bpy
import numpy as np

from gallery import firs, litter
from sample_scenes import stage, terrain
from sample_scenes.stage import Array
from softground_addon.blender.nodes.shader_graph import Colour

_SHAPES, _CLUMPS, _LEAVES = 4, 34, 130
"""How many trees are unlike, clumps of a crown, leaves of a clump."""
_WIDTH = (0.8, 1.25)
"""Least and greatest width, in that of the shape."""


def add_broadleaves(
    spots: Array, heights: Array, ground: terrain.Field, dark: Colour, light: Colour, *, stem: float, seed: int = 0
) -> None:
    """Trees, or bushes, on a ground.

    Parameters
    ----------
    spots, heights : (N, 2), (N,) float arrays
        [m].
    ground : function of x and y
        Its height [m].
    dark, light : tuple of float
        Of the leaves.
    stem : float
        Part of the height below the crown; near 0 for a bush.
    seed : int
    """
    leaf = litter.material(f"foliage {seed}", dark, light, 0.6, through=0.3)
    bark = stage.plain_material("SoftGround Sample stem", (0.055, 0.042, 0.033), 0.9)
    shapes = [_tree(np.random.default_rng(seed + number), leaf, bark, stem) for number in range(_SHAPES)]
    firs.plant("Broadleaf", shapes, spots, heights, ground, seed, _WIDTH)


def _tree(
    chance: np.random.Generator, leaf: bpy.types.Material, bark: bpy.types.Material, stem: float
) -> bpy.types.Mesh:
    """A tree of height 1."""
    turn, out = chance.uniform(0, 2 * pi, _CLUMPS), chance.uniform(0.0, 1.0, _CLUMPS) ** 0.5
    level = chance.uniform(0.0, 1.0, _CLUMPS)
    wide = 0.30 * np.sin(pi * (0.12 + 0.80 * level)) * out
    middle = np.column_stack([wide * np.cos(turn), wide * np.sin(turn), stem + (0.93 - stem) * level])
    size = chance.uniform(0.055, 0.12, _CLUMPS)
    ball = chance.normal(size=(_CLUMPS, _LEAVES, 3))
    ball *= chance.uniform(0.5, 1.0, (_CLUMPS, _LEAVES, 1)) / np.linalg.norm(ball, axis=-1, keepdims=True)
    place = middle[:, None] + size[:, None, None] * ball * (1.0, 1.0, 0.75)
    along = chance.normal(size=place.shape)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    across = np.cross(along, chance.normal(size=place.shape))
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    long = 0.013 * chance.uniform(0.6, 1.3, (*place.shape[:2], 1))
    wide = 0.55 * long * across
    corners = np.stack([place - long * along, place + wide, place + long * along, place - wide], axis=2)
    foliage = corners.reshape(-1, 3)

    share = np.linspace(0.0, 1.0, 6)[:, None]
    fork = np.array((0.0, 0.0, 0.6 * stem + 0.1))
    sway = 0.03 * np.sin(pi * share) * (1.0, 0.4, 0.0)  # a tube needs a line that is not upright
    lines = [(fork * share + sway, 0.016)]
    lines += [(fork + (end - fork) * share + sway, 0.007) for end in middle[::3]]
    wood, quads = litter.tubes(lines)
    count = len(foliage)
    faces = np.concatenate([np.arange(count).reshape(-1, 4), quads + count])
    mesh = litter.mesh_of("Broadleaf", np.concatenate([foliage, wood]), faces, leaf, smooth=False)
    mesh.materials.append(bark)
    which = np.repeat([0, 1], [count // 4, len(quads)]).astype(np.int32)
    mesh.polygons.foreach_set("material_index", which)
    return mesh
