"""The figure that *Add Sample Scene* adds: its bones, mesh and keys as one small file inside the add-on.

`python -m sample_scenes.sample_walk` writes it anew.
"""

from __future__ import annotations

import json
import sys

import bpy
import numpy as np

from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from softground_addon.blender import compat
from softground_addon.blender.setup.sample_scene import FILE

FRAMES, RATE = 96, 24
SHARE = 0.02
"""Of the faces of the finest figure that are left."""


def as_data() -> dict:
    """The figure in plain numbers: metres, and a quaternion for each bone and frame."""
    body = Body()
    scene = bpy.context.scene
    armature = create_character("Walking Figure", body, scene.collection)
    action = write_action(armature, walk(body, Gait(), FRAMES, RATE), "Walk")
    thin_out = armature.children[0].modifiers.new("Thin Out", "DECIMATE")
    thin_out.ratio = SHARE
    armature.children[0].modifiers.move(1, 0)
    armature.data.pose_position = "REST"
    mesh = bpy.data.meshes.new_from_object(
        armature.children[0].evaluated_get(bpy.context.evaluated_depsgraph_get()),
        preserve_all_data_layers=True,
        depsgraph=bpy.context.evaluated_depsgraph_get(),
    )
    names = [group.name for group in armature.children[0].vertex_groups]
    curves: dict[str, list] = {}
    for curve in compat.action_curves(action, compat.slot_of(armature.animation_data)):
        values = np.empty(2 * len(curve.keyframe_points))
        curve.keyframe_points.foreach_get("co", values)
        curves.setdefault(curve.data_path, []).append(np.round(values[1::2], 4).tolist())
    return {
        "bones": [
            [bone.name, bone.parent.name if bone.parent else "", _rounded(bone.head_local), _rounded(bone.tail_local)]
            for bone in armature.data.bones
        ],
        "materials": [
            [material.name, _rounded(material.diffuse_color), round(material.roughness, 3)]
            for material in mesh.materials
        ],
        "vertices": [_rounded(vertex.co) for vertex in mesh.vertices],
        "carried_by": [names[max(v.groups, key=lambda group: group.weight).group] for v in mesh.vertices],
        "faces": [list(face.vertices) for face in mesh.polygons],
        "material_of_face": [face.material_index for face in mesh.polygons],
        "curves": curves,
    }


def _rounded(values: object) -> list[float]:
    return [round(float(value), 4) for value in values]  # type: ignore[attr-defined]


def main() -> int:
    bpy.ops.wm.read_homefile(use_empty=True)
    data = as_data()
    data["carriers"] = [bone[0] for bone in data["bones"]]
    data["carried_by"] = [data["carriers"].index(name) for name in data["carried_by"]]
    FILE.write_text(json.dumps(data, separators=(",", ":")) + "\n", encoding="utf-8")
    print(f"{FILE}: {FILE.stat().st_size / 1e3:.0f} kB, {len(data['vertices'])} vertices")
    return 0


if __name__ == "__main__":
    sys.exit(main())
