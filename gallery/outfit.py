"""What a hiker wears in pictures taken from near: boots with laces and lugs, cloth in folds, a rucksack.

It comes on after the bake and prints nothing: `stage.put_back` takes it off again.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import pi

import bpy
import numpy as np
from numpy.typing import NDArray

from gallery import litter
from sample_scenes import stage
from sample_scenes.body import SIDES, Array, Body, Foot
from sample_scenes.character import TO_BLENDER, assign_weights
from sample_scenes.curves import clamped_spline
from sample_scenes.shoe import outline_width, upper
from sample_scenes.solids import Solid, cut, ellipsoid, mesh_of, round_cone, union
from softground_addon.blender.nodes.shader_graph import Colour, Graph, Socket

_LEATHER, _RUBBER, _LACE = (0.105, 0.050, 0.022), (0.014, 0.013, 0.012), (0.30, 0.045, 0.02)
_CLOTH = (0.050, 0.058, 0.066)
_JACKET = (0.36, 0.050, 0.030)
_PACK, _STRAP = (0.030, 0.075, 0.085), (0.012, 0.014, 0.016)

_STRAP_WAY = ((0.10, 0.07, 0.20), (0.17, 0.085, 0.285), (0.25, 0.10, 0.27), (0.335, 0.11, 0.15))
_STRAP_WAY += ((0.36, 0.125, 0.02), (0.30, 0.16, -0.10), (0.16, 0.165, -0.16), (0.07, 0.13, -0.17))
"""Of a strap over a shoulder, from the middle of the rucksack: ahead, aside, up [m]."""

_LACE_ROWS = np.array((0.36, 0.40, 0.44, 0.48, 0.52, 0.56))
"""Where laces cross the instep, in lengths of the foot from its back."""
_LACE_REACH = 0.15
"""From the middle of the instep to an eyelet, in widths of the upper from welt to welt."""
_LACE_RADIUS = 0.0021  # m
_LUG_PITCH, _LUG_LENGTH, _LUG_DEPTH, _LUG_HEIGHT = 0.0165, 0.0105, 0.0022, (0.0005, 0.0150)
"""Lugs along the edge of the sole: distance, length, how far they stand out, and from where to where up [m]."""


def wear_boots(armature: bpy.types.Object, body: Body) -> None:
    """Laces, eyelets and lugs on the shoes of a hiker, a rand of rubber and leather with seams in their material."""
    figure = stage.figure_of(armature)
    foot = body.foot
    for side, sign in SIDES.items():
        middle = np.array((0.0, body.joints[f"ankle.{side}"][1], 0.0))
        mirror = np.array((1.0, -sign, 1.0))  # a shoe is built for the right, its inner side toward +y
        for name, (vertices, faces), look in (
            ("Laces", _laces(foot), stage.plain_material("SoftGround Sample lace", _LACE, 0.85)),
            ("Eyelets", _eyelets(foot), stage.plain_material("SoftGround Sample eyelet", (0.45, 0.42, 0.36), 0.3)),
            ("Lugs", _lugs(foot), stage.plain_material("SoftGround Sample rubber", _RUBBER, 0.6)),
        ):
            bend = np.clip((vertices[:, 0] - foot.ball) / (0.06 * foot.length) + 0.5, 0.0, 1.0)
            weights = {f"foot.{side}": 1.0 - bend, f"toe.{side}": bend}
            _hang(armature, f"{name} {side}", vertices * mirror + middle, faces, look, weights)
    _wear(figure, "shoe", _leather(figure.data, body))
    _wear(figure, "sole", stage.plain_material("SoftGround Sample rubber", _RUBBER, 0.6))


def wear_creased(armature: bpy.types.Object, body: Body) -> None:
    """Folds and a weave in a hiker's trousers and jacket, most over the shoes, at the knees and above the hem."""
    figure = stage.figure_of(armature)
    knee, hem = body.joints["knee.L"][2], body.foot.ankle_height
    _wear(figure, "trousers", _cloth(figure.data, "cloth", _CLOTH, ((hem, 0.020), (knee, 0.014)), 0.005))
    waist = body.joints["hips"][2]
    _wear(figure, "jacket", _cloth(figure.data, "shell", _JACKET, ((waist, 0.010),), 0.006))


