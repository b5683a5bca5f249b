"""EEVEE and Material Preview of a shot, for `ground_sheets`: `blender SHOT --python FILE -- CAMERA ...`; then quits.

Pictures go beside the shot.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import bpy


def shoot() -> None:
    """A picture by each engine from each camera."""
    window = bpy.context.window_manager.windows[0]
    scene, folder = window.scene, Path(bpy.data.filepath).parent
    engines = scene.render.bl_rna.properties["engine"].enum_items.keys()
    scene.render.engine = next(name for name in ("BLENDER_EEVEE_NEXT", "BLENDER_EEVEE") if name in engines)
    scene.eevee.taa_render_samples = 8
    area = max(window.screen.areas, key=lambda area: area.width * area.height)
    area.type = "VIEW_3D"
    area.spaces.active.shading.type = "MATERIAL"
    area.spaces.active.overlay.show_overlays = False
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    region = next(region for region in area.regions if region.type == "WINDOW")
    for name in sys.argv[sys.argv.index("--") + 1 :]:
        scene.camera = scene.objects[name]
        for row in ("eevee", "preview"):
            started = time.perf_counter()
            scene.render.filepath = str(folder / f"{row} {name}.png")
            if row == "eevee":
                bpy.ops.render.render(write_still=True)
            else:
                with bpy.context.temp_override(window=window, area=area, region=region):
                    bpy.ops.render.opengl(write_still=True)
            print(f"{row} {name}: {time.perf_counter() - started:.1f} s", flush=True)


def shoot_and_quit() -> None:
    """Whatever happens, the window is closed."""
    try:
        shoot()
    finally:
        bpy.ops.wm.quit_blender()


bpy.app.timers.register(shoot_and_quit, first_interval=2.0)
