"""Legs carve deep ground: the skin that is shown passes through no snow, and what it cut is somewhere."""

from dataclasses import replace

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from sample_scenes.body import Body
from sample_scenes.character import create_character
from sample_scenes.dog import Dog
from sample_scenes.four_legged import WALK, go_on_four_legs
from sample_scenes.keys import write_action
from sample_scenes.run import Run, run
from softground_addon.blender import ground_presets, jobs, preset_files, settings
from softground_addon.blender.baking import bake_job, step_edits
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.reading import staleness
from softground_addon.blender.remedies import said
from softground_addon.core.carving import carves
from softground_addon.core.errors import InputError
from softground_addon.core.ground import presets
from softground_addon.core.ground.sparse_grid import TILE, Window
from softground_addon.core.pressing.repose import NEIGHBOURS
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit, step_id
from softground_addon.core.record.footprints import recompose
from tests.blender import rigs, shots
from tests.blender.carried.test_mass_of_clips import strips
from tests.blender.characters import test_crawling
from tests.blender.ground.test_hard_ground import listed
from tests.blender.grounds import field

FRAMES = 44
CELL = 0.01
DEEP = {"youngs_modulus": 123e3, "poisson_ratio": 0.0, "characteristic_time": 0.2, "layer_depth": 0.60}
"""Snow in which the sample walk sinks 35 cm, without rims."""
SHIN_DEEP, THIGH_DEEP = {**DEEP, "youngs_modulus": 215e3}, {**DEEP, "youngs_modulus": 86e3}
"""The same in which it sinks 20 and 50 cm."""


def walker(scene, frames=FRAMES, rate=24, coarseness=shots.COARSE, **material):
    armature = shots.walker(scene, frames=frames, rate=rate, coarseness=coarseness)
    bpy.ops.softground.add_character()
    options = scene.softground
    options.frame_end, options.sink_feet, options.pressure = frames, True, "CENTRE_OF_PRESSURE"
    assert options.carve, "it is on in new scenes"
    for name, value in material.items():
        setattr(options.material, name, value)
    return armature


def bake(scene):
    report = jobs.run(bake_job.bake(scene)).report
    return report, baked_ground.record_of(scene.softground.ground)


@pytest.fixture
def skins(monkeypatch):
    """The responded skins of the bakes of a test, as they are carved with."""
    seen, made = [], carves.RespondedSkin

    def keep(*arguments):
        seen.append(made(*arguments))
        return seen[-1]

    monkeypatch.setattr(carves, "RespondedSkin", keep)
    return seen


def shown_skin(armature):
    """The vertices that Blender shows at the current frame (V, 3) [m]."""
    depsgraph, places = bpy.context.evaluated_depsgraph_get(), []
    for obj in (child for child in armature.children if child.type == "MESH"):
        evaluated = obj.evaluated_get(depsgraph)
        mesh, matrix = evaluated.to_mesh(), np.array(evaluated.matrix_world)
        place = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", place)
        places.append(place.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3])
    return np.concatenate(places)


def in_the_ground(footprints, places, frame, cell=CELL):
    """How far places (V, 3) lie below all ground within a cell of them, (V,) [m]."""
    ground, (x, y, z) = recompose(footprints, frame), places.T
    ways = [(right, up) for right in (-cell, 0.0, cell) for up in (-cell, 0.0, cell)]
    around = [ground.nearest(x + right, y + up) for right, up in ways]
    return np.min([rim - compression for compression, rim in around], axis=0) - z


@pytest.mark.parametrize(
    ("snow", "cell", "coarseness"),
    [
        (SHIN_DEEP, CELL, shots.COARSE),
        pytest.param(DEEP, CELL, shots.COARSE, marks=pytest.mark.slow),
        pytest.param(THIGH_DEEP, CELL, shots.COARSE, marks=pytest.mark.slow),
        pytest.param(DEEP, CELL / 2, shots.COARSE, marks=pytest.mark.slow),
        pytest.param(DEEP, CELL / 2, 1.0, marks=pytest.mark.slow),  # whose skin is finer than what carves
    ],
)
def test_no_part_of_the_skin_is_further_than_a_cell_below_the_shown_surface_at_any_frame(
    scene, skins, snow, cell, coarseness
):
    walker(scene, coarseness=coarseness, **snow)
    scene.softground.cell_size = cell
    _, record_of_bake = bake(scene)
    (skin,) = skins
    depths = [
        in_the_ground(record_of_bake.shaping, places, frame, cell).max()
        for frame, places in zip(skin.frames, skin.at(np.arange(FRAMES)), strict=True)
    ]
    print(f"\nskin below the shown ground: at most {max(depths) * 1e3:.1f} mm")
    assert max(depths) <= cell


