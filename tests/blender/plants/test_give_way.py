"""Give Way: scatters of all kinds bend under the soles of a bake, by one modifier that plays without the add-on."""

import subprocess
import sys

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree

from softground_addon.blender import compat, jobs, mesh_arrays
from softground_addon.blender.baking import bake_report, step_edits
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.nodes.node_modifiers import inputs_of
from softground_addon.blender.plants import give_way_nodes, litter_nodes, trampling_layout, trampling_table
from softground_addon.blender.playback import own_data
from softground_addon.core.plants.bending import MOST_LASTING, PLANTS
from softground_addon.core.plants.tramplings import tramplings
from softground_addon.core.record.edits import StepEdit, step_id
from tests.blender import fingerprints, shots
from tests.blender.grounds import bake, plane

HEIGHT, POINTS, RATE = 0.3, 5, 24.0


def walked(scene):
    shots.walker(scene, frames=48)
    bpy.ops.softground.add_character()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    give_way_nodes.ensure_group().use_fake_user = True  # which takes seconds to build


@pytest.fixture
def shot(opened_as):
    scene = opened_as(walked)
    scene.frame_set(1)
    return scene


def roots(count=400, seed=0):
    """Roots within the trail; the first is under the middle of the second step, the second far away."""
    chance = np.random.default_rng(seed)
    place = np.column_stack([chance.uniform(-0.3, 0.3, count), chance.uniform(-2.5, 0.3, count), np.zeros(count)])
    step = baked_ground.load(bpy.context.scene.softground.ground)[0][1]
    place[0], place[1] = (*step.position[:2], 0.0), (3.0, 3.0, 0.0)
    return place


def linked(name, data):
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def hair(place):
    """Upright hair curves."""
    data = bpy.data.hair_curves.new("Grass")
    data.add_curves([POINTS] * len(place))
    up = np.linspace(0.0, HEIGHT, POINTS)[None, :, None] * np.array((0.0, 0.0, 1.0))
    data.attributes["position"].data.foreach_set("vector", (place[:, None] + up).astype(np.float32).ravel())
    return linked("Grass", data)


def scattered(place):
    """Instances of an upright blade on points, by nodes of the user's own."""
    mesh = bpy.data.meshes.new("Blade")
    mesh.from_pydata([(-0.01, 0, 0), (0.01, 0, 0), (0, 0, HEIGHT)], [], [(0, 1, 2)])
    blade = bpy.data.objects.new("Blade", mesh)
    points = bpy.data.meshes.new("Points")
    points.from_pydata(place.tolist(), [], [])
    obj = linked("Scatter", points)
    tree = bpy.data.node_groups.new("Mine", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    given, out, on, info = (
        tree.nodes.new(kind)
        for kind in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo")
    )
    info.inputs["Object"].default_value = blade
    info.inputs["As Instance"].default_value = True
    tree.links.new(given.outputs[0], on.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], on.inputs["Instance"])
    tree.links.new(on.outputs[0], out.inputs[0])
    obj.modifiers.new("Mine", "NODES").node_group = tree
    return obj


def loose(place):
    """One mesh of blades that are not joined, each of four vertices."""
    corners = np.array([(-0.01, 0, 0), (0.01, 0, 0), (0.005, 0, HEIGHT), (-0.005, 0, HEIGHT)])
    mesh = bpy.data.meshes.new("Blades")
    faces = np.arange(4 * len(place)).reshape(-1, 4)
    mesh.from_pydata((place[:, None] + corners).reshape(-1, 3).tolist(), [], faces.tolist())
    return linked("Blades", mesh)


KINDS = {"curves": hair, "instances": scattered, "loose parts": loose}


def give_way(*objects, kind="MEADOW"):
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    assert bpy.ops.softground.give_way(kind=kind) == {"FINISHED"}
    return objects[0].modifiers[-1]


def set_input(modifier, name, value):
    compat.write_input(modifier, inputs_of(modifier)[name], value)
    modifier.id_data.update_tag()


def blades(obj):
    """Roots and tips (N, 3) of a scatter as it is evaluated."""
    graph = bpy.context.evaluated_depsgraph_get()
    if obj.modifiers and obj.name == "Scatter":
        matrices = [i.matrix_world.copy() for i in graph.object_instances if i.parent and i.parent.original == obj]
        return tuple(np.array([m @ Vector((0, 0, height)) for m in matrices]) for height in (0.0, HEIGHT))
    data = obj.evaluated_get(graph).data
    position = data.attributes["position"].data
    flat = np.empty(3 * len(position), np.float32)
    position.foreach_get("vector", flat)
    each = flat.reshape(-1, POINTS if obj.type == "CURVES" else 4, 3).astype(float)
    if obj.type == "CURVES":
        return each[:, 0], each[:, -1]
    return each[:, :2].mean(axis=1), each[:, 2:].mean(axis=1)


