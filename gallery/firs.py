"""Firs: whorls of bent branches with gaps between them, needles as sprays of narrow blades, snow where it lies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import bpy
import numpy as np

from sample_scenes import stage, terrain
from sample_scenes.stage import Array
from softground_addon.blender.nodes.shader_graph import Colour, Graph, Socket

_SHAPES, _WHORLS, _BRANCHES, _TWIGS, _SIDES = 4, 21, 9, 12, 40
"""How many trees are unlike, whorls of each, branches of a whorl, pairs of twigs on a branch, sides of a trunk."""
_UP = np.array((0.0, 0.0, 1.0))

WINTRY = (0.034, 0.056, 0.040)
"""Colour of needles under snow."""


def add_firs(
    spots: Array,
    heights: Array,
    ground: terrain.Field,
    colour: Colour,
    *,
    seed: int = 0,
    snow: float = 0.0,
    crown: float = 0.055,
) -> None:
    """Firs on a ground.

    Parameters
    ----------
    spots, heights : (N, 2), (N,) float arrays
        [m].
    ground : function of x and y
        Its height [m].
    colour : tuple of float
        Of the needles.
    seed : int
    snow : float
        Share of the branches that bear some.
    crown : float
        Part of the height below the lowest branches.
    """
    materials = _needles(colour), _bark(), stage.plain_material("SoftGround Sample laden", (0.86, 0.89, 0.93), 0.8)
    shapes = [_fir(np.random.default_rng(seed + number), materials, snow, crown) for number in range(_SHAPES)]
    plant("Fir", shapes, spots, heights, ground, seed)


def plant(
    name: str,
    shapes: Sequence[bpy.types.Mesh],
    spots: Array,
    heights: Array,
    ground: terrain.Field,
    seed: int,
    width: tuple[float, float] | None = None,
) -> None:
    """Trees of height 1 as high as given on a ground, turned; each as wide over its height as drawn from `width`."""
    chance = np.random.default_rng(seed)
    for number, ((x, y), height) in enumerate(zip(spots, heights, strict=True)):
        tree = bpy.data.objects.new(name, shapes[number % len(shapes)])
        tree.location = (x, y, float(ground(np.array(x), np.array(y))) - 0.02 * height)
        tree.rotation_euler.z = chance.uniform(0, 2 * pi)
        wide = [chance.uniform(*width) for _ in range(2)] if width else [1.0, 1.0]
        tree.scale = (height * wide[0], height * wide[1], height)
        bpy.context.scene.collection.objects.link(tree)


@dataclass(frozen=True)
class _Branches:
    """N branches of a fir of height 1; all but `level` are ready to go with places (N, K, 3)."""

    level: Array
    length: Array
    ahead: Array
    rise: Array
    droop: Array

    @property
    def across(self) -> Array:
        return np.cross(_UP, self.ahead)

    def places(self, along: Array) -> Array:
        """Places (N, K, 3) at parts of the length (N, K): branches hang, and turn up at their tips."""
        along = along[..., None]
        height = self.rise * along - self.droop * along**2 + 0.22 * along**4
        return self.level[:, None, None] * _UP + self.length * (along * self.ahead + height * _UP)

    def where(self, chosen: Array) -> _Branches:
        """Some of them."""
        return _Branches(*(part[chosen] for part in (self.level, self.length, self.ahead, self.rise, self.droop)))


def _fir(
    chance: np.random.Generator, materials: Sequence[bpy.types.Material], snow: float, crown: float
) -> bpy.types.Mesh:
    """A fir of height 1, its materials those of needles, bark and snow."""
    branches = _branches(chance, crown)
    laden = branches.where(chance.random(len(branches.level)) < snow)
    needles, tip = _sprays(branches, chance)
    parts = [needles, _wood(branches), _pads(laden, chance)]
    quads = np.concatenate(parts)
    mesh = bpy.data.meshes.new("Fir")
    mesh.from_pydata(quads.reshape(-1, 3).tolist(), [], np.arange(4 * len(quads)).reshape(-1, 4).tolist())
    mesh.polygons.foreach_set("material_index", np.repeat([0, 1, 2], [len(part) for part in parts]).astype(np.int32))
    shade = np.zeros(4 * len(quads), np.float32)
    shade[: tip.size] = tip
    mesh.attributes.new("tip", "FLOAT", "POINT").data.foreach_set("value", shade)
    for material in materials:
        mesh.materials.append(material)
    return mesh


def _branches(chance: np.random.Generator, crown: float) -> _Branches:
    """Whorls from the crown to the tip, closer and shorter toward it; high branches rise, low ones hang."""
    level = np.repeat(crown + (0.985 - crown) * np.linspace(0.0, 1.0, _WHORLS) ** 0.85, _BRANCHES)
    reach = (0.19 * (1.0 - level) ** 0.8 + 0.012) * np.repeat(chance.uniform(0.8, 1.1, _WHORLS), _BRANCHES)
    turn = np.tile(np.arange(_BRANCHES) * 2 * pi / _BRANCHES, _WHORLS)
    turn = turn + np.repeat(chance.uniform(0, 2 * pi, _WHORLS), _BRANCHES) + chance.normal(0.0, 0.22, len(level))
    length = reach * chance.uniform(0.55, 1.12, len(level))
    droop = (0.75 - 0.45 * level) * chance.uniform(0.7, 1.2, len(level))
    return _Branches(
        level + chance.normal(0.0, 0.006, len(level)),
        length[:, None, None],
        np.column_stack([np.cos(turn), np.sin(turn), np.zeros(len(level))])[:, None],
        (0.75 * level - 0.05)[:, None, None],
        droop[:, None, None],
    )


def _sprays(branches: _Branches, chance: np.random.Generator) -> tuple[Array, Array]:
    """Blades (Q, 4, 3) on twigs to both sides of branches, and how near each corner is to the tip of one, (4Q,)."""
    shape = (len(branches.level), 2 * _TWIGS)
    along = np.linspace(0.10, 1.0, _TWIGS).repeat(2) + chance.normal(0.0, 0.02, shape)
    side = np.where(np.arange(2 * _TWIGS) % 2, 1.0, -1.0)[None, :, None]
    grown = 0.40 * branches.length * ((1.12 - along) ** 0.7 * chance.uniform(0.6, 1.2, shape))[..., None]
    twig = grown * (
        0.75 * side * branches.across + 0.62 * branches.ahead - chance.uniform(0.1, 0.55, (*shape, 1)) * _UP
    )
    outward = grown * (0.62 * side * branches.across - 0.75 * branches.ahead)
    spray = [0.95 * twig, 0.55 * twig + 0.38 * outward, 0.62 * twig - 0.36 * outward, 0.5 * twig - 0.45 * grown * _UP]
    blade = np.stack(spray, axis=2) * chance.uniform(0.7, 1.2, (*shape, 4, 1))
    root = branches.places(along)[:, :, None] + np.array((0.0, 0.12, 0.25, 0.1))[:, None] * twig[:, :, None]
    flank = np.cross(blade, chance.normal(_UP, 0.6, blade.shape))
    flank *= 0.11 * np.linalg.norm(blade, axis=-1, keepdims=True) / np.linalg.norm(flank, axis=-1, keepdims=True)
    quads = np.stack([root, root + 0.5 * blade + flank, root + blade, root + 0.5 * blade - flank], axis=-2)
    tip = np.array((0.0, 0.3, 0.6, 0.3)) + 0.4 * along[..., None, None]
    return quads.reshape(-1, 4, 3), np.broadcast_to(tip, quads.shape[:-1]).ravel()


def _wood(branches: _Branches) -> Array:
    """A trunk and the wood of branches as quads (Q, 4, 3)."""
    boughs = branches.places(np.tile(np.linspace(0.0, 0.9, 5), (len(branches.level), 1)))
    thick = 0.006 * (1.0 - branches.level)[:, None, None] * _UP
    wood = np.stack([boughs[:, :-1], boughs[:, 1:], boughs[:, 1:] + 0.5 * thick, boughs[:, :-1] + thick], axis=2)
    return np.concatenate([_trunk(), wood.reshape(-1, 4, 3)])


def _trunk() -> Array:
    """A stem that thins toward the tip, and widens to roots at the ground, as quads (Q, 4, 3)."""
    turn = np.linspace(0.0, 2 * pi, _SIDES + 1)
    level = np.concatenate([np.linspace(0.0, 0.05, 9), np.linspace(0.07, 0.4, 12), [0.6, 0.8, 1.0]])[:, None]
    lobes = 1.0 + 0.45 * np.sin(5 * turn + 0.8 * np.sin(2 * turn)) + 0.3 * np.sin(3 * turn + 1.0)
    uneven = 0.03 * np.sin(2 * turn + 40.0 * level) + 0.02 * np.sin(5 * turn - 90.0 * level)
    radius = 0.0115 * (1.0 - level) * (1.0 + uneven + 0.75 * lobes * np.exp(-level / 0.012))
    rings = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.broadcast_to(level, radius.shape)], axis=-1)
    quads = [rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]]
    return np.stack(quads, axis=2).reshape(-1, 4, 3)


def _pads(branches: _Branches, chance: np.random.Generator) -> Array:
    """Snow on branches as quads (Q, 4, 3), whose underside stays dark."""
    along = np.linspace(0.12, 1.02, 9)
    ridge = branches.places(np.tile(along, (len(branches.level), 1)))
    swell = np.sin(pi * np.linspace(0.05, 0.97, 9)) ** 0.6 * chance.uniform(0.6, 1.3, ridge.shape[:2])
    wide = 0.30 * branches.length * (swell * (1.15 - along))[..., None] * branches.across
    crest = ridge + 0.16 * branches.length * (swell * (1.1 - along))[..., None] * _UP
    low = ridge - 0.05 * branches.length * swell[..., None] * _UP
    rows = np.stack([low - wide, crest - 0.5 * wide, crest + 0.5 * wide, low + wide], axis=2)
    pads = np.stack([rows[:, :-1, :-1], rows[:, 1:, :-1], rows[:, 1:, 1:], rows[:, :-1, 1:]], axis=-2)
    return pads.reshape(-1, 4, 3)


def _needles(colour: Colour) -> bpy.types.Material:
    """Needles of a colour, paler toward the tips of twigs, no two trees alike."""
    material = stage.plain_material("SoftGround Sample needles", colour, 0.7)
    graph = Graph(material.node_tree)
    red, green, blue = colour
    tree = graph.out(graph.node("ShaderNodeObjectInfo"), 5)
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    dark, young = (0.55 * red, 0.55 * green, 0.55 * blue), (1.9 * red, 1.9 * green, 1.3 * blue)
    shade = graph.mix(graph.attribute("tip") * 0.7 + tree * 0.3, dark, young)
    material.node_tree.links.new(shade.output, shader.inputs["Base Color"])
    return material


def _bark() -> bpy.types.Material:
    """Long plates of bark between furrows that part and meet again, cracked across, with lichen and moss."""
    material = stage.plain_material("SoftGround Sample bark", (0.085, 0.058, 0.042), 0.9)
    graph = Graph(material.node_tree)
    place = graph.out(graph.node("ShaderNodeNewGeometry"))

    def along(share: float) -> Socket:
        """The place, stretched along the stem."""
        return graph.out(graph.node("ShaderNodeVectorMath", {0: place, 1: (1.0, 1.0, share)}, operation="MULTIPLY"))

    def furrow(size: float, share: float, width: float) -> Socket:
        """From 0 in a furrow to 1 on a plate."""
        middle = graph.math("ABSOLUTE", graph.noise(along(share), size, 3.0, 0.55) + -0.5, 0.0)
        return graph.ramp(middle, 0.0, width)

    deep, fine = furrow(0.05, 0.12, 0.085), furrow(0.022, 0.16, 0.11)
    across = graph.ramp(furrow(0.055, 1.1, 0.035), 0.0, 1.0, 0.55, 1.0)
    plate = graph.math("MULTIPLY", deep * across, graph.ramp(fine, 0.0, 1.0, 0.55, 1.0))
    grain = graph.noise(along(0.35), 0.008, 3.0, 0.7)
    tone = graph.noise(along(0.4), 0.14, 3.0, 0.6)
    colour = graph.mix(graph.ramp(tone, 0.3, 0.7), (0.060, 0.041, 0.030), (0.150, 0.112, 0.086))
    colour = graph.mix(grain * 0.5, colour, (0.040, 0.028, 0.021))
    colour = graph.mix(plate, (0.014, 0.010, 0.008), colour)
    lichen = graph.ramp(graph.noise(place, 0.06, 4.0, 0.7), 0.58, 0.66) * plate
    colour = graph.mix(lichen * 0.55, colour, (0.17, 0.18, 0.135))
    relief = plate + grain * 0.25
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    bump = graph.node("ShaderNodeBump", {"Height": relief, "Distance": 0.03})
    material.node_tree.links.new(colour.output, shader.inputs["Base Color"])
    material.node_tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    return material