@pytest.mark.slow
@pytest.mark.parametrize("cell_size", [CELL, 0.02])
def test_where_snow_ends_at_a_floor_walls_crumble_as_the_foot_leaves_and_the_bake_is_read_again(scene, cell_size):
    frames, end = 96, -1.0
    walker(scene, frames, **DEEP)
    snow, floor = (strips(scene, *each, 1, (-2.0, 2.0), 0.0) for each in (("Yard", [(end, 1)]), ("Floor", [(-6, end)])))
    scene.softground.ground, scene.softground.cell_size, scene.softground.detail = snow, cell_size, "ALWAYS"
    listed(floor)
    bpy.context.view_layer.update()
    _, record_of_bake = bake(scene)
    assert all(end < step.position[1] for step in record_of_bake.footprints)
    assert record_of_bake.carves
    for carve in record_of_bake.carves.values():
        assert max(carve.compression.frames.max(), carve.rim.frames.max()) < carve.start_frame + 40 < frames


def runner(scene):
    body = Body()
    armature = create_character("Runner", body, scene.collection, shots.COARSE)
    write_action(armature, run(body, Run(), FRAMES, 24), "Run")
    return armature


def dog(scene):
    body = Dog()
    armature = create_character("Dog", body, scene.collection)
    write_action(armature, go_on_four_legs(body, WALK, FRAMES, 24), "Walk")
    return armature


def crawler(scene):
    scene.render.fps = test_crawling.RATE
    return test_crawling.crawler(rigs.FAMILIES["mixamo"])


@pytest.mark.parametrize(
    ("mover", "snow"),
    [
        pytest.param(runner, {**DEEP, "youngs_modulus": 300e3}, marks=pytest.mark.slow),
        pytest.param(dog, {**DEEP, "youngs_modulus": 200e3}, marks=pytest.mark.slow),
        pytest.param(crawler, {**DEEP, "youngs_modulus": 60e3}, marks=pytest.mark.slow),
    ],
)
def test_nor_of_who_runs_crawls_or_goes_on_four_legs(scene, skins, mover, snow):
    scene.render.fps, scene.render.fps_base = 24, 1.0
    armature = mover(scene)
    shots.coarse(scene)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.softground.add_character()
    options = scene.softground
    options.frame_end, options.sink_feet, options.pressure = FRAMES, True, "CENTRE_OF_PRESSURE"
    for name, value in snow.items():
        setattr(options.material, name, value)
    report, record_of_bake = bake(scene)
    (skin,) = skins
    depths = [
        in_the_ground(record_of_bake.shaping, places, frame).max()
        for frame, places in zip(skin.frames, skin.at(np.arange(len(skin.frames))), strict=True)
    ]
    deepest = max(step.max_depth_m for step in record_of_bake.footprints)
    print(f"\ndeepest {deepest:.3f} m, skin below the shown ground: at most {max(depths) * 1e3:.1f} mm")
    assert report["carved"]
    assert max(depths) <= CELL


