"""The figures of docs/response.md: `python -m tests.validation.response_figures [rough] [deep] [rigs]`.

Needs matplotlib for the curves, and Blender's Cycles for the strips.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import numpy as np

import softground_addon
from sample_scenes.stick_figure import add_stick_figure
from softground_addon.core.response.tilt import AUTHORS_TORQUES, PAPER_TORQUES, TiltGains, body_gains, lean
from tests.blender import responders, rigs, shots
from tests.core.response.test_tilt import torques

IMAGES = Path(__file__).parents[2] / "docs" / "images"
WIDTH, HEIGHT = 300, 420


def tilt_curves() -> None:
    """What the two gains do, and that neither the frame rate nor the size of the body matters."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 3, figsize=(12, 3.4), sharey=True)

    def run(gains: TiltGains, rate: float = 120.0, seconds: float = 8.0) -> tuple[np.ndarray, np.ndarray]:
        times = np.arange(round(seconds * rate) + 1) / rate
        slope = np.radians(12.0) * np.clip((times - 0.5) / 0.4, 0, 1)
        slope -= np.radians(24.0) * np.clip((times - 4.5) / 0.4, 0, 1)
        return times, np.degrees(lean(np.stack([slope, 0 * slope], axis=-1), frame_rate=rate, gains=gains)[:, 0])

    for frequency in (0.3, 0.6, 1.2):
        axes[0].plot(*run(TiltGains(frequency, 0.85)), label=f"{frequency} Hz")
    axes[0].set_title("frequency, at damping 0.85")
    for damping in (0.2, 0.5, 0.85, 1.5):
        axes[1].plot(*run(TiltGains(0.6, damping)), label=f"damping {damping}")
    axes[1].set_title("damping, at 0.6 Hz")
    for label, mass, arm in (("mouse", 0.03, 0.03), ("adult", 77.5, 1.0), ("giant", 2000.0, 3.0)):
        gains = TiltGains()
        alpha, beta = torques(gains, mass * arm**2, arm)
        axes[2].plot(*run(TiltGains.from_torques(alpha, beta, inertia=mass * arm**2, arm=arm)), label=label)
    axes[2].plot(*run(TiltGains(), rate=24), "k:", label="24 fps")
    axes[2].plot(*run(body_gains(*AUTHORS_TORQUES, mass=77.5, arm=1.0)), "--", label="paper's scene")
    axes[2].plot(*run(body_gains(*PAPER_TORQUES, mass=77.5, arm=1.0)), "--", label="paper as printed")
    axes[2].set_title("size, frame rate, the paper's gains")
    for axis in axes:
        axis.set_xlabel("time (s): level, 12° up, 12° down")
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    axes[0].set_ylabel("lean (°)")
    figure.tight_layout()
    figure.savefig(IMAGES / "response_tilt.png", dpi=110)


def rough(y: np.ndarray, x: np.ndarray) -> np.ndarray:
    return 0.035 * np.sin(4.1 * x + 1) * np.sin(3.3 * y) + 0.02 * np.sin(9 * x + 2 * y) * np.sin(8 * y + 2)


def strip(name: str, shape, frames: list[int], **settings: float) -> None:
    """Frames of a walk as it was made (above) and as it responds (below)."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    shots.walker(scene, frames=96, coarseness=1.0)
    rows = _baked_and_shown(shape, frames, **settings)
    _save(name, np.concatenate([np.concatenate(row, axis=1) for row in rows[::-1]], axis=0))


def of_rigs(name: str) -> None:
    """A frame each of a Rigify human, a rig under Mixamo's names and a captured motion, as made and as they respond."""
    columns = []
    for make, frame in ((_rigify, 30), (_mixamo, 30), (_captured, 252)):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        make()
        (made,), (responding,) = _baked_and_shown(rough, [frame], modulus=6e5)
        columns.append(np.concatenate([responding, made], axis=0))
    _save(name, np.concatenate(columns, axis=1))


def _rigify() -> None:
    path = Path(bpy.app.tempdir) / "human.blend"
    rigs.make_rigify_file(path)
    armature = rigs.open_rigify(path, "Generated")
    bpy.data.objects.remove(bpy.data.objects["Metarig"])
    responders.key_steps(armature, "torso", ["foot_ik.L", "foot_ik.R"])
    limbs = ("spine", "shoulder", "upper_arm", "forearm", "hand", "thigh", "shin", "foot", "toe")
    shown = [b.name for b in armature.data.bones if b.name.startswith("DEF-") and b.name[4:].split(".")[0] in limbs]
    add_stick_figure(armature, bpy.context.scene.collection, shown)
    bpy.context.view_layer.objects.active = armature


