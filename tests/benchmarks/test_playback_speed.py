"""What a frame of a baked shot costs, against the bare shot, Dynamic Paint and a point cache; ratios from one run.

All on the same walking character, with a skin of about 28,000 vertices. What is compared plays in turns, and of each
frame the least time counts: the clock's, which is what an artist waits for. The processor's would count Blender's
threads where they wait for work as well.
"""

import time
from dataclasses import dataclass
from math import inf

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from softground_addon.blender.ground import baked_ground, ground_mesh, trail_detail
from softground_addon.blender.playback import playback
from tests.benchmarks.bars import below
from tests.blender import shots

pytestmark = pytest.mark.benchmark

FRAMES = 170
SIZE = 12.0
SKIN_VERTICES = 28_000
TURNS = 3
TIMED = np.random.default_rng(0).permutation(np.arange(2, FRAMES))[:40]


def heavy_walker(scene, frames=FRAMES):
    """The project's walker with a skin as heavy as a production character's."""
    import bmesh  # only there once bpy is

    armature = shots.walker(scene, frames=frames, coarseness=1.0)
    skins = [child for child in armature.children if child.type == "MESH"]
    while sum(len(skin.data.vertices) for skin in skins) < SKIN_VERTICES / 2:
        for skin in skins:
            finer = bmesh.new()
            finer.from_mesh(skin.data)
            bmesh.ops.subdivide_edges(finer, edges=finer.edges, cuts=1, use_grid_fill=True)
            finer.to_mesh(skin.data)
            finer.free()
    scene.frame_start, scene.frame_end = 1, frames
    bpy.context.view_layer.objects.active = armature
    return armature, max(skins, key=lambda skin: len(skin.data.vertices))


def grid(scene, count, size=SIZE, name="Field"):
    axis = np.linspace(-1.0, size - 1.0, count, dtype=np.float32)
    position = np.zeros((count, count, 3), dtype=np.float32)
    position[..., 0], position[..., 1] = axis, (axis - size / 2 + 1)[:, None]
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    quads = (corner[:, None] + [0, 1, count + 1, count]).astype(np.int32)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(count**2)
    mesh.attributes["position"].data.foreach_set("vector", position.ravel())
    mesh.loops.add(quads.size)
    mesh.loops.foreach_set("vertex_index", quads.ravel())
    mesh.polygons.add(len(quads))
    mesh.polygons.foreach_set("loop_start", np.arange(len(quads), dtype=np.int32) * 4)
    mesh.update(calc_edges=True)
    mesh.shade_smooth()
    ground = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(ground)
    return ground


@dataclass(frozen=True)
class Cost:
    """Milliseconds of a frame, without and with the vertex normals of the ground."""

    frame: float
    with_normals: float


def times(scene, shown, frames=TIMED):
    """Seconds of each frame, without and with the normals, (F, 2); apart, as the next frame frees what one made."""
    return np.stack([played(scene, shown, frames, normals) for normals in (False, True)], axis=-1)


def played(scene, shown, frames, normals):
    """Seconds of each frame, (F,)."""
    taken = []
    for frame in frames:
        start = time.perf_counter()
        scene.frame_set(int(frame))
        if normals and shown is not None:
            mesh = shown.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
            mesh.vertex_normals[0].vector  # noqa: B018  (computes them)
        taken.append(time.perf_counter() - start)
    return np.array(taken)


def cost_of(turns):
    """Of each frame the least time of all turns; the mean of that."""
    return Cost(*(np.min(turns, axis=0).mean(axis=0) * 1e3).tolist())


def in_turns(contestants):
    """The costs of what plays in turns, by name: functions that set themselves up and give their times."""
    turns = [{name: play() for name, play in contestants.items()} for _ in range(TURNS)]
    return {name: cost_of([turn[name] for turn in turns]) for name in contestants}


def dynamic_paint(scene, ground, brush):
    """Times of Blender's own displacement of the ground by the same character, while it plays."""
    canvas = ground.modifiers.new("Dynamic Paint", "DYNAMIC_PAINT")
    canvas.ui_type = "CANVAS"
    with bpy.context.temp_override(object=ground, active_object=ground):
        bpy.ops.dpaint.type_toggle(type="CANVAS")
    surface = canvas.canvas_settings.canvas_surfaces[0]
    surface.surface_type = "DISPLACE"
    surface.frame_start, surface.frame_end = 1, scene.frame_end
    painter = brush.modifiers.new("Dynamic Paint", "DYNAMIC_PAINT")
    painter.ui_type = "BRUSH"
    with bpy.context.temp_override(object=brush, active_object=brush):
        bpy.ops.dpaint.type_toggle(type="BRUSH")
    taken = times(scene, ground, np.arange(1, 31))
    ground.modifiers.remove(canvas)
    brush.modifiers.remove(painter)
    return taken


def bake(scene, ground, *, detail, cell_size=0.01, shape_keys=False):
    """Bake onto a ground; returns the object that carries the prints, and the report."""
    options = scene.softground
    if not options.characters:
        bpy.ops.softground.add_character()
    options.ground, options.cell_size, options.detail, options.shape_keys = ground, cell_size, detail, shape_keys
    options.frame_start, options.frame_end = scene.frame_start, scene.frame_end
    bpy.context.view_layer.update()
    result = jobs.run(bake_job.bake(scene))
    return baked_ground.display_mesh_of(ground), result.report


def set_shading(display_mesh, shading):
    """Let the shading attributes follow the time, or play the heights only: what compares with what the others do."""
    modifier = playback.modifier_of(display_mesh)
    socket = next(item for item in modifier.node_group.interface.items_tree if item.name == "Shading")
    modifier[socket.identifier] = shading
    display_mesh.update_tag()