@pytest.mark.slow
def test_what_a_body_drags_carves_the_snow(scene):
    armature = walker(scene, **DEEP)
    scene.frame_set(1)
    mesh = bpy.data.meshes.new("Sledge")
    corners = np.array(np.meshgrid((-0.2, 0.2), (-0.2, 0.2), (0.0, 0.4))).reshape(3, -1).T
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.from_pydata(corners.tolist(), [], faces)
    sledge = bpy.data.objects.new("Sledge", mesh)
    scene.collection.objects.link(sledge)
    sledge.parent, sledge.parent_type, sledge.parent_bone = armature, "BONE", "spine"
    bpy.context.view_layer.update()
    behind = armature.matrix_world @ armature.pose.bones["hips"].matrix.translation
    sledge.matrix_world = Matrix.Translation((behind.x + 0.6, behind.y, 0.2))  # aside, 10 cm deep as feet sink
    bpy.context.view_layer.update()
    _, record_of_bake = bake(scene)
    scene.frame_set(FRAMES // 2)
    shown = sledge.matrix_world.translation
    assert -0.25 < shown.z < -0.05
    compression, rim = recompose(record_of_bake.shaping, FRAMES // 2).nearest(np.array([shown.x]), np.array([shown.y]))
    assert (rim - compression)[0] < shown.z + 0.02
    without = recompose(record_of_bake.edited, FRAMES // 2).nearest(np.array([shown.x]), np.array([shown.y]))
    assert without[1][0] - without[0][0] > -0.01


@pytest.mark.slow
def test_between_two_holes_the_ground_is_5_cm_lower_than_the_snow(scene):
    walker(scene, frames=60, **SHIN_DEEP)
    _, record_of_bake = bake(scene)
    ground = recompose(record_of_bake.shaping)
    for sole in ("foot.L", "foot.R"):
        first, second = [step for step in record_of_bake.footprints if step.sole == sole][:2]
        assert first.max_depth_m == pytest.approx(0.2, abs=0.01)
        along = np.linspace(first.position, second.position, 200)
        compression, rim = ground.nearest(*along[:, :2].T)
        print(f"\nhighest between two holes: {(rim - compression).max():.3f} m")
        assert (rim - compression).max() < -0.05


@pytest.mark.slow
def test_what_is_carved_follows_neither_from_the_cells_nor_from_the_frame_rate(addon):
    carved = {}
    for cell, rate in ((CELL, 24), (CELL / 2, 24), (CELL, 48), (CELL, 96)):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = bpy.context.scene
        walker(scene, frames=60 * rate // 24, rate=rate, **DEEP)
        scene.softground.cell_size = cell
        carved[cell, rate] = bake(scene)[0]["totals"]["carved_m3"]
    print(f"\n{carved}")
    assert list(carved.values()) == pytest.approx([np.mean(list(carved.values()))] * len(carved), rel=0.03)


@pytest.mark.slow
def test_the_skin_that_is_carved_with_is_shown_and_all_that_it_cut_is_there(scene, skins):
    armature = walker(scene, **DEEP)
    report, record_of_bake = bake(scene)
    (skin,) = skins
    before = []
    for frame in range(4, FRAMES, 8):
        scene.frame_set(frame)
        places = skin.at(np.array([frame - 1]))[0]
        assert places == pytest.approx(shown_skin(armature), abs=1e-3)
        before.append(in_the_ground(record_of_bake.edited, places, frame).max())
    print(f"\nskin in the ground without its carves: {np.round(before, 3)} m; {report['carved']}")
    assert np.median(before) > 0.1
    volumes = report["carved"][armature.name]
    assert 0.005 < volumes["cut_m3"] < 0.05
    assert report["totals"]["carved_m3"] == pytest.approx(volumes["cut_m3"], rel=1e-12)
    lying = sum(carve.tile(carve.rim).sum() for carve in record_of_bake.carves.values()) * CELL**2
    assert lying == pytest.approx(volumes["loose_m3"], rel=1e-6)
    assert volumes["cut_m3"] == pytest.approx(sum(volumes.values()) - volumes["cut_m3"], rel=1e-9)
    waded = {row["step"]: row for row in report["events"] if row["phase"] == "wade"}
    assert waded.keys() == {step_id(record_of_bake.footprints[number]) for number in record_of_bake.carves}
    for number, carve in record_of_bake.carves.items():
        row, (low, high) = waded[step_id(record_of_bake.footprints[number])], carve.window.corners(CELL)
        assert carve.start_frame <= row["frame"] <= row["frame"] + 24 * row["duration_s"] <= carve.end_frame
        assert row["time_s"] == pytest.approx((row["frame"] - 1) / 24, abs=1e-5)
        assert (low < row["position"][:2]).all()
        assert (row["position"][:2] < high).all()
        assert row["surface"] == "snow"
    again = record.load(record.dump(record_of_bake)).carves
    assert again.keys() == record_of_bake.carves.keys()
    for number, carve in record_of_bake.carves.items():
        assert np.array_equal(again[number].tile(again[number].rim, 20.5), carve.tile(carve.rim, 20.5))
        assert np.array_equal(again[number].tile(again[number].compression), carve.tile(carve.compression))


@pytest.mark.slow
def test_dry_sand_that_legs_have_left_is_nowhere_steeper_than_33_degrees(scene):
    armature = walker(scene)
    bpy.ops.softground.load_preset(name="Dry Sand")
    options = scene.softground
    options.cell_size, options.material.layer_depth, options.material.youngs_modulus = CELL, 0.6, 250e3
    report, record_of_bake = bake(scene)
    assert report["carved"][armature.name]["cut_m3"] > 1e-3
    field = recompose(record_of_bake.shaping)
    tiles = np.array(list(field.tiles))
    (column, row), (columns, rows) = tiles.min(axis=0) * TILE, (np.ptp(tiles, axis=0) + 1) * TILE
    window = Window(int(column), int(row), int(columns), int(rows))
    compression, rim = field.read(window)
    places = np.stack(np.meshgrid(*window.centres(CELL)), axis=-1)
    lying = sum(carve.tile(carve.rim).sum() for carve in record_of_bake.carves.values()) * CELL**2
    volumes = report["carved"][armature.name]
    assert lying == pytest.approx(volumes["loose_m3"], rel=1e-6)
    assert volumes["cut_m3"] == pytest.approx(sum(volumes.values()) - volumes["cut_m3"], rel=1e-9)
    lasts = [step.position[:2] for step in record_of_bake.footprints[-2:]]
    at_rest = np.min([np.linalg.norm(places - last, axis=-1) for last in lasts], axis=0) > 0.7
    for first, other, way in NEIGHBOURS:
        slope = np.abs((rim - compression)[first] - (rim - compression)[other]) / (CELL * np.hypot(*way))
        assert np.degrees(np.arctan(slope[at_rest[first] & at_rest[other]].max())) < 33.0


@pytest.mark.slow
def test_a_deep_region_is_carved_as_a_ground_that_is_all_of_it(scene, monkeypatch, tmp_path):
    monkeypatch.setattr(preset_files, "user_folder", lambda: tmp_path)
    walker(scene, **SHIN_DEEP)
    options, ground = scene.softground, field(scene, vertices=120, size=6.0)
    options.detail, options.debris, options.marks = "NEVER", False, False
    expected = bake(scene)[1]
    deep = ground_presets.as_preset(options, "Deep")
    (tmp_path / "deep.json").write_text(presets.dump(deep))
    ground.data.materials.append(bpy.data.materials.new("Bank"))
    ground.data.materials[0].softground_preset = "deep"
    bpy.ops.softground.load_preset(name="Dry Sand")
    options.cell_size, options.debris = CELL, False
    options.pressure = "CENTRE_OF_PRESSURE"
    record_of_bake = bake(scene)[1]
    assert {step.surface for step in record_of_bake.footprints} == {"snow"}
    assert record_of_bake.carves.keys() == expected.carves.keys()
    assert record_of_bake.carves
    for number, carve in record_of_bake.carves.items():
        whole = expected.carves[number]
        assert np.array_equal(carve.tile(carve.rim), whole.tile(whole.rim))
        assert np.array_equal(carve.tile(carve.compression), whole.tile(whole.compression))


@pytest.mark.slow
def test_a_muted_step_takes_its_carve_along_and_gives_it_back(scene):
    walker(scene, **DEEP)
    _, record_of_bake = bake(scene)
    muted = min(record_of_bake.carves)
    name = step_id(record_of_bake.footprints[muted])
    heights = recompose(record_of_bake.shaping)
    jobs.run(step_edits.editing(jobs.run(step_edits.reading(scene)), {name: StepEdit(mute=True)}))
    without = baked_ground.record_of(scene.softground.ground)
    assert len(without.shaping) == len(record_of_bake.shaping) - 2
    assert without.carves.keys() == record_of_bake.carves.keys()
    wanted = settings.snapshot(scene)
    of = scene.softground.ground, scene.objects
    assert not staleness.reasons(*of, wanted)
    assert staleness.reasons(*of, replace(wanted, carve=False)) == ("The settings have changed",)
    jobs.run(step_edits.editing(jobs.run(step_edits.reading(scene)), {}))
    again = recompose(baked_ground.record_of(scene.softground.ground).shaping)
    assert again.tiles.keys() == heights.tiles.keys()
    assert all(np.array_equal(again.tiles[key], tile) for key, tile in heights.tiles.items())


@pytest.mark.slow
def test_a_moved_step_takes_its_carve_along_at_once_and_so_does_its_copy(scene):
    walker(scene, **DEEP)
    scene.softground.ground_margin = 2.0
    _, record_of_bake = bake(scene)
    number, beside = min(record_of_bake.carves), (0.0, 1.5)
    step, carve = record_of_bake.footprints[number], record_of_bake.carves[number]
    name = step_id(step)

    def edited(edits):
        jobs.run(step_edits.editing(jobs.run(step_edits.reading(scene)), edits))
        return baked_ground.record_of(scene.softground.ground)

    def lying(records, away=(0.0, 0.0)):
        """Heights around the hole, or as far away from it."""
        window = carve.window.expanded(5)
        x, y = np.meshgrid(*window.centres(CELL))
        compression, rim = recompose(records).nearest(x + away[0], y + away[1])
        return rim - compression

    moved = edited({name: StepEdit(move_m=beside)})
    moved_carve = moved.laid_carves[number]
    assert np.abs(lying([moved_carve], beside) - lying([carve])).max() < 1e-6
    assert moved_carve.tile(moved_carve.rim).sum() == pytest.approx(carve.tile(carve.rim).sum(), rel=1e-6)
    copied = edited({f"{name}+1": StepEdit(move_m=beside)})
    assert np.array_equal(
        lying([copied.laid_carves[number + len(record_of_bake.footprints)]], beside), lying([moved_carve], beside)
    )
    assert copied.laid_carves[number] is copied.carves[number]
    edited({name: StepEdit(move_m=(0.0, 0.1), shift_frames=4)})
    report, again = bake(scene)
    assert again.carved_with == {name: StepEdit(move_m=(0.0, 0.1))}
    assert again.laid_carves[number].start_frame == again.carves[number].start_frame + 4
    assert report["totals"]["carved_m3"] == pytest.approx(
        sum(c.compressed_m3 for c in again.carves.values()), rel=1e-12
    )
    at_bake, back = again.carves[number], edited({}).laid_carves[number]
    before, after = (np.array(each.window[:2]) + np.array(each.window[2:]) / 2 for each in (at_bake, back))
    assert (after - before) * CELL == pytest.approx([0.0, -0.1], abs=CELL)


@pytest.mark.slow
def test_a_bake_is_refused_that_carving_makes_too_long(scene, monkeypatch):
    walker(scene, **DEEP)
    limits = "softground_addon.core.loads.cell_limits"
    monkeypatch.setattr(f"{limits}.CARVED", 1e6)
    monkeypatch.setattr(f"{limits}.machine_memory", lambda: None)
    with pytest.raises(InputError, match=r"Legs carve deep ground\. .*Or do without carving") as caught:
        bake(scene)
    assert "Or turn Carve off, or raise Time Limit" in said(caught.value)
    assert caught.value.facts["time"] > 3600.0
    monkeypatch.setattr(f"{limits}.machine_memory", lambda: 1e10)
    with pytest.raises(InputError, match="this machine has 10 GB") as caught:
        bake(scene)
    assert said(caught.value).endswith("Or turn Carve off.")
    monkeypatch.setattr(f"{limits}.machine_memory", lambda: None)
    monkeypatch.setattr(f"{limits}.SECONDS_AT_LEAST", 1e6)
    with pytest.raises(InputError, match=r"^Cells of 1 cm would take") as caught:
        bake(scene)
    assert caught.value.code == "too_long"
    monkeypatch.setattr(f"{limits}.SECONDS_AT_LEAST", 1.0)
    scene.softground.material.youngs_modulus = 10e6
    assert not bake(scene)[1].carves


def test_a_bake_from_before_carving_is_still_current(scene):
    walker(scene)
    bake(scene)
    wanted = settings.snapshot(scene)
    assert "carve" not in wanted.inputs()
    assert not staleness.reasons(scene.softground.ground, scene.objects, wanted)


@pytest.mark.slow
def test_down_to_the_ankle_a_bake_is_what_it_is_without(scene):
    walker(scene)
    bake(scene)  # which makes the ground
    records = []
    for is_on in (True, False):
        scene.softground.carve = is_on
        report, record_of_bake = bake(scene)
        assert not record_of_bake.carves
        assert "carved" not in report
        records.append(record_of_bake)
    on, off = (record.dump(record_of_bake.with_about({})) for record_of_bake in records)
    assert on == off
    assert max(step.max_depth_m for step in records[0].footprints) < 0.09


def test_without_sunk_feet_nothing_is_carved(scene):
    walker(scene, **DEEP)
    scene.softground.sink_feet = False
    report, record_of_bake = bake(scene)
    assert not record_of_bake.carves
    assert "carved" not in report


@pytest.mark.slow
def test_relief_but_for_a_close_up_needs_no_finer_mesh_where_only_bodies_carve(scene):
    walker(scene, **DEEP)
    field(scene)
    options, vertices = scene.softground, {}
    options.cell_size = CELL / 2
    for options.relief in ("OFF", "FINE", "CLOSE_UP"):
        bake(scene)
        vertices[options.relief] = len(baked_ground.display_mesh_of(options.ground).data.vertices)
    assert vertices["OFF"] == vertices["FINE"] < 0.7 * vertices["CLOSE_UP"]