def wear_snow(armature: bpy.types.Object) -> None:
    """Snow in patches on boots and trousers, as high as each leg has waded (`softground_clung`)."""
    bpy.ops.softground.cling()
    for slot in stage.figure_of(armature).material_slots:
        if not slot.material.name.endswith(("cloth", "leather", "rubber")):
            continue
        tree = slot.material.node_tree
        shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
        colour, graph = shader.inputs["Base Color"], Graph(tree)
        place = graph.out(graph.node("ShaderNodeTexCoord"), 3)
        ragged = graph.attribute("softground_clung") + graph.swing(place, 0.05, 3.0) * 0.16
        patches = graph.ramp(graph.noise(place, 0.022, 4.0, 0.6) + graph.ramp(ragged, 0.0, 0.25) * 0.16, 0.52, 0.6)
        snow = graph.ramp(ragged, 0.0, 0.02) * patches
        clad = graph.mix(snow, tuple(colour.default_value)[:3], (0.80, 0.83, 0.88))
        if colour.links:
            bare = next(socket for socket in clad.output.node.inputs if socket.identifier == "A_Color")
            tree.links.new(colour.links[0].from_socket, bare)
        tree.links.new(clad.output, colour)


def wear_rucksack(armature: bpy.types.Object, body: Body) -> None:
    """A rucksack with a lid, pockets, a rolled mat and straps over the shoulders."""
    s = body.stature / 1.78
    back = body.joints["chest"] + s * np.array((-0.225, 0.0, -0.005))

    def at(x: float, y: float, z: float) -> Array:
        return back + s * np.array((x, y, z))

    sack = union(
        [
            _block(at(0.0, 0.0, 0.0), s * np.array((0.095, 0.145, 0.215)), 0.065 * s),
            _block(at(-0.085, 0.0, -0.075), s * np.array((0.045, 0.10, 0.105)), 0.035 * s),
            *[_block(at(0.0, y, -0.11), s * np.array((0.055, 0.03, 0.085)), 0.026 * s) for y in (-0.15, 0.15)],
        ],
        0.012 * s,
    )
    lid = cut(ellipsoid(at(-0.01, 0.0, 0.205), s * np.array((0.125, 0.165, 0.085))), at(0, 0, 0.185), (0, 0, -1), 0.02)
    mat = round_cone(at(-0.01, -0.19, 0.315), at(-0.01, 0.19, 0.315), 0.055 * s, 0.055 * s)
    mat = cut(cut(mat, at(0, 0.21, 0), (0, 1, 0), 0.015), at(0, -0.21, 0), (0, -1, 0), 0.015)
    low, high = at(-0.2, -0.26, -0.30), at(0.16, 0.26, 0.42)
    carried = {"chest": 1.0}
    for name, solid, colour in (
        ("Rucksack", sack, _PACK),
        ("Lid", lid, tuple(0.75 * part for part in _PACK)),
        ("Mat", mat, (0.33, 0.20, 0.06)),
    ):
        vertices, faces = mesh_of(solid, low, high, 0.009 * s)
        look = _cloth_of_thing(f"{name.lower()}", colour)
        _hang(armature, name, vertices, faces, look, carried)
    straps = []
    for side in (-1.0, 1.0):
        over = np.array([at(x, side * y, z) for x, y, z in _STRAP_WAY])
        straps.append((_smooth(over), 0.019 * s))
        straps.append((np.linspace(at(-0.135, 0.075 * side, -0.17), at(-0.10, 0.075 * side, 0.20), 8), 0.010 * s))
    vertices, faces = litter.tubes(straps, 8, taper=1.0)
    _hang(armature, "Straps", vertices, faces, _cloth_of_thing("strap", _STRAP), carried)