@pytest.mark.parametrize(("count", "limit"), [(512, 1.6), (1024, 2.8)])
def test_a_uniform_grid_plays_near_the_bare_frame_and_faster_than_dynamic_paint(scene, count, limit):
    _, skin = heavy_walker(scene)
    painted, baked, keyed = (grid(scene, count, name=name) for name in ("Painted", "Baked", "Keyed"))
    bake(scene, keyed, detail="NEVER", shape_keys=True)
    bake(scene, baked, detail="NEVER")

    def alone(ground):
        for other in (painted, baked, keyed):
            other.hide_viewport = other != ground
        bpy.context.view_layer.update()

    def bare():
        alone(None)
        return times(scene, None)

    def paint():
        alone(painted)
        return dynamic_paint(scene, painted, skin)

    def play(ground, shading):
        alone(ground)
        set_shading(ground, shading=shading)
        return times(scene, ground)

    contestants = {
        "bare": bare,
        "Dynamic Paint": paint,
        "playback": lambda: play(baked, False),
        "playback, shading": lambda: play(baked, True),
        "playback, shading, shape keys": lambda: play(keyed, True),
    }
    rows = in_turns(contestants)
    shaded, painting = rows["playback, shading"].frame, rows["Dynamic Paint"].frame
    below(f"playback on {count}² over Dynamic Paint", shaded / painting, 0.4)
    for name, most in (("playback", limit), ("playback, shading", inf), ("playback, shading, shape keys", inf)):
        below(f"{name} on {count}² over the bare frame", rows[name].frame / rows["bare"].frame, most)


def test_detail_along_the_trail_plays_near_the_bare_frame_whatever_the_size_of_the_ground(scene):
    _, skin = heavy_walker(scene, 640)
    fine = grid(scene, 1024, name="Fine")
    painted = cost_of([dynamic_paint(scene, fine, skin)])
    bpy.data.objects.remove(fine)
    for size in (100.0, 1000.0):
        rows = detail_costs(scene, size)
        bare = rows.pop("bare").frame
        for name, row in rows.items():
            below(f"{name} on {size:.0f} m over the bare frame", row.frame / bare, 1.3 if name == "trail" else inf)
        over_paint = rows["trail"].with_normals / painted.with_normals
        below(f"trail on {size:.0f} m with normals over Dynamic Paint", over_paint, 0.1)


def detail_costs(scene, size):
    """Costs of a walk on a plane of some size, in turns: bare, and baked with all that is on by default or without."""
    ground = grid(scene, 2, size, f"Plane {size:.0f}")
    sizes = {}
    for shape_keys in (True, False):
        display_mesh, _ = bake(scene, ground, detail="AUTO", shape_keys=shape_keys)
        sizes[shape_keys] = display_mesh.copy()
        del sizes[shape_keys][trail_detail.DETAIL_OF]  # so that it stays when the bake is cleared
        bpy.ops.softground.clear_bake()
        scene.collection.objects.link(sizes[shape_keys])
    bpy.data.objects.remove(ground)

    def play(shown, shading):
        for display_mesh in sizes.values():
            display_mesh.hide_viewport = display_mesh != shown
        bpy.context.view_layer.update()
        if shown is not None:
            set_shading(shown, shading)
        return times(scene, shown)

    rows = in_turns(
        {
            "bare": lambda: play(None, False),
            "trail": lambda: play(sizes[False], False),
            "trail, shading": lambda: play(sizes[False], True),
            "trail, shading, shape keys": lambda: play(sizes[True], True),
        }
    )
    for display_mesh in sizes.values():
        mesh = display_mesh.data
        bpy.data.objects.remove(display_mesh)
        bpy.data.meshes.remove(mesh)
    return rows


def test_the_cost_of_a_bake_does_not_depend_on_the_size_of_the_ground(scene):
    heavy_walker(scene, 640)
    seconds = {}
    for size in (100.0, 1000.0, 100.0, 1000.0):
        ground = grid(scene, 2, size, f"Plane {size:.0f}")
        started = time.perf_counter()
        bake(scene, ground, detail="AUTO", cell_size=0.005)
        seconds.setdefault(size, []).append(time.perf_counter() - started)
        bpy.ops.softground.clear_bake()
        bpy.data.objects.remove(ground)
    difference = abs(min(seconds[1000.0]) / min(seconds[100.0]) - 1.0)
    below("difference of a bake on 1 km from one on 100 m", 100 * difference, 25, "%")


def test_the_file_grows_by_little_with_each_step(scene, tmp_path):
    ground = grid(scene, 2, 200.0, "Plane")
    sizes, steps, records = [], [], []
    for frames in (160, 640):
        for thing in list(scene.objects):
            if thing != ground:
                bpy.data.objects.remove(thing)
        scene.softground.characters.clear()
        heavy_walker(scene, frames)
        path = tmp_path / f"{frames}.blend"
        bpy.context.view_layer.update()
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
        without = path.stat().st_size
        display_mesh, report = bake(scene, ground, detail="AUTO")
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
        sizes.append(path.stat().st_size - without)
        steps.append(report["totals"]["steps"])
        records.append(len(bytes(display_mesh.data[ground_mesh.RECORD])))
        bpy.ops.softground.clear_bake()
    per_step = (sizes[1] - sizes[0]) / (steps[1] - steps[0])
    record_per_step = (records[1] - records[0]) / (steps[1] - steps[0])
    below("growth of the file for each step", per_step / 1e3, 150, "KB")
    below("growth of the record for each step", record_per_step / 1e3, 40, "KB")