def angles(obj):
    """Angle from upright of each blade [°]."""
    way = np.subtract(*blades(obj)[::-1])
    return np.degrees(np.arctan2(np.hypot(way[:, 0], way[:, 1]), way[:, 2]))


def go_to(scene, frame):
    scene.frame_set(int(np.floor(frame)), subframe=frame % 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_at_chosen_roots_it_is_the_closed_form(shot, kind):
    place = roots()
    obj = KINDS[kind](place)
    plant = PLANTS["MEADOW"][1]
    give_way(obj)
    table = tramplings(baked_ground.load(shot.softground.ground)[0])
    number = table.latest(*place[:1, :2].T)[0]
    start, end, lasting = (getattr(table.by, name)[number] for name in ("start", "end", "lasting"))
    go_to(shot, 0.5 * (start + end))
    assert angles(obj)[0] == pytest.approx(90.0, abs=0.01)
    root, tip = (part[0] for part in blades(obj))
    assert (tip - root) @ (0.0, -1.0, 0.0) > 0.9 * HEIGHT  # the walk goes there
    low = 90.0 * MOST_LASTING * (1.0 - np.exp(-plant.breaks * lasting))
    for age in (30.0, 240.0, 2400.5):
        go_to(shot, end + age * RATE)
        expected = low + (90.0 * (1.0 - plant.stiffness) - low) * np.exp(-age / plant.recovery)
        assert angles(obj)[0] == pytest.approx(expected, abs=0.05)
    assert angles(obj)[1] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_roots_sink_with_the_ground_and_where_they_follow_it_they_do_not(shot, kind):
    place = roots()
    obj = KINDS[kind](place)
    modifier = give_way(obj)
    shot.frame_set(60)
    sunk = blades(obj)[0][0, 2]
    step = baked_ground.load(shot.softground.ground)[0][1]
    assert -step.max_depth_m * 1.2 < sunk < -0.5 * step.max_depth_m
    set_input(modifier, "Sinks", False)
    np.testing.assert_allclose(blades(obj)[0][:, 2], 0.0, atol=1e-6)


def test_a_tuft_lies_under_the_sole_with_all_of_its_blades(shot):
    """Those that lean the other way, and those that grow beside its origin, too."""
    place = roots(3)
    tuft = scattered(place)
    mesh = tuft.modifiers[0].node_group.nodes[-1].inputs["Object"].default_value.data
    mesh.clear_geometry()
    tips = np.array([(0.0, 0.2, 0.15), (0.0, -0.2, 0.15), (0.2, 0.0, 0.15), (0.02, 0.02, 0.3), (0.03, 0.03, 0.0)])
    mesh.from_pydata([(0, 0, 0), *tips.tolist()], [(0, number) for number in range(1, 6)], [])
    modifier = give_way(tuft)
    set_input(modifier, "Height", HEIGHT)
    table = tramplings(baked_ground.load(shot.softground.ground)[0])
    number = table.latest(*place[:1, :2].T)[0]
    go_to(shot, 0.5 * (table.by.start[number] + table.by.end[number]))
    graph = bpy.context.evaluated_depsgraph_get()
    lying = next(i.matrix_world.copy() for i in graph.object_instances if i.parent and i.parent.original == tuft)
    ways = np.array([lying.to_3x3() @ Vector(tip) for tip in tips])
    np.testing.assert_allclose(ways[:, 2], 0.0, atol=1e-4)
    assert (ways[:4] @ (0.0, -1.0, 0.0) > tips[:4] @ (0.0, -1.0, 0.0) + 0.1).all()  # the walk goes there


def test_roots_go_down_as_the_ground_does_while_soles_press_it(shot):
    grass = hair(roots(3000))
    give_way(grass)
    ground = baked_ground.display_mesh_of(shot.softground.ground)
    origin = np.array(ground.matrix_world.translation)
    for frame in (10, 26, 28, 60):
        shot.frame_set(frame)
        shown = ground.evaluated_get(bpy.context.evaluated_depsgraph_get())
        root = blades(grass)[0] - origin
        below = np.array([shown.ray_cast(Vector((x, y, 1.0)), Vector((0.0, 0.0, -1.0)))[1].z for x, y, _ in root])
        pressed = below < -0.005
        assert pressed.sum() > 50
        assert np.percentile(root[pressed, 2] - below[pressed], 90) < 0.008  # a cell is 2 cm wide, and walls are steep


def state(obj):
    return np.concatenate(blades(obj)).tobytes()


@pytest.mark.parametrize("kind", KINDS)
def test_before_the_first_step_it_is_the_scatter_and_so_it_is_without_the_modifier(shot, kind):
    obj = KINDS[kind](roots())
    before, modifiers = state(obj), fingerprints.of_object(obj)["modifiers"]
    data = fingerprints.of_mesh(obj.data) if obj.type == "MESH" else None
    modifier = give_way(obj)
    for frame in (-100, -10, 0):
        shot.frame_set(frame)
        assert state(obj) == before
    for frame in (1, 30):  # a foot stands there as the shot begins
        shot.frame_set(frame)
        assert state(obj) != before
    obj.modifiers.remove(modifier)
    bpy.context.view_layer.update()
    assert state(obj) == before
    assert fingerprints.of_object(obj)["modifiers"] == modifiers
    assert data is None or fingerprints.of_mesh(obj.data) == data


@pytest.mark.parametrize("kind", KINDS)
def test_a_scatter_that_no_sole_touches_passes_as_it_is(shot, kind):
    """Not copied, and without anything stored."""
    obj = KINDS[kind](roots() + np.array((20.0, 0.0, 0.0)))
    before = state(obj)
    give_way(obj)
    shot.frame_set(60)
    assert state(obj) == before
    if kind != "instances":
        shown = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        assert give_way_nodes.BENT not in shown.attributes


def test_frames_play_in_any_order_with_sub_frames(shot):
    grass = hair(roots())
    give_way(grass)
    frames = [3.0, 17.25, 17.5, 30.0, 44.75, 400.0]
    forward = {}
    for frame in frames:
        go_to(shot, frame)
        forward[frame] = state(grass)
    for frame in reversed(frames):
        go_to(shot, frame)
        assert state(grass) == forward[frame]
    assert len(set(forward.values())) == len(frames)


PLAY = """
import bpy, sys, numpy as np
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not hasattr(bpy.types.Scene, "softground")
bpy.context.scene.frame_set(30, subframe=0.5)
grass = bpy.data.objects["Grass"].evaluated_get(bpy.context.evaluated_depsgraph_get())
flat = np.empty(3 * len(grass.data.points), np.float32)
grass.data.attributes["position"].data.foreach_get("vector", flat)
np.save(sys.argv[2], flat)
"""


def test_it_plays_without_the_add_on(shot, tmp_path):
    grass = hair(roots())
    give_way(grass)
    go_to(shot, 30.5)
    expected = grass.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.attributes["position"].data
    flat = np.empty(3 * len(expected), np.float32)
    expected.foreach_get("vector", flat)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"), copy=True)
    args = [sys.executable, "-c", PLAY, str(tmp_path / "shot.blend"), str(tmp_path / "played.npy")]
    subprocess.run(args, check=True, capture_output=True)
    assert np.load(tmp_path / "played.npy").tobytes() == flat.tobytes()


def test_plants_of_a_muted_step_stand_again_and_clear_lets_all_stand_until_the_next_bake(shot):
    grass = hair(roots())
    before = state(grass)
    give_way(grass)
    shot.frame_set(48)
    lying, ground = angles(grass), shot.softground.ground
    bake = jobs.run(step_edits.reading(shot))
    jobs.run(step_edits.editing(bake, {step_id(bake.record.footprints[1]): StepEdit(mute=True)}))
    assert lying[0] > 60.0
    assert angles(grass)[0] < 20.0  # the foot may brush it on its way to the next step
    jobs.run(step_edits.editing(jobs.run(step_edits.reading(shot)), {}))
    np.testing.assert_allclose(angles(grass), lying, atol=1e-3)
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert state(grass) == before
    assert own_data.PASSES not in baked_ground.display_mesh_of(ground).data.attributes
    assert bpy.ops.softground.bake() == {"FINISHED"}
    give_way_nodes.ensure_group().use_fake_user = True  # which takes seconds to build
    shot.frame_set(48)
    np.testing.assert_allclose(angles(grass), lying, atol=1e-3)


@pytest.mark.parametrize("again", [False, True], ids=["once", "and again once the plants are free"])
def test_clear_leaves_nothing_behind_where_no_plants_give_way_any_more(shot, again):
    grass = hair(roots())
    modifier = give_way(grass)
    if again:
        bpy.ops.softground.clear_bake()
    assert bpy.ops.softground.clear_bake.poll() == (not again), "plants that are left need the table"
    grass.modifiers.remove(modifier)
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert not bpy.ops.softground.clear_bake.poll()
    assert trampling_table.TRAMPLED not in shot.softground.ground.keys()  # noqa: SIM118
    assert not [obj for obj in bpy.data.objects if obj.name.startswith(trampling_table.NAME)]
    assert not [mesh for mesh in bpy.data.meshes if mesh.name.startswith(trampling_table.NAME)]


def test_clear_takes_the_table_of_a_ground_with_a_finer_copy_along(scene):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    ground = scene.softground.ground = plane(scene, vertices=4)
    bpy.context.view_layer.update()
    trampling_table.ensure(ground)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert baked_ground.display_mesh_of(ground) != ground
    assert bpy.ops.softground.clear_bake() == {"FINISHED"}
    assert trampling_table.TRAMPLED not in ground.keys()  # noqa: SIM118


def test_plants_may_give_way_before_there_is_a_bake(opened_as):
    scene = opened_as(walked)
    place = roots()
    bpy.ops.softground.clear_bake()
    grass = hair(place)
    before = state(grass)
    give_way(grass)
    scene.frame_set(40)
    assert state(grass) == before
    bpy.ops.softground.bake()
    scene.frame_set(40)
    assert angles(grass)[0] > 60.0


def test_it_holds_wherever_scatter_and_ground_are_moved_to(shot):
    place = roots()
    first, other = hair(place), hair(place)
    give_way(first, other)
    move = Matrix.Translation((3.0, -2.0, 0.5)) @ Matrix.Rotation(0.7, 4, "Z")
    shot.frame_set(40)
    expected = blades(first)[1]
    # The points of one are elsewhere, and its object brings them back.
    flat = np.column_stack([blades_of(other), np.ones(len(place) * POINTS)]) @ np.array(move.inverted()).T
    other.data.attributes["position"].data.foreach_set("vector", flat[:, :3].astype(np.float32).ravel())
    other.data.update_tag()
    other.matrix_world = move
    bpy.context.view_layer.update()
    moved = blades(other)[1]
    seen = np.column_stack([moved, np.ones(len(moved))]) @ np.array(move).T
    np.testing.assert_allclose(seen[:, :3], expected, atol=2e-5)


def blades_of(obj):
    """Points of hair as the user made it."""
    flat = np.empty(3 * len(obj.data.points), np.float32)
    obj.data.attributes["position"].data.foreach_get("vector", flat)
    return flat.reshape(-1, 3).astype(float)


def test_litter_is_pressed_in_and_tilts_on_the_walls_but_does_not_bend(shot):
    place = roots(1500)
    leaves = scattered(place)
    give_way(leaves, kind="LITTER")
    shot.frame_set(60)
    tilt, sunk = angles(leaves), blades(leaves)[0][:, 2]
    table = tramplings(baked_ground.load(shot.softground.ground)[0])
    latest = table.latest(*place[:, :2].T)
    steep = np.where(latest >= 0, np.hypot(*table.slope[latest].T), 0.0)
    np.testing.assert_allclose(np.tan(np.radians(tilt)), steep, atol=2e-3)
    assert sunk.min() < -0.02
    assert (sunk > 1e-3).any()  # on the rim
    np.testing.assert_allclose(sunk[latest < 0], 0.0, atol=1e-6)


def trodden_on(place):
    """Table of the bake, and numbers of pieces at places (N, 3) of which the first sole has trodden on each."""
    table = tramplings(baked_ground.load(bpy.context.scene.softground.ground)[0])
    latest = table.latest(*place[:, :2].T)
    return table, np.flatnonzero((latest >= 0) & (table.by.passes[latest] == 1.0))


def test_pebbles_roll_along_on_hard_ground_evenly_slowed_down_and_are_pressed_into_soft_ground(shot):
    place = roots(1500)
    pebbles = scattered(place)
    modifier = give_way(pebbles, kind="PEBBLES")
    rolls = compat.read_input(modifier, inputs_of(modifier)["Rolls"])
    set_input(modifier, "Height", 1e4)  # so that the ground is hard
    table, trodden = trodden_on(place)
    number = table.latest(*place[trodden, :2].T)

    def rolled(frame):
        go_to(shot, frame)
        return (blades(pebbles)[0] - place)[trodden, :2]

    end = rolled(200.0)
    far = np.linalg.norm(end, axis=1)
    assert 0.9 * rolls < far.max() < rolls
    assert 0.4 * rolls < far.mean() < 0.6 * rolls
    along = np.einsum("ni,ni->n", end, table.direction[number]) / far
    assert along.min() > np.cos(np.radians(61.0))
    frame = table.by.start[number[0]] + 0.5 * litter_nodes.ROLLING * RATE
    np.testing.assert_allclose(rolled(frame)[0], 0.75 * end[0], rtol=1e-3, atol=1e-5)
    turned = angles(pebbles)[trodden]
    assert (turned > 30.0).any()
    untouched = np.flatnonzero(table.latest(*place[:, :2].T) < 0)
    np.testing.assert_allclose(blades(pebbles)[0][untouched], place[untouched], atol=1e-6)
    set_input(modifier, "Height", 1e-3)
    np.testing.assert_allclose(rolled(200.0)[table.sink[number] < -1e-3], 0.0, atol=1e-6)


@pytest.mark.parametrize("kind", ["curves", "loose parts"])
def test_needles_that_no_sole_has_touched_stay_beside_those_that_are_sent_off(shot, kind):
    place = roots(600)
    needles = KINDS[kind](place)
    before = blades(needles)
    set_input(give_way(needles, kind="PEBBLES"), "Height", 1e4)  # so that the ground is hard
    table, trodden = trodden_on(place)
    untouched = np.flatnonzero(table.latest(*place[:, :2].T) < 0)
    shot.frame_set(200)
    for was, now in zip(before, blades(needles), strict=True):
        assert (now[untouched] == was[untouched]).all()
        assert np.linalg.norm((now - was)[trodden, :2], axis=1).mean() > 0.04


@pytest.mark.slow
def test_pebbles_roll_as_far_in_a_scene_of_other_units(scene):
    scene.unit_settings.scale_length = 0.01
    scene.softground.ground = plane(scene, 600.0, 10)
    modifier = give_way(scattered(np.zeros((1, 3))), kind="PEBBLES")
    assert compat.read_input(modifier, inputs_of(modifier)["Rolls"]) == pytest.approx(12.0)


def test_litter_is_thrown_by_soles_that_lift_as_fast_as_they_throw_debris_and_lies_on_the_ground_again(shot):
    place = roots(1500)
    leaves = scattered(place)
    modifier = give_way(leaves, kind="LITTER")
    vertices = compat.read_input(modifier, inputs_of(modifier)["Table"]).data
    pace = np.empty(3 * len(vertices.vertices), np.float32)
    vertices.attributes[give_way_nodes.PACE].data.foreach_get("vector", pace)
    speed = 3.0
    pace[1::3] = speed / RATE
    vertices.attributes[give_way_nodes.PACE].data.foreach_set("vector", pace)
    vertices.update_tag()
    table, trodden = trodden_on(place)
    number = table.latest(*place[trodden, :2].T)
    reach = speed**2 / 9.81 - trampling_layout.THROWN_FROM
    go_to(shot, 200.0)
    there = blades(leaves)[0]
    far = np.linalg.norm((there - place)[trodden, :2], axis=1)
    assert 0.9 * reach < far.max() < reach
    back = -np.einsum("ni,ni->n", (there - place)[trodden, :2], table.direction[number]) / far
    assert back.min() > np.cos(np.radians(61.0))
    lands = table.latest(*there[trodden, :2].T) < 0
    np.testing.assert_allclose(there[trodden[lands], 2], 0.0, atol=1e-6)
    first = trodden[lands][0]
    leaves_at = table.by.end[number[lands][0]]
    go_to(shot, leaves_at + 0.5 * np.sqrt(2.0 * reach / 9.81) * RATE)
    flying = blades(leaves)[0][first] - place[first]
    way = np.linalg.norm((there - place)[first, :2])
    np.testing.assert_allclose(flying[:2], 0.5 * (there - place)[first, :2], rtol=1e-3, atol=1e-5)
    assert flying[2] == pytest.approx(0.25 * way, abs=0.045)  # above the ground there, which prints have changed


def test_litter_is_thrown_by_the_gravity_of_the_scene(shot):
    give_way(scattered(roots(10)), kind="LITTER")
    shot.gravity = (0.0, 0.0, -1.62)
    assert bpy.ops.softground.bake() == {"FINISHED"}
    vertices = trampling_table.of(shot.softground.ground).data
    numbers = np.empty(3 * len(vertices.vertices), np.float32)
    vertices.attributes[trampling_layout.META].data.foreach_get("vector", numbers)
    assert numbers.reshape(-1, 3)[2, 1] == pytest.approx(1.62)


def test_a_rim_covers_half_of_the_litter_that_it_rises_under(shot):
    place = roots(3000)
    leaves = scattered(place)
    give_way(leaves, kind="LITTER")
    shot.frame_set(60)
    table = tramplings(baked_ground.load(shot.softground.ground)[0])
    latest = table.latest(*place[:, :2].T)
    steep, sink = np.abs(table.slope[latest]).sum(axis=1) * table.cell_size, table.sink[latest]
    on_rim = (latest >= 0) & (sink > 0.5 * steep + 1e-4)
    covered = blades(leaves)[0][on_rim, 2] < 1e-6
    assert on_rim.sum() > 20
    assert 0.3 < covered.mean() < 0.7


@pytest.mark.slow
def test_a_table_and_a_group_of_an_earlier_version_are_renewed_as_the_file_opens(shot, tmp_path):
    grass = hair(roots())
    modifier = give_way(grass)
    set_input(modifier, "Height", 0.4)
    shot.frame_set(48)
    expected, group, table = angles(grass), modifier.node_group, trampling_table.of(shot.softground.ground)
    group[give_way_nodes.MARK], group.name = True, "Of before"
    group.nodes.clear()
    del group[give_way_nodes.MADE]  # as of those that did not say how they were made
    table.data.clear_geometry()
    del table.data[give_way_nodes.MARK]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "earlier.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "earlier.blend"))
    scene = bpy.context.scene
    scene.frame_set(48)
    grass = bpy.data.objects["Grass"]
    modifier = grass.modifiers[-1]
    assert modifier.node_group.get(give_way_nodes.MARK) == give_way_nodes.VERSION
    assert compat.read_input(modifier, inputs_of(modifier)["Height"]) == pytest.approx(0.4)
    np.testing.assert_allclose(angles(grass), expected, atol=1e-3)
    assert trampling_table.is_current(scene.softground.ground)


@pytest.mark.slow
def test_nodes_that_the_user_edited_stay_when_a_file_of_an_earlier_version_opens(shot, tmp_path):
    mine, grass = hair(roots()), hair(roots())
    give_way(mine, grass)
    group = mine.modifiers[-1].node_group
    assert not give_way_nodes.is_edited(group)
    other = group.copy()
    grass.modifiers[-1].node_group = other
    for each in (group, other):
        each[give_way_nodes.MARK] = give_way_nodes.VERSION - 1
    group.name = "Mine"
    for node in group.nodes:
        node.location.x += 100.0  # which changes nothing
    assert not give_way_nodes.is_edited(group)
    next(node for node in group.nodes if node.bl_idname == "ShaderNodeMath" and not node.inputs[1].is_linked).inputs[
        1
    ].default_value += 0.25
    del trampling_table.of(shot.softground.ground).data[give_way_nodes.MARK]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "earlier.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "earlier.blend"))
    kept, renewed = (bpy.data.objects[name].modifiers[-1].node_group for name in ("Grass", "Grass.001"))
    assert (kept.name, give_way_nodes.is_edited(kept)) == ("Mine", True)
    assert renewed.get(give_way_nodes.MARK) == give_way_nodes.VERSION
    result = bake(bpy.context.scene)
    assert "'Mine' of an earlier version" in next(
        finding["message"] for finding in result.report["self_check"] if finding["code"] == "give_way_edited"
    )


def test_vertices_of_the_ground_and_blades_know_of_it_for_materials(shot):
    grass = hair(roots())
    give_way(grass)
    shot.frame_set(48)
    shown = baked_ground.display_mesh_of(shot.softground.ground)
    passes = np.empty(len(shown.data.vertices), np.float32)
    shown.data.attributes[own_data.PASSES].data.foreach_get("value", passes)
    assert set(np.unique(passes)) >= {0.0, 1.0}
    bent = grass.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.attributes[give_way_nodes.BENT]
    assert bent.domain == "CURVE"
    share = np.empty(len(bent.data), np.float32)
    bent.data.foreach_get("value", share)
    np.testing.assert_allclose(share * 90.0, angles(grass), atol=0.05)


def test_the_height_is_that_of_the_scatter_and_a_scatter_on_the_prints_does_not_sink_twice(shot):
    place = roots(50)
    for make in KINDS.values():
        modifier = give_way(make(place))
        value = compat.read_input(modifier, inputs_of(modifier)["Height"])
        assert value == pytest.approx(HEIGHT, rel=1e-5)
    scatter = scattered(place)
    info = scatter.modifiers[0].node_group.nodes.new("GeometryNodeObjectInfo")
    info.inputs["Object"].default_value = baked_ground.display_mesh_of(shot.softground.ground)
    modifier = give_way(scatter)
    assert compat.read_input(modifier, inputs_of(modifier)["Sinks"]) is False


def test_pressed_again_it_takes_the_values_of_another_preset(shot):
    grass = hair(roots(20))
    modifier = give_way(grass)
    again = give_way(grass, kind="REEDS")
    assert len(grass.modifiers) == 1
    assert again == modifier
    assert compat.read_input(again, inputs_of(again)["Recovery"]) == PLANTS["REEDS"][1].recovery
    assert len([tree for tree in bpy.data.node_groups if give_way_nodes.is_give_way(tree)]) == 1


def test_the_ground_itself_does_not_give_way_without_a_scatter(shot):
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    shown = bpy.context.view_layer.objects.active = baked_ground.display_mesh_of(shot.softground.ground)
    shown.select_set(True)
    assert not bpy.ops.softground.give_way.poll()


def test_many_objects_give_way_with_as_few_evaluations_as_one(shot):
    pieces, evaluations = [loose(roots(2)) for _ in range(8)], []

    def note(*_):
        evaluations.append(len(pieces))

    def count(*objects):
        bpy.context.view_layer.update()
        evaluations.clear()
        give_way(*objects)
        return len(evaluations)

    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        of_one, of_many = count(pieces[0]), count(*pieces[1:])
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)
    assert of_many <= of_one + 1
    assert all(len(piece.modifiers) == 1 for piece in pieces)


