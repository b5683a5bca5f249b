"""`make demo`: somebody walks over snow, dry sand, mud and soil; the shot, its pictures and a table in build/demo.

    python -m sample_scenes.demo [--motion FILE.bvh --scale 0.01] [--output DIR]

The prints are made as a user makes them: Add Character, Load Preset, Create Ground, Bake.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from math import cos, pi, radians, sin
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import stage
from sample_scenes.body import Body
from sample_scenes.character import copy_character, create_character
from sample_scenes.four_grounds import close_up_of
from sample_scenes.gait import Gait, walk
from sample_scenes.keys import write_action
from sample_scenes.production import addon
from sample_scenes.stick_figure import add_stick_figure
from softground_addon.blender.ground import ground_mesh
from softground_addon.core.record import record
from softground_addon.core.record.footprints import Footprint

PRESETS = ("Snow", "Dry Sand", "Mud", "Soil")

WALK_FRAMES = 84  # 3.5 s: six or seven steps
_GAP = 0.6  # m between neighbouring grounds at most: each ends on its own coarse grid, up to 0.3 m further out
_CLOSE_UP = (640, 480)
_OVERVIEW = (1024, 576)


@dataclass(frozen=True)
class Lane:
    """One ground with who walked on it."""

    preset: str
    armature: bpy.types.Object
    ground: bpy.types.Object
    footprints: tuple[Footprint, ...]
    seconds: float

    @property
    def slug(self) -> str:
        """The preset in a file name."""
        return self.preset.lower().replace(" ", "_")


def main(arguments: list[str]) -> int:
    """Build the demo; returns the exit code of the process."""
    options = _parser().parse_args(arguments)
    if options.motion and not options.motion.is_file():
        print(f"demo: there is no file '{options.motion}'.", file=sys.stderr)
        return 2
    if not options.scale > 0:
        print(f"demo: the scale is {options.scale:g}; it must be greater than 0.", file=sys.stderr)
        return 2
    started = time.perf_counter()
    with addon():
        try:
            lanes = build(options.motion, options.scale, options.up, options.cell_size)
        except RuntimeError as error:  # how an operator reports what is wrong with its input
            print(f"demo: {str(error).strip()}", file=sys.stderr)
            return 2
        options.output.mkdir(parents=True, exist_ok=True)
        print_table(lanes)
        blend = options.output / "demo.blend"
        dress(lanes, with_sticks=options.motion is not None)
        bpy.ops.wm.save_as_mainfile(filepath=str(blend.resolve()), compress=True)
        pictures = [] if options.no_pictures else take_pictures(lanes, options.output, options.samples)
    print(f"\n{blend}")
    for picture in pictures:
        print(picture)
    print(f"{time.perf_counter() - started:.0f} s in all")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m sample_scenes.demo", description="Footprints on four grounds.")
    parser.add_argument("--motion", type=Path, metavar="FILE.bvh", help="walk as in this motion file")
    parser.add_argument("--scale", type=float, default=0.01, metavar="S", help="metres per unit of the motion file")
    parser.add_argument("--up", choices=("Y", "Z"), help="up axis of the motion file (default: the body's long axis)")
    parser.add_argument("--output", type=Path, default=Path("build/demo"), metavar="DIR")
    parser.add_argument("--cell-size", type=float, metavar="M", help="size of the cells (default: fits the soles)")
    parser.add_argument("--samples", type=int, default=20, metavar="N", help="render samples of the pictures")
    parser.add_argument("--no-pictures", action="store_true", help="bake and save only")
    return parser


def build(motion: Path | None, scale: float, up: str | None, cell_size: float | None) -> list[Lane]:
    """Bake the same walk on each preset, side by side in the open file."""
    scene = bpy.context.scene
    walker = import_motion(motion, scale, up) if motion else create_walker(scene)
    first = bake_lane(scene, walker, PRESETS[0], cell_size)
    low, high = stage.bounds([first.ground])
    across = int(np.argmin((high - low)[:2]))  # lanes lie side by side along their short axis
    lanes = [first]
    for number, preset in enumerate(PRESETS[1:], start=1):
        twin = copy_character(walker, f"{walker.name} {preset}", scene.collection)
        twin.location[across] += number * ((high - low)[across] + _GAP)
        lanes.append(bake_lane(scene, twin, preset, cell_size))
    return lanes


def create_walker(scene: bpy.types.Scene) -> bpy.types.Object:
    """The project's own hiker, walking."""
    body = Body()
    walker = create_character("Hiker", body, scene.collection)
    write_action(walker, walk(body, Gait(), WALK_FRAMES, scene.render.fps), "Walk")
    scene.frame_start, scene.frame_end = 1, WALK_FRAMES
    return walker