def _hang(
    armature: bpy.types.Object,
    name: str,
    vertices: Array,
    faces: NDArray[np.intp],
    look: bpy.types.Material,
    weights: dict[str, Array | float],
) -> None:
    """A piece in the body's frame that follows some bones, in pictures only."""
    mesh = litter.mesh_of(name, vertices @ TO_BLENDER.T, faces, look)
    piece = bpy.data.objects.new(name, mesh)
    stage.mark_still(piece)
    armature.users_collection[0].objects.link(piece)
    piece.parent = armature
    shares = np.column_stack([np.broadcast_to(share, len(vertices)) for share in weights.values()])
    assign_weights(piece, list(weights), shares)
    piece.modifiers.new("Armature", "ARMATURE").object = armature


def _wear(figure: bpy.types.Object, part: str, look: bpy.types.Material) -> None:
    """Another material for a part of a figure, which its mesh keeps as it was."""
    number = next(number for number, old in enumerate(figure.data.materials) if old.name.endswith(part))
    figure.material_slots[number].link, figure.material_slots[number].material = "OBJECT", look


def _on_upper(foot: Foot, x: Array, over: Array, above: float) -> Array:
    """Places (N, 3) on the upper at stations x (N,), `over` it (N,) from welt to welt, and so far `above` it [m]."""

    def place(x: Array, over: Array) -> Array:
        return np.column_stack([x, *upper(foot, x, over)])

    ahead = place(x + 1e-3, over) - place(x - 1e-3, over)
    across = place(x, np.clip(over + 5e-3, 0, 1)) - place(x, np.clip(over - 5e-3, 0, 1))
    normal = np.cross(ahead, across)
    normal *= np.sign(normal[:, 2:] + 1e-12) / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return place(x, over) + above * normal


def _stations(foot: Foot) -> Array:
    return foot.back + _LACE_ROWS * foot.length


def _laces(foot: Foot) -> tuple[Array, NDArray[np.intp]]:
    """Crossed from row to row."""
    rows = _stations(foot)
    lines = []
    t = np.linspace(-1.0, 1.0, 17)
    for first, second in pairwise(rows):
        for sign in (-1.0, 1.0):
            x = first + (second - first) * (t + 1) / 2
            lift = _LACE_RADIUS * (1.0 + (0.8 if sign > 0 else 0.0) * (1 - t**2))
            way = _on_upper(foot, x, 0.5 + sign * _LACE_REACH * t, 0.0) + lift[:, None] * (0.25, 0.0, 1.0)
            lines.append((way, _LACE_RADIUS))
    x = np.full(17, rows[-1])
    lines.append((_on_upper(foot, x, 0.5 + _LACE_REACH * t, 1.2 * _LACE_RADIUS), _LACE_RADIUS))
    return litter.tubes(lines, 8, taper=1.0)


def _eyelets(foot: Foot) -> tuple[Array, NDArray[np.intp]]:
    """A ring at both ends of each row of laces."""
    rows = _stations(foot)
    around = np.linspace(0.0, 2 * pi, 13)
    rings = []
    for side in (-1.0, 1.0):
        middle = _on_upper(foot, rows, np.full(len(rows), 0.5 + side * _LACE_REACH), 0.0)
        ahead = _on_upper(foot, rows + 1e-3, np.full(len(rows), 0.5 + side * _LACE_REACH), 0.0) - middle
        across = _on_upper(foot, rows, np.full(len(rows), 0.5 + side * (_LACE_REACH + 0.01)), 0.0) - middle
        ahead, across = (way / np.linalg.norm(way, axis=1, keepdims=True) for way in (ahead, across))
        rings += [
            (at + 0.0036 * (np.cos(around)[:, None] * each + np.sin(around)[:, None] * other), 0.0013)
            for at, each, other in zip(middle, ahead, across, strict=True)
        ]
    return litter.tubes(rings, 6, taper=1.0)