def _mixamo() -> None:
    responders.as_mixamo(shots.walker(bpy.context.scene, coarseness=1.0))


def _captured() -> None:
    add_stick_figure(shots.import_motion("zombie"), bpy.context.scene.collection)


def _baked_and_shown(shape, frames: list[int], modulus: float = 2e5, **settings: float) -> list[list[np.ndarray]]:
    """The active rig on soft ground of a shape along its way: pictures of frames as made, and as it responds."""
    scene, armature = bpy.context.scene, bpy.context.view_layer.objects.active
    bpy.ops.softground.add_character()
    motion = responders.source_motion(scene)
    hips = motion.joints["hips"]
    ahead = (hips[-1] - hips[0])[:2] / np.linalg.norm((hips[-1] - hips[0])[:2])
    level = float(np.percentile([sole.landmark_positions()[..., 2].min(axis=1) for sole in motion.soles], 10.0))
    middle = hips[np.searchsorted(motion.frames, np.mean(frames))]
    x, y = np.linspace(-2.6, 2.6, 261), np.linspace(-4.2, 4.2, 421)
    ground = _field(scene, x + middle[0], y + middle[1], lambda y, x: level + shape(y, x))
    options = scene.softground
    options.ground = ground
    options.frame_end = min(options.frame_end, max(frames) + 24)
    options.tilt.use = options.grounding.use = True
    options.material.youngs_modulus = modulus
    for setting, value in settings.items():
        setattr(options.grounding, setting, value)
    bpy.ops.softground.bake()
    camera = _stage(scene)
    mapping = responders.mapping_of(options.characters[0])
    rows = []
    for strength in (0.0, 1.0):
        options.characters[0].response_strength = strength
        row = []
        for frame in frames:
            scene.frame_set(frame)
            hips_bone = armature.pose.bones[mapping.joints["hips"][0]]
            place = armature.matrix_world @ hips_bone.head
            height = level + float(shape(np.array(place.y), np.array(place.x)))
            look = place.__class__((place.x, place.y, height + 0.75))
            aside = place.__class__((-ahead[1], ahead[0], 0.0)) * 4.2 + place.__class__((*ahead, 0.0)) * 0.6
            camera.location = look + aside + place.__class__((0.0, 0.0, 0.55))
            camera.rotation_euler = (look - camera.location).to_track_quat("-Z", "Y").to_euler()
            row.append(_rendered(scene))
        rows.append(row)
    return rows


def _save(name: str, picture: np.ndarray) -> None:
    image = bpy.data.images.new(name, picture.shape[1], picture.shape[0])
    image.pixels.foreach_set(picture.astype(np.float32).ravel())  # Blender's rows go up
    image.filepath_raw, image.file_format = str(IMAGES / f"{name}.jpg"), "JPEG"
    image.save()


def _field(scene, x, y, shape):
    across, along = np.meshgrid(x, y)
    points = np.stack([across, along, shape(along, across)], axis=-1).reshape(-1, 3)
    corner = (np.arange(len(y) - 1)[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    mesh = bpy.data.meshes.new("Field")
    mesh.from_pydata(points, [], (corner[:, None] + [0, 1, len(x) + 1, len(x)]).tolist())
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    material = bpy.data.materials.new("Soil")
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (0.42, 0.34, 0.25, 1.0)
    shader.inputs["Roughness"].default_value = 0.9
    mesh.materials.append(material)
    ground = bpy.data.objects.new("Field", mesh)
    scene.collection.objects.link(ground)
    return ground


def _stage(scene):
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3.5, (0.9, 0.25, 0.6)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 58
    for thing in (sun, camera):
        scene.collection.objects.link(thing)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("Sky")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.5, 0.6, 0.75, 1.0)
    scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0.6
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 16, False
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    return camera


def _rendered(scene) -> np.ndarray:
    path = Path(bpy.app.tempdir) / "frame.png"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    pixels = np.empty(WIDTH * HEIGHT * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(HEIGHT, WIDTH, 4)


def main() -> int:
    tilt_curves()
    softground_addon.register()
    try:
        wanted = sys.argv[1:] or ["rough", "deep", "rigs"]
        if "rough" in wanted:
            strip("response_rough", rough, [20, 26, 32, 38])
        if "deep" in wanted:
            strip("response_deep", lambda y, x: 0 * x * y, [20, 26, 32, 38], knee_lift=1.0, arms=1.0, crouch=1.0)
        if "rigs" in wanted:
            of_rigs("response_rigs")
    finally:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        softground_addon.unregister()
    return 0


if __name__ == "__main__":
    sys.exit(main())