def import_motion(path: Path, scale: float, up: str | None) -> bpy.types.Object:
    """The rig of a motion file, with the scene's frame range and rate set to it."""
    forward = {"Y": "-Z", "Z": "Y"}

    def read(axis: str) -> bpy.types.Object:
        try:
            bpy.ops.import_anim.bvh(
                filepath=str(path.resolve()),
                global_scale=scale,
                axis_forward=forward[axis],
                axis_up=axis,
                update_scene_fps=True,
                update_scene_duration=True,
            )
        except RuntimeError:  # Blender's importer ends with a traceback
            raise RuntimeError(f"'{path}' cannot be read as BVH: it is cut short, or of another kind.") from None
        return bpy.context.active_object

    rig = read(up or "Y")
    heads = np.array([bone.head for bone in rig.pose.bones])
    depth, height = np.ptp(heads, axis=0)[1:]
    if up is None and depth > height:  # it lies on its back: the file's long axis is Z
        bpy.data.objects.remove(rig)
        rig = read("Z")
    return rig


def bake_lane(
    scene: bpy.types.Scene, walker: bpy.types.Object, preset: str, cell_size: float | None, margin: float = 0.0
) -> Lane:
    """Set up and bake one ground, as a user does it in the panel."""
    started = time.perf_counter()
    settings = scene.softground
    settings.ground = None
    settings.characters.clear()
    settings.ground_margin = margin  # at 0 they lie side by side
    if cell_size:
        settings.cell_size = cell_size
    bpy.ops.object.select_all(action="DESELECT")
    walker.select_set(True)
    bpy.context.view_layer.objects.active = walker
    bpy.ops.softground.add_character()
    bpy.ops.softground.load_preset(name=preset)
    bpy.ops.softground.create_ground()
    bpy.ops.softground.bake()
    ground = settings.ground
    ground.name = f"{preset} Ground"
    footprints = record.load(ground_mesh.mesh_of(ground)[ground_mesh.RECORD]).footprints
    return Lane(preset, walker, ground, tuple(footprints), time.perf_counter() - started)


def print_table(lanes: list[Lane]) -> None:
    """What the bakes did, one line per ground."""
    print(
        f"\n{'ground':<10}{'steps':>6}{'peak force':>12}{'depth':>9}{'rim':>9}{'pressed':>10}{'raised':>10}{'time':>8}"
    )
    for lane in lanes:
        prints = lane.footprints
        mesh = ground_mesh.mesh_of(lane.ground)
        rim = np.empty(len(mesh.vertices), dtype=np.float32)
        mesh.attributes[ground_mesh.RIM].data.foreach_get("value", rim)
        print(
            f"{lane.preset:<10}{len(prints):>6}{max(step.peak_force_n for step in prints):>10.0f} N"
            f"{max(step.max_depth_m for step in prints) * 100:>6.1f} cm{rim.max() * 100:>6.1f} cm"
            f"{sum(step.compressed_m3 for step in prints) * 1e3:>8.2f} l"
            f"{sum(step.rim_m3 for step in prints) * 1e3:>8.2f} l{lane.seconds:>6.1f} s"
        )