def test_particles_are_refused_until_they_are_made_real(shot):
    blade, emitter = scattered(np.zeros((1, 3))), loose(roots(4))
    blade = linked("Blade", blade.modifiers[0].node_group.nodes[-1].inputs["Object"].default_value.data)
    bpy.context.view_layer.objects.active = emitter
    bpy.ops.object.particle_system_add()
    strewn = emitter.particle_systems[0].settings
    strewn.type, strewn.count, strewn.render_type, strewn.instance_object = "HAIR", 50, "OBJECT", blade
    with pytest.raises(RuntimeError, match="'Blades' scatters particles, which no modifier moves: make them real"):
        give_way(emitter)
    assert [modifier.type for modifier in emitter.modifiers] == ["PARTICLE_SYSTEM"]


def test_the_sample_meadow_grows_on_the_ground_and_gives_way(shot):
    assert bpy.ops.softground.add_sample_meadow() == {"FINISHED"}
    grass = bpy.data.objects["SoftGround Meadow"]
    place = blades_of(grass)[::POINTS]
    np.testing.assert_allclose(place[:, 2], 0.0, atol=1e-5)
    shot.frame_set(48)
    lying = angles(grass) > 80.0
    table = tramplings(baked_ground.load(shot.softground.ground)[0])
    latest = table.latest(*place[:, :2].T)
    assert 50 < lying.sum() < 0.2 * len(lying)
    assert (latest[lying] >= 0).all()


