"""Bakes a walk on a surface that the product does not know: `python -m tests.blender.new_look_worker FOLDER`.

The look is one record, one shader function and one preset, as a developer would add them.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import bpy

from softground_addon.blender.materials import surface_shaders
from softground_addon.blender.nodes.shader_graph import Graph
from softground_addon.core.ground import presets
from softground_addon.core.ground.surfaces import SURFACES

RECORD = replace(
    SURFACES["snow"], name="volcanic_ash", density=900.0, colour=(0.2, 0.1, 0.05), shader="volcanic_ash",
    midi_note=60, melts=False, soaking=SURFACES["soil"].soaking,
)  # fmt: skip


def volcanic_ash(graph: Graph, ground: surface_shaders.Ground) -> surface_shaders.Look:
    """Grey, and darker where it is pressed."""
    colour = graph.mix(ground.pressed, (0.3, 0.3, 0.3), (0.1, 0.1, 0.1))
    return surface_shaders.Look(graph.swing(ground.place, 0.002, 2.0, 0.7), {"Base Color": colour, "Roughness": 0.9})


def bake(folder: Path) -> dict[str, object]:
    """What becomes of a walk on the new ground."""
    from softground_addon.blender import ground_presets
    from softground_addon.blender.debris import debris_object
    from softground_addon.blender.ground import baked_ground
    from softground_addon.blender.output import export_formats
    from tests.blender import shots

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    shots.walker(scene, frames=40)
    text = json.dumps(json.loads(presets.dump(presets.find("fresh_snow"))) | {"name": "Ash", "surface": RECORD.name})
    ground_presets.apply_preset(scene.softground, presets.parse(text, "volcanic_ash.json"))
    shots.coarse(scene)
    scene.softground.frame_end, scene.softground.debris, scene.softground.relief = 40, True, "FINE"
    bpy.ops.softground.add_character()
    bpy.ops.softground.bake()
    bpy.ops.softground.add_weather(preset="SHOWER")
    ground = scene.softground.ground
    display_mesh, debris = baked_ground.display_mesh_of(ground), debris_object.of(ground)
    for kind in ("EVENTS_MIDI", "WAV", "OBJ"):
        path = folder / f"steps{export_formats.FORMATS[kind].suffix}"
        export_formats.export(scene, export_formats.Options(kind, path, 1, 40))
    return {
        "label": scene.softground.material.bl_rna.properties["surface"].enum_items[RECORD.name].name,
        "material": display_mesh.material_slots[0].material.name,
        "pieces": [list(material.diffuse_color) for material in bpy.data.materials if "Pieces" in material.name],
        "debris": len(debris.data.vertices),
        "thrown_m3": sum(sum(step.thrown.values()) for step in baked_ground.record_of(ground).steps if step.footprint),
        "modifiers": [modifier.name for modifier in display_mesh.modifiers],
        "events": baked_ground.events_of(ground),
    }


if __name__ == "__main__":
    import softground_addon

    SURFACES[RECORD.name] = RECORD
    surface_shaders.volcanic_ash = volcanic_ash  # type: ignore[attr-defined]
    softground_addon.register()
    try:
        (Path(sys.argv[1]) / "found.json").write_text(json.dumps(bake(Path(sys.argv[1]))))
    finally:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        softground_addon.unregister()
