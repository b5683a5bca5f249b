"""Bakes a shot, edits or plays one, in whatever Blender runs this: `python -m tests.blender.version_worker ...`."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

FRAMES = (8, 22, 36)
BETWEEN = 14.25


def make(blend: str, heights: str) -> None:
    """Bake the walker, save the shot, and write what its record says of the display mesh's heights."""
    import softground_addon
    from softground_addon.blender import jobs
    from softground_addon.blender.baking import bake_job
    from softground_addon.blender.ground import baked_ground, ground_surface
    from softground_addon.core.record.pressed_ground import PressedGround
    from tests.blender import shots
    from tests.blender.grounds import plane
    from tests.blender.playback.test_playback_render import set_up_render

    softground_addon.register()
    try:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        shots.walker(scene, frames=40)
        bpy.ops.softground.add_character()
        ground = scene.softground.ground = plane(scene, vertices=2)
        scene.softground.frame_end = 40
        bpy.context.view_layer.update()
        jobs.run(bake_job.bake(scene))
        set_up_render(scene)
        display_mesh = baked_ground.display_mesh_of(ground)
        display_mesh.name = "Carrier"
        rest = ground_surface.rest_vertices(display_mesh, 1.0)
        footprints, about = baked_ground.load(ground)
        sigma = baked_ground.baked_with(about, "blur_sigma")
        recorded = {}
        for frame in (*FRAMES, BETWEEN):
            whole = PressedGround.at(footprints, frame=frame, frame_rate=24.0, cell_size=0.01, blur_sigma=sigma)
            recorded[str(frame)] = rest[:, 2] + whole.sample(*rest[:, :2].T).display
        np.savez(heights, **recorded)
        bpy.ops.wm.save_as_mainfile(filepath=blend)
    finally:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        softground_addon.unregister()


def edit(blend: str, saved: str, facts: str) -> None:
    """Mute a step of a shot, move and turn another, and save it; write its edits, and its records before and after."""
    from softground_addon.core.record.edits import StepEdit, step_id

    with _editable(blend) as (scene, bake, change):
        first, other = (step_id(step) for step in bake.record.footprints[1:3])
        before = _stored(scene)
        change({first: StepEdit(mute=True), other: StepEdit(move_m=(0.05, 0.02), turn_deg=7.0)})
        bpy.ops.wm.save_as_mainfile(filepath=saved)
        Path(facts).write_bytes(pickle.dumps((_edits(scene), before, _stored(scene))))


def reset(blend: str, facts: str) -> None:
    """Write the edits of a shot as they are read here, and its records once they are reset, and before."""
    with _editable(blend) as (scene, _, change):
        before, after = _edits(scene), _stored(scene)
        change({})
        Path(facts).write_bytes(pickle.dumps((before, _stored(scene), after)))


@contextmanager
def _editable(blend: str) -> Iterator[Any]:
    """The scene of a file, its bake to be edited, and what changes the edits."""
    import softground_addon
    from softground_addon.blender import jobs
    from softground_addon.blender.baking import step_edits

    softground_addon.register()
    try:
        bpy.ops.wm.open_mainfile(filepath=blend)
        scene = bpy.context.scene
        bake = jobs.run(step_edits.reading(scene))
        yield scene, bake, lambda edits: jobs.run(step_edits.editing(bake, edits))
    finally:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        softground_addon.unregister()


def _stored(scene: bpy.types.Scene) -> bytes:
    from softground_addon.blender.ground import baked_ground

    return bytes(baked_ground.stored_record(scene.softground.ground))


def _edits(scene: bpy.types.Scene) -> str:
    from softground_addon.blender.ground import baked_ground

    return repr(sorted(baked_ground.edits_of(scene.softground.ground).items()))


def play(blend: str, out: str, with_addon: str, rendering: str, *frames: str) -> None:
    """Open a shot with the add-on enabled or without it, and write heights and, if asked for, pixels of the frames."""
    if with_addon == "1":
        import softground_addon

        softground_addon.register()
    try:
        bpy.ops.wm.open_mainfile(filepath=blend, use_scripts=with_addon == "1")
        assert hasattr(bpy.types.Scene, "softground") == (with_addon == "1")
        scene, shown = bpy.context.scene, {}
        for frame in frames:
            scene.frame_set(int(float(frame)), subframe=float(frame) % 1)
            display_mesh = bpy.data.objects["Carrier"].evaluated_get(bpy.context.evaluated_depsgraph_get())
            positions = np.empty(len(display_mesh.data.vertices) * 3, dtype=np.float32)
            display_mesh.data.attributes["position"].data.foreach_get("vector", positions)
            matrix = np.array(display_mesh.matrix_world)
            shown[frame] = positions.reshape(-1, 3) @ matrix[2, :3] + matrix[2, 3]
            if rendering == "1":
                shown[f"pixels {frame}"] = pixels(scene, Path(out).with_suffix(".exr"))
        np.savez(out, **shown)
    finally:
        if with_addon == "1":
            bpy.ops.wm.read_factory_settings(use_empty=True)
            softground_addon.unregister()


def pixels(scene: bpy.types.Scene, path: Path) -> np.ndarray:
    """The current frame as it is rendered."""
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    values = np.empty(image.size[0] * image.size[1] * image.channels, dtype=np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values


if __name__ == "__main__":
    {"make": make, "edit": edit, "reset": reset, "play": play}[sys.argv[1]](*sys.argv[2:])