def _lugs(foot: Foot) -> tuple[Array, NDArray[np.intp]]:
    """Blocks along the edge of the sole."""
    x = foot.back + foot.length * (0.5 - 0.5 * np.cos(pi * np.linspace(0.004, 0.996, 160)))
    inner, outer = outline_width(foot, x)
    edge = np.concatenate([np.column_stack([x, inner]), np.column_stack([x, outer])[::-1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(edge, axis=0), axis=1))])
    starts = np.arange(0.0, along[-1], _LUG_PITCH)

    def on_edge(at: Array) -> Array:
        return np.column_stack([np.interp(at, along, edge[:, axis]) for axis in (0, 1)])

    first, last = on_edge(starts), on_edge(starts + _LUG_LENGTH)
    way = last - first
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    out = np.column_stack([-way[:, 1], way[:, 0]])
    low = np.clip((foot.heel - first[:, 0]) / (foot.heel - foot.back), 0, 1) ** 1.5 * 0.009
    low += np.clip((first[:, 0] - foot.toe) / (foot.front - foot.toe), 0, 1) ** 1.5 * 0.010
    corners = []
    for end, top, depth in [(e, t, d) for t in (0, 1) for e, d in ((first, 0), (last, 0), (last, 1), (first, 1))]:
        flat = end + out * (_LUG_DEPTH * (1 - 0.35 * top) if depth else -0.004)
        corners.append(np.column_stack([flat, low + _LUG_HEIGHT[top]]))
    vertices = np.stack(corners, axis=1).reshape(-1, 3)
    box = np.array(((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (0, 3, 2, 1), (4, 5, 6, 7)))
    return vertices, (8 * np.arange(len(starts))[:, None, None] + box).reshape(-1, 4)


def _at_rest(graph: Graph, mesh: bpy.types.Mesh) -> Socket:
    """Place in the resting figure [m], in Blender's frame."""
    corners = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    mesh.vertices.foreach_get("co", corners.ravel())
    place = graph.out(graph.node("ShaderNodeTexCoord"))  # from 0 to 1 within the mesh's box
    return graph.out(
        graph.node(
            "ShaderNodeVectorMath",
            {0: place, 1: np.ptp(corners, axis=0), 2: corners.min(axis=0)},
            operation="MULTIPLY_ADD",
        )
    )


def _leather(mesh: bpy.types.Mesh, body: Body) -> bpy.types.Material:
    """Rough leather with seams above a rand of rubber, which rises over the toes."""
    material = stage.plain_material("SoftGround Sample leather", _LEATHER, 0.7)
    graph, foot = Graph(material.node_tree), body.foot
    place = _at_rest(graph, mesh)
    _, y, z = (graph.out(graph.node("ShaderNodeSeparateXYZ", {0: place}), axis) for axis in range(3))
    along = y * -1.0  # forward
    toes = graph.ramp(along, foot.back + 0.74 * foot.length, foot.back + 0.93 * foot.length)
    height = z + toes * -0.021
    leather = graph.ramp(height, 0.0345, 0.0355)
    arch = graph.math("ABSOLUTE", along + -(foot.back + 0.52 * foot.length), 0.0)
    seams = [z + arch * -0.55 + -0.058, height + -0.0395, along + -(foot.back + 0.19 * foot.length) + z * -0.25]
    groove = None
    for seam in seams:
        near = graph.ramp(graph.math("ABSOLUTE", seam, 0.0), 0.0004, 0.0016, 1.0, 0.0)
        groove = near if groove is None else graph.math("MAXIMUM", groove, near)
    grain, wear = graph.noise(place, 0.004, 3.0, 0.7), graph.noise(place, 0.045, 3.0, 0.6)
    worn = graph.mix(wear, tuple(0.45 * part for part in _LEATHER), tuple(1.7 * part for part in _LEATHER))
    hide = graph.mix(groove * 0.8, worn, tuple(0.2 * part for part in _LEATHER))
    colour = graph.mix(leather, _RUBBER, hide)
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    links = material.node_tree.links
    links.new(colour.output, shader.inputs["Base Color"])
    links.new(graph.ramp(leather, 0.0, 1.0, 0.5, 0.75).output, shader.inputs["Roughness"])
    bumps = grain * 0.0006 + wear * 0.003 + leather * -0.0015 + groove * leather * -0.0012
    bump = graph.node("ShaderNodeBump", {"Height": bumps, "Distance": 1.0})
    links.new(bump.outputs[0], shader.inputs["Normal"])
    return material


def _cloth(
    mesh: bpy.types.Mesh, name: str, colour: Colour, piled: Sequence[tuple[float, float]], fold: float
) -> bpy.types.Material:
    """Woven cloth in slanting folds [m], higher around heights above the ground at which it is `piled` up."""
    material = stage.plain_material(f"SoftGround Sample {name}", colour, 0.85)
    material.displacement_method = "BOTH"
    graph = Graph(material.node_tree)
    place = _at_rest(graph, mesh)
    up = graph.out(graph.node("ShaderNodeSeparateXYZ", {0: place}), 2)
    high: Socket | float = fold
    for middle, height in piled:
        away = graph.math("ABSOLUTE", up + -middle, 0.0)
        high = graph.ramp(away, 0.0, 0.16, height - fold, 0.0) + high
    folds: Socket | float = 0.0
    for tilt, share in ((0.5, 0.6), (-0.4, 0.4)):
        turned = graph.node("ShaderNodeVectorRotate", {"Vector": place, "Angle": tilt}, rotation_type="Y_AXIS")
        squeezed = graph.node("ShaderNodeVectorMath", {0: graph.out(turned), 1: (0.5, 0.5, 1.1)}, operation="MULTIPLY")
        bent = graph.math("ABSOLUTE", graph.noise(graph.out(squeezed), 0.099, 1.0, 0.3) + -0.5, 0.0)
        folds = graph.ramp(bent, 0.0, 0.13, 1.0, 0.0) * share + folds
    weave = graph.noise(place, 0.002, 2.0, 0.8)
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shade = graph.mix(weave, tuple(0.6 * part for part in colour), tuple(1.4 * part for part in colour))
    material.node_tree.links.new(shade.output, shader.inputs["Base Color"])
    height = graph.math("MULTIPLY", folds, high) + weave * 0.0005
    moved = graph.node("ShaderNodeDisplacement", {"Height": height, "Midlevel": 0.0, "Scale": 1.0})
    material.node_tree.links.new(moved.outputs[0], material.node_tree.get_output_node("ALL").inputs["Displacement"])
    return material


def _cloth_of_thing(name: str, colour: Colour) -> bpy.types.Material:
    """Coarse cloth, a little slack."""
    material = stage.plain_material(f"SoftGround Sample {name}", colour, 0.8)
    graph = Graph(material.node_tree)
    place = graph.out(graph.node("ShaderNodeTexCoord"), 3)
    slack = graph.noise(place, 0.09, 2.0) * 0.02 + graph.noise(place, 0.003, 2.0) * 0.0006
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    bump = graph.node("ShaderNodeBump", {"Height": slack, "Distance": 1.0})
    material.node_tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    return material


def _block(centre: Array, half: Array, rounding: float) -> Solid:
    """A box with rounded edges."""

    def distance(points: Array) -> Array:
        beyond = np.abs(points - centre) - (half - rounding)
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
        return outside + np.minimum(beyond.max(axis=-1), 0.0) - rounding

    return distance


def _smooth(corners: Array, count: int = 40) -> Array:
    """A line (count, 3) through corners (N, 3), rounded."""
    at, slopes = np.arange(len(corners)), np.diff(corners[[0, 1, -2, -1]], axis=0)[::2]
    return clamped_spline(np.linspace(0, at[-1], count), at, corners, *slopes)