def dress(lanes: list[Lane], *, with_sticks: bool) -> None:
    """Light, floor, trays and camera for the grounds, and bodies for rigs without one; at the end of the walk."""
    scene = bpy.context.scene
    scene.frame_set(scene.softground.frame_end)
    stage.set_up_rendering(scene)
    scene.render.resolution_x, scene.render.resolution_y = _OVERVIEW  # a camera is fitted to the picture's shape
    stage.add_sun(scene, travel_direction(lanes[0]) - radians(75))
    for lane in lanes:
        stage.add_tray(lane.ground, scene.collection)
        if with_sticks:
            add_stick_figure(lane.armature, scene.collection)
    low, _ = stage.bounds([lane.ground for lane in lanes])
    stage.add_floor(low[2] - 0.1, scene.collection)
    camera = stage.add_camera(scene, "Overview", lens=50.0)
    stage.frame_points(camera, _points_to_show(lanes), _looking(travel_direction(lanes[0]) + radians(50), radians(-22)))
    scene.camera = camera


def travel_direction(lane: Lane) -> float:
    """Where the walk goes [rad]: from the first print to the last, or where the feet point if it goes nowhere."""
    places = np.array([step.position for step in lane.footprints])
    way = places[-1, :2] - places[0, :2]
    if np.linalg.norm(way) < 0.5:
        way = np.mean([(cos(step.heading), sin(step.heading)) for step in lane.footprints], axis=0)
    return stage.heading_of(way)


def take_pictures(lanes: list[Lane], folder: Path, samples: int) -> list[Path]:
    """The overview and a close-up of one print on each ground."""
    scene = bpy.context.scene
    bodies = [child for lane in lanes for child in lane.armature.children]
    pictures = [folder / "overview.png"]
    stage.render(scene, scene.camera, pictures[0], _OVERVIEW, samples)
    for body in bodies:
        body.hide_render = True  # their long shadows would fall on the prints
    camera = stage.add_camera(scene, "Close-up", lens=50.0)
    for lane in lanes:
        step = close_up_of(lane.footprints)
        ahead = _looking(step.heading, 0.0)
        aside = _looking(step.heading - pi / 2, 0.0)
        reach = np.sqrt(step.area_m2) * 2.0  # length of the foot, about
        scale = stage.add_scale(step.position + 0.62 * reach * aside, step.heading, scene.collection)
        target = step.position + 0.10 * reach * aside
        stage.aim(camera, target + reach * (-2.15 * ahead + 0.45 * aside + np.array((0.0, 0.0, 1.75))), target)
        pictures.append(folder / f"{lane.slug}.png")
        stage.render(scene, camera, pictures[-1], _CLOSE_UP, samples)
        bpy.data.objects.remove(scale)
    return pictures


def _looking(heading: float, pitch: float) -> np.ndarray:
    return np.array((cos(pitch) * cos(heading), cos(pitch) * sin(heading), sin(pitch)))


def _points_to_show(lanes: list[Lane]) -> np.ndarray:
    """The grounds to the corners of their trays, and the bones with the flesh around them."""
    low, high = stage.bounds([lane.ground for lane in lanes])
    corners = np.array([(x, y, low[2] - 0.16) for x in (low[0], high[0]) for y in (low[1], high[1])])
    bones = np.array(
        [
            lane.armature.matrix_world @ end
            for lane in lanes
            for bone in lane.armature.pose.bones
            for end in (bone.head, bone.tail)
        ]
    )
    flesh = [(0.0, 0.0, 0.15), (0.15, 0.15, 0.0), (-0.15, -0.15, 0.0)]
    return np.concatenate([corners] + [bones + offset for offset in flesh])


if __name__ == "__main__":
    code = main(sys.argv[1:])
    sys.stdout.flush()
    sys.exit(code)
