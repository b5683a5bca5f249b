"""A rig with its response, exported for other programs: they read what is seen, and not the layer's armature."""

import bpy
import numpy as np
import pytest

from softground_addon.blender.animation_layer.constraint_layer import LayerKind
from tests.blender import responders, shots

FRAMES = (10, 20, 30, 40)
FORMATS = {
    "fbx": (
        lambda path: bpy.ops.export_scene.fbx(
            filepath=path,
            bake_anim_simplify_factor=0.0,
            bake_anim_use_all_actions=False,
            bake_anim_use_nla_strips=False,
        ),
        lambda path: bpy.ops.import_scene.fbx(filepath=path, anim_offset=0.0),
    ),
    "glb": (
        lambda path: bpy.ops.export_scene.gltf(filepath=path, export_animation_mode="SCENE"),
        lambda path: bpy.ops.import_scene.gltf(filepath=path, bone_heuristic="BLENDER"),
    ),
    "usdc": (
        lambda path: bpy.ops.wm.usd_export(filepath=path, export_animation=True, export_armatures=True),
        lambda path: bpy.ops.wm.usd_import(filepath=path),
    ),
    "abc": (
        lambda path: bpy.ops.wm.alembic_export(filepath=path, start=1, end=48),
        lambda path: bpy.ops.wm.alembic_import(filepath=path, as_background_job=False),
    ),
}


def lowest(scene):
    """Height of the lowest vertex of the figure at each frame, without the ground."""
    result = []
    for frame in FRAMES:
        scene.frame_set(frame)
        heights = []
        for obj in scene.objects:
            if obj.type == "MESH" and obj.visible_get():  # but for shapes of bones
                evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
                mesh = evaluated.to_mesh()
                points = np.array([evaluated.matrix_world @ vertex.co for vertex in mesh.vertices])
                heights.append(points[:, 2].min())
        result.append(min(heights))
    return np.array(result)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", FORMATS)
def test_what_is_exported_is_what_is_seen(scene, tmp_path, suffix):
    write, read = FORMATS[suffix]
    shots.walker(scene, frames=48)
    scene.frame_start, scene.frame_end = 1, 48
    bpy.ops.softground.add_character()
    scene.softground.frame_end, scene.softground.debris = 48, False
    flat = lowest(scene)
    responders.bake(scene, output="RESPONSE")
    seen = lowest(scene)
    assert (flat - seen).max() > 0.02, "feet sink"
    path = str(tmp_path / f"walker.{suffix}")
    write(path)
    rate = scene.render.fps
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = rate
    read(path)
    assert not [obj.name for obj in bpy.data.objects if LayerKind.RESPONSE.value in obj.name]
    read_back = lowest(bpy.context.scene)
    assert read_back == pytest.approx(seen, abs=2e-3)
