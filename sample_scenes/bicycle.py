"""A bicycle rolls through wet sand: the hind wheel in the groove of the front wheel, then beside it in the bend."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path

import bpy
import numpy as np

from sample_scenes import plates, production, stage
from sample_scenes.course import Course
from sample_scenes.production import Built, Claim, Options, Walker
from softground_addon.core.record.footprints import recompose

CELL_SIZE = 0.006  # m
FRAMES = 60  # 2.5 s
SPEED = 1.6  # m/s
MASS = 95.0  # kg, with a rider
WHEELBASE, WHEEL, TYRE = 1.02, 0.335, 0.024  # m; radius to the ground, radius of the tyre
WAY = ((0.0, 0.0), (1.6, 0.0), (2.8, 0.35), (4.2, 1.3))  # m


@dataclass(frozen=True)
class Bicycle(Built):
    """The bake and the wheels, the front one first."""

    wheels: list[bpy.types.Object]
    course: Course


def build(scene: bpy.types.Scene, cell_size: float = CELL_SIZE, options: Options | None = None) -> Bicycle:
    """A frame on two wheels, keyed along a way that bends."""
    course = Course(WAY)
    scene.frame_start, scene.frame_end = 1, FRAMES
    frame = _frame(scene.collection)
    wheels = [_wheel(name, frame) for name in ("Front Wheel", "Hind Wheel")]
    wheels[0].location.x = WHEELBASE
    front, hind, rolled = ride(course, scene.render.fps)
    for number in range(FRAMES):
        heading = float(np.arctan2(*(front[number] - hind[number])[::-1]))
        frame.location, frame.rotation_euler.z = (*hind[number], WHEEL), heading
        frame.keyframe_insert("location", frame=number + 1)
        frame.keyframe_insert("rotation_euler", index=2, frame=number + 1)
        steering = float(course.heading(WHEELBASE + rolled[number, 0])) - heading
        for wheel, distance, steered in zip(wheels, rolled[number], (steering, 0.0), strict=True):
            wheel.rotation_euler = (0.0, distance / WHEEL, steered)
            wheel.keyframe_insert("rotation_euler", frame=number + 1)
    chosen = {"shape_keys": "false"} | dict(options or {})
    bicycle = Walker(wheels[0], MASS, with_things=wheels[1:])
    bake = production.bake(scene, [bicycle], "Wet Sand", cell_size, options=chosen)
    return Bicycle({"sand": bake}, wheels, course)


def ride(course: Course, rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Front and hind wheel, (F, 2) each [m], and how far each has rolled, (F, 2) [m].

    The front wheel keeps to the way; the hind wheel is drawn after it and cuts the bend (a tractrix).
    """
    parts = 40
    along = WHEELBASE + SPEED * np.arange((FRAMES - 1) * parts + 1) / (rate * parts)
    front = course.place(along)
    hind = np.empty_like(front)
    hind[0] = course.place(0.0)
    for step in range(1, len(front)):
        drawn = front[step] - hind[step - 1]
        hind[step] = front[step] - WHEELBASE * drawn / np.linalg.norm(drawn)
    rolled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(hind, axis=0), axis=1))])
    return front[::parts], hind[::parts], np.column_stack([along - WHEELBASE, rolled])[::parts]