def grown_on(ground):
    """The blades of the scatter on the vertices of the ground itself, by a modifier of its own."""
    blade = scattered(np.zeros((1, 3)))
    tree = blade.modifiers[0].node_group
    bpy.data.objects.remove(blade)
    given, out, on, _ = tree.nodes
    both = tree.nodes.new("GeometryNodeJoinGeometry")
    tree.links.new(on.outputs[0], both.inputs[0])
    tree.links.new(given.outputs[0], both.inputs[0])
    tree.links.new(both.outputs[0], out.inputs[0])
    ground.modifiers.new("Mine", "NODES").node_group = tree


def test_a_scatter_on_the_ground_itself_bends_and_the_ground_stays_as_it_is(shot):
    ground = shot.softground.ground
    bpy.ops.softground.clear_bake()
    grown_on(ground)
    shot.softground.detail = "NEVER"
    assert bpy.ops.softground.bake() == {"FINISHED"}
    shot.frame_set(40)

    def seen():
        graph = bpy.context.evaluated_depsgraph_get()
        surface = mesh_arrays.positions(ground.evaluated_get(graph).data).tobytes()
        return surface, [i.matrix_world.copy() for i in graph.object_instances if i.is_instance]

    assert not bake_report.stale_reasons(shot)
    surface, standing = seen()
    modifier = give_way(ground)
    bent_surface, bent = seen()
    assert bent_surface == surface
    tilt = np.array([np.degrees((m.to_3x3() @ Vector((0, 0, 1))).angle((0, 0, 1))) for m in bent])
    assert len(bent) == len(standing)
    assert (tilt > 60.0).sum() > 10
    assert max((a.translation - b.translation).length for a, b in zip(bent, standing, strict=True)) < 1e-6
    assert compat.read_input(modifier, inputs_of(modifier)["Loose Parts"]) is False
    assert not bake_report.stale_reasons(shot)


