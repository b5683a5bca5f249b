"""A meadow to try Give Way with: hair curves in tufts on a ground, near its prints where there are any."""

from __future__ import annotations

from math import pi
from typing import Any

import bpy
import numpy as np

from ...core.numerics.arrays import Array
from .. import compat
from ..nodes.shader_graph import Graph

NAME = "SoftGround Meadow"
DENSITY, MOST = 6000.0, 60_000
"""Blades per square metre, and in all."""
PER_TUFT, TUFT = 12, 0.035
"""Blades that grow together, and how far apart [m]."""
HEIGHT = 0.28
"""Of the tallest blades [m]."""
THICKNESS = 0.0025
"""Of a blade at its root [m]."""
_POINTS = 5
DARK, LIGHT = (0.035, 0.075, 0.012), (0.20, 0.24, 0.06)
"""Linear colours of blades."""


def grow(corners: Array, unit_scale: float, near: Array | None = None, reach: float = 0.0) -> bpy.types.Object:
    """Blades on triangles, as an object in no collection yet.

    Parameters
    ----------
    corners : (T, 3, 3) float array
        Of the ground, in world space [m].
    unit_scale : float
        Metres per Blender unit.
    near : (N, 2) float array, optional
        Places around which blades grow [m]; by default everywhere.
    reach : float
        How far around them [m].
    """
    chance = np.random.default_rng(0)
    centre = corners[:, :, :2].mean(axis=1)
    if near is not None:
        apart = np.full(len(centre), np.inf)
        for place in near:
            np.minimum(apart, np.hypot(*(centre - place).T), out=apart)
        corners = corners[apart < reach]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    tufts = max(1, int(min(MOST, DENSITY * area.sum()) / PER_TUFT))
    on = corners[chance.choice(len(corners), tufts, p=area / area.sum())]
    return planted(np.einsum("nk,nki->ni", chance.dirichlet((1.0, 1.0, 1.0), tufts), on), chance, unit_scale)


def planted(tufts: Array, chance: np.random.Generator, unit_scale: float) -> bpy.types.Object:
    """Blades that grow in tufts at places (N, 3) [m], as an object in no collection yet."""
    root = tufts.repeat(PER_TUFT, axis=0)
    root[:, :2] += chance.normal(0.0, TUFT / 2, (len(root), 2))
    height = HEIGHT * chance.beta(4.0, 2.0, len(root)) * chance.uniform(0.6, 1.0, len(tufts)).repeat(PER_TUFT)
    turn, droop = chance.uniform(0.0, 2 * pi, len(root)), height * chance.uniform(0.1, 0.55, len(root))
    along = np.linspace(0.0, 1.0, _POINTS)
    aside = np.stack([np.cos(turn), np.sin(turn), np.zeros(len(turn))], axis=1) * droop[:, None]
    places = root[:, None] + along[:, None] ** 2 * aside[:, None]
    places[:, :, 2] += along * height[:, None]
    return bpy.data.objects.new(NAME, _curves(places / unit_scale, THICKNESS / unit_scale))


def _curves(places: Array, thickness: float) -> bpy.types.Curves:
    """Hair curves through places (N, K, 3), pointed at their ends."""
    curves = bpy.data.hair_curves.new(NAME)
    curves.add_curves([places.shape[1]] * len(places))
    attribute: Any = curves.attributes["position"]
    attribute.data.foreach_set("vector", places.astype(np.float32).ravel())
    thin = np.tile(0.5 * thickness * np.linspace(1.0, 0.1, places.shape[1]), len(places))
    attribute = curves.attributes.new("radius", "FLOAT", "POINT")
    attribute.data.foreach_set("value", thin.astype(np.float32))
    curves.materials.append(_material())
    return curves


def _material() -> bpy.types.Material:
    material = bpy.data.materials.get(NAME)
    if material is not None:
        return material
    material = bpy.data.materials.new(NAME)
    material.diffuse_color = (*LIGHT, 1.0)
    tree = compat.shader_tree(material)
    graph = Graph(tree)
    info = graph.node("ShaderNodeHairInfo")
    each = graph.out(info, list(info.outputs.keys()).index("Random"))
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.links.new(graph.mix(each, DARK, LIGHT).output, shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value = 0.6
    return material
