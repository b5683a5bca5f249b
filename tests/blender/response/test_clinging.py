"""What a body waded in clings to its legs, as an attribute of its meshes that shaders read."""

import bpy
import numpy as np
import pytest

from softground_addon.blender.carried import clinging
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.nodes.node_modifiers import set_inputs
from tests.blender import shots

HALF_AFTER = 0.5


def shown(obj):
    """The evaluated mesh of an object: positions (V, 3), and the attribute (V,) or None."""
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    place, attribute = np.empty(3 * len(mesh.vertices), np.float32), mesh.attributes.get(clinging.CLUNG)
    mesh.vertices.foreach_get("co", place)
    below = None if attribute is None else np.empty(len(mesh.vertices), np.float32)
    if attribute is not None:
        attribute.data.foreach_get("value", below)
    return place.reshape(-1, 3), below


def edges(figure):
    """Height of the edge on the left and the right leg, in the rest pose [units of the mesh]; 0 where there is none."""
    x, _, z = np.array([vertex.co for vertex in figure.data.vertices]).T
    _, below = shown(figure)
    clad = [(z < 0.45 * z.max()) & (side * x > 0.02 * z.max()) & (below > 0) for side in (1, -1)]
    return [float(z[leg].max(initial=0.0)) for leg in clad]


def steps_of(ground, scale):
    """The frame in the middle of each step, and its depth [units of the mesh], by foot."""
    steps = {"foot.L": [], "foot.R": []}
    for step in baked_ground.record_of(ground).footprints:
        steps[step.sole].append(((step.start_frame + step.end_frame) / 2, step.max_depth_m / scale))
    return steps


def remaining(steps):
    """Height of the edge on each leg at frame 44, after some of it has fallen off [units of the mesh]."""
    return [
        max(depth * 0.5 ** ((44 - at) / 24 / HALF_AFTER) for at, depth in taken if at <= 44) for taken in steps.values()
    ]


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_snow_clings_as_high_as_each_leg_has_waded_so_far_and_the_modifier_alone_brings_it(scene, scale):
    armature = shots.walker(scene, frames=44)
    armature.scale = [scale] * 3
    bpy.ops.softground.add_character()
    options = scene.softground
    options.frame_end, options.cell_size, options.material.layer_depth = 44, 0.02, 0.6
    options.material.youngs_modulus, options.material.poisson_ratio = 123e3, 0.0
    assert not bpy.ops.softground.cling.poll(), "nothing is baked"
    bpy.ops.softground.bake()
    (figure,) = (obj for obj in armature.children if obj.type == "MESH")
    own = sorted(figure.data.attributes.keys())
    scene.frame_set(30)
    before = shown(figure)
    assert bpy.ops.softground.cling() == {"FINISHED"}
    assert [modifier.type for modifier in figure.modifiers] == ["NODES", "ARMATURE"]
    assert np.array_equal(shown(figure)[0], before[0])

    steps = steps_of(options.ground, scale)
    assert min(middle for middle, _ in steps["foot.R"]) > 10
    for frame in (1, 10, 20, 44):
        scene.frame_set(frame)
        deepest = [max((depth for at, depth in taken if at <= frame), default=0.0) for taken in steps.values()]
        assert edges(figure) == pytest.approx(deepest, abs=0.04)  # as far as vertices are apart
        assert shown(figure)[1].max() <= scale * max(deepest) + 1e-4

    modifier = figure.modifiers[0]
    set_inputs(modifier, {"Half After": HALF_AFTER})
    figure.update_tag()
    scene.frame_set(44)
    assert edges(figure) == pytest.approx(remaining(steps), abs=0.04)
    assert bpy.ops.softground.cling() == {"FINISHED"}
    assert [group.name for group in bpy.data.node_groups if clinging.is_clinging(group)] == [modifier.node_group.name]

    options.material.youngs_modulus *= 8
    bpy.ops.softground.bake()
    scene.frame_set(44)
    shallower = steps_of(options.ground, scale)
    assert max(remaining(shallower)) < max(remaining(steps)) - 0.05
    assert edges(figure) == pytest.approx(remaining(shallower), abs=0.04)  # it follows a bake, with its own settings
    assert sum(map(clinging.is_clinging, bpy.data.node_groups)) == 1

    figure.modifiers.remove(modifier)
    bpy.ops.softground.bake()
    options.material.youngs_modulus /= 8
    bpy.ops.softground.bake()
    scene.frame_set(30)
    assert np.array_equal(shown(figure)[0], before[0])
    assert shown(figure)[1] is None
    assert sorted(figure.data.attributes.keys()) == own


def test_a_character_without_a_mesh_is_told_so(scene):
    armature = shots.walker(scene, frames=24)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.03
    bpy.ops.softground.bake()
    for mesh in armature.children:
        bpy.data.objects.remove(mesh)
    with pytest.raises(RuntimeError, match="deforms no mesh"):
        bpy.ops.softground.cling()
    assert not any(clinging.is_clinging(group) for group in bpy.data.node_groups)