def test_on_a_terrain_with_a_finer_copy_along_the_trail_a_scatter_from_it_gives_way(shot):
    bpy.ops.softground.clear_bake()
    shot.softground.ground = plane(shot, 12.0, 24)
    shot.softground.detail = "ALWAYS"
    assert bpy.ops.softground.bake() == {"FINISHED"}
    terrain = shot.softground.ground
    assert baked_ground.display_mesh_of(terrain) != terrain
    place = roots()
    scatter = scattered(place)
    info = scatter.modifiers[0].node_group.nodes.new("GeometryNodeObjectInfo")
    info.inputs["Object"].default_value = terrain  # which is hidden, and stays as it is
    modifier = give_way(scatter)
    assert compat.read_input(modifier, inputs_of(modifier)["Sinks"]) is True
    shot.frame_set(40)
    assert angles(scatter)[0] > 60.0
    assert blades(scatter)[0][0, 2] < -0.015


def test_the_scatter_of_a_terrain_gives_way_though_a_finer_copy_along_the_trail_shows_the_prints(shot):
    bpy.ops.softground.clear_bake()
    terrain = shot.softground.ground = plane(shot, 6.0, 75)
    grown_on(terrain)
    shot.softground.detail = "ALWAYS"
    assert bpy.ops.softground.bake() == {"FINISHED"}
    assert baked_ground.display_mesh_of(terrain) != terrain
    shot.frame_set(40)

    def seen():
        graph = bpy.context.evaluated_depsgraph_get()
        surface = mesh_arrays.positions(terrain.evaluated_get(graph).data).tobytes()
        matrices = [
            np.array(i.matrix_world) for i in graph.object_instances if i.is_instance and i.parent.original == terrain
        ]
        return surface, np.array(matrices)

    surface, standing = seen()
    modifier = give_way(terrain)
    bent_surface, bent = seen()
    assert bent_surface == surface
    assert (np.degrees(np.arccos(np.clip(bent[:, 2, 2], -1.0, 1.0))) > 60.0).sum() > 10
    assert bent[:, 2, 3].min() < -0.015  # into the prints of the copy
    terrain.modifiers.remove(modifier)
    bpy.context.view_layer.update()
    again_surface, again = seen()
    assert (again_surface, again.tobytes()) == (surface, standing.tobytes())
    assert not bake_report.stale_reasons(shot)