def _frame(collection: bpy.types.Collection) -> bpy.types.Object:
    """Tubes between hubs, crank, saddle and handlebars; its origin is the hub of the hind wheel."""
    crank, saddle, head = (0.44, 0.0, -0.06), (0.26, 0.0, 0.52), (0.86, 0.0, 0.48)
    hind, front = (0.0, 0.0, 0.0), (WHEELBASE, 0.0, 0.0)
    left, right = (0.78, 0.28, 0.60), (0.78, -0.28, 0.60)
    tubes = [(hind, crank), (hind, saddle), (crank, saddle), (crank, head), (saddle, head), (head, front)]
    tubes += [(left, right), (head, (0.82, 0.0, 0.60)), (saddle, (0.22, 0.0, 0.62))]
    curve = bpy.data.curves.new("Bicycle", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.016
    for ends in tubes:
        spline = curve.splines.new("POLY")
        spline.points.add(1)
        for point, place in zip(spline.points, ends, strict=True):
            point.co = (*place, 1.0)
    curve.materials.append(stage.plain_material("SoftGround Sample enamel", (0.02, 0.12, 0.22), 0.3))
    frame = bpy.data.objects.new("Bicycle", curve)
    collection.objects.link(frame)
    return frame


def _wheel(name: str, frame: bpy.types.Object) -> bpy.types.Object:
    """A tyre that turns about its y axis under the frame, with spokes to look at."""
    bpy.ops.mesh.primitive_torus_add(
        major_radius=WHEEL - TYRE, minor_radius=TYRE, major_segments=128, minor_segments=20, rotation=(pi / 2, 0.0, 0.0)
    )
    wheel = bpy.context.active_object
    bpy.ops.object.transform_apply(rotation=True)
    wheel.name, wheel.parent = name, frame
    wheel.rotation_mode = "YXZ"  # it turns about its axle, which steers
    wheel.data.materials.append(stage.plain_material("SoftGround Sample rubber", (0.02, 0.02, 0.02), 0.7))
    spokes = bpy.data.curves.new(f"{name} Spokes", "CURVE")
    spokes.dimensions, spokes.bevel_depth = "3D", 0.0016
    for angle in np.linspace(0, 2 * pi, 24, endpoint=False):
        spline = spokes.splines.new("POLY")
        spline.points.add(1)
        spline.points[1].co = (*(WHEEL - TYRE) * np.array((np.cos(angle), 0.0, np.sin(angle))), 1.0)
    spokes.materials.append(stage.plain_material("SoftGround Sample steel", (0.6, 0.6, 0.6), 0.3))
    seen = bpy.data.objects.new(spokes.name, spokes)
    bpy.context.scene.collection.objects.link(seen)
    seen.parent = wheel
    return wheel


def claims(built: Bicycle) -> list[Claim]:
    """One groove without gaps, about as deep all along, and two where the way bends."""
    bake = built.bakes["sand"]
    ground = recompose(bake.footprints)
    size = bake.footprints[0].cell_size

    def groove(low: float, high: float) -> np.ndarray:
        along = np.arange(low, high, size / 2)
        return ground.sample(*built.course.place(along).T)[0]

    once, twice = groove(0.3, 0.9), groove(1.15, 1.55)
    across = np.linspace(-0.3, 0.3, 601)
    straight, bend = (ground.sample(*built.course.place(place, across).T)[0] > 1e-3 for place in (0.6, 3.2))
    forces = [max(s.peak_force_n for s in bake.footprints if s.sole == wheel.name) for wheel in built.wheels]
    return [
        Claim("Part of the straight on which there is a groove", float((twice > 1e-3).mean()), 1.0, 1.0),
        Claim("Spread of its depth over its depth", float(twice.std() / twice.mean()), 0.0, 0.12),
        Claim("Depth behind both wheels over that behind one", float(twice.mean() / once.mean()), 1.0, 1.9),
        Claim("Width of the groove over that of the tyre", float(straight.sum() * 1e-3 / (2 * TYRE)), 0.4, 1.6),
        Claim("Width of both tracks in the bend over one", float(bend.sum() / straight.sum()), 1.3, 2.3),
        Claim("Largest forces on both wheels over the weight", sum(forces) / (MASS * 9.81), 0.95, 1.6),
    ]


def shoot(built: Bicycle, folder: Path, _samples: int) -> list[Path]:
    """The track from above."""
    return [plates.draw_plate({"": built.bakes["sand"].footprints}, folder / "bicycle.png")]


if __name__ == "__main__":
    production.main(__name__)