def test_a_scatter_sinks_as_each_bake_shows_the_prints_unless_the_artist_says_otherwise(shot):
    bpy.ops.softground.clear_bake()
    terrain = shot.softground.ground = plane(shot, 6.0, 120)
    grown_on(terrain)
    modifier = give_way(terrain)

    def sinks_after_a_bake(detail):
        shot.softground.detail = detail
        assert bpy.ops.softground.bake() == {"FINISHED"}
        return compat.read_input(modifier, inputs_of(modifier)["Sinks"])

    assert compat.read_input(modifier, inputs_of(modifier)["Sinks"]) is False
    assert sinks_after_a_bake("ALWAYS") is True
    assert baked_ground.display_mesh_of(terrain) != terrain
    shot.frame_set(40)
    graph = bpy.context.evaluated_depsgraph_get()
    assert min(i.matrix_world.translation.z for i in graph.object_instances if i.is_instance) < -0.015
    set_input(modifier, "Sinks", False)
    assert sinks_after_a_bake("ALWAYS") is False
    set_input(modifier, "Sinks", True)
    bpy.ops.softground.clear_bake()
    assert sinks_after_a_bake("NEVER") is False


SKIN, DEEP, SHOE = 0.004, (0.012, 0.023, 1.0), 0.05
"""Depth from which on a blade is inside [m], a direction that meets no edge, and half of a shoe's thickness [m]."""


def inside_shoes(figure, points):
    """True of points (N, 3) that are inside the feet of a figure, as its skin is."""
    shown = figure.evaluated_get(bpy.context.evaluated_depsgraph_get())
    vertices = [tuple(shown.matrix_world @ vertex.co) for vertex in shown.data.vertices]
    skin = BVHTree.FromPolygons(vertices, [tuple(face.vertices) for face in shown.data.polygons])
    low = np.array([vertex for vertex in vertices if vertex[2] < 0.15])
    near = ((points > low.min(axis=0)) & (points < np.minimum(low.max(axis=0), (9, 9, 0.12)))).all(axis=1)
    inside = np.zeros(len(points), bool)
    for number in np.flatnonzero(near):
        place, crossings = Vector(points[number]), 0
        start = place
        while (hit := skin.ray_cast(start, Vector(DEEP))[0]) is not None:
            start, crossings = hit + 1e-5 * Vector(DEEP), crossings + 1
        inside[number] = crossings % 2 and SKIN < skin.find_nearest(place)[3] < SHOE
    return inside


@pytest.mark.slow
def test_hardly_a_blade_is_inside_a_shoe_that_stands(shot):
    """While both feet bear, counted on the skin; a foot in the air meets a few more."""
    grass = hair(roots(3000))
    modifier = give_way(grass)
    figure = next(obj for obj in shot.objects if obj.type == "MESH" and obj.parent and obj.parent.type == "ARMATURE")

    def count(frames, shown):
        modifier.show_viewport = shown
        count = 0
        for frame in frames:
            shot.frame_set(frame)
            root, tip = blades(grass)
            along = np.linspace(0.05, 0.6, 8)[:, None, None]
            count += inside_shoes(figure, (root + along * (tip - root)).reshape(-1, 3)).reshape(8, -1).any(axis=0).sum()
        return count

    stand, swing = (10, 24, 38), (17, 31, 44)
    assert count(stand, True) < 0.06 * count(stand, False)
    assert count(swing, True) < 0.4 * count(swing, False)
