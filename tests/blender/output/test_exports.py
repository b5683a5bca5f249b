"""The bake in other programs' formats: written from the record, read back, compared with it."""

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs, settings
from softground_addon.blender.baking import bake_job
from softground_addon.blender.compat import action_curves
from softground_addon.blender.ground import baked_ground, ground_mesh, ground_surface
from softground_addon.blender.output import exports, image_exports
from softground_addon.core.errors import InputError
from softground_addon.core.playback.ramps import TOLERANCE
from softground_addon.core.record.pressed_ground import PressedGround
from tests.blender import point_caches, shots
from tests.blender.grounds import plane
from tests.blender.images import read_image
from tests.tiers import slow_but_one

FRAMES = (10, 40)


@pytest.fixture
def ground(scene):
    """A baked plane of four vertices, with detail along the trail."""
    shots.walker(scene)
    bpy.ops.softground.add_character()
    ground = scene.softground.ground = plane(scene, vertices=2)
    layer = ground.data.uv_layers.new(name="UVMap")
    corners = np.array([ground.data.vertices[loop.vertex_index].co[:2] for loop in ground.data.loops])
    layer.uv.foreach_set("vector", (corners / 7.0 + 0.5).astype(np.float32).ravel())
    scene.softground.frame_end = 72
    bpy.context.view_layer.update()
    jobs.run(bake_job.bake(scene))
    return ground


def recorded(ground, frame, x, y):
    """Displayed height, compression and rim at places, from the record."""
    footprints, about = baked_ground.load(ground)
    whole = PressedGround.at(
        footprints,
        frame=frame,
        frame_rate=24.0,
        cell_size=0.01,
        blur_sigma=baked_ground.baked_with(about, "blur_sigma"),
    )
    return whole.sample(x, y)


def positions(mesh):
    values = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", values)
    return values.reshape(-1, 3)


def played(thing, frame):
    bpy.context.scene.frame_set(frame)
    shown = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    matrix = np.array(shown.matrix_world)
    return positions(shown.data) @ matrix[:3, :3].T + matrix[:3, 3]


def assert_stands_as_recorded(ground, frame, world, tolerance=TOLERANCE):
    sample = recorded(ground, frame, world[:, 0].astype(float), world[:, 1].astype(float))
    assert sample.display.min() < -0.01
    assert np.abs(world[:, 2] - sample.display).max() <= tolerance + 2e-6


@pytest.mark.slow
def test_a_point_cache_holds_every_frame_of_the_record(scene, ground, tmp_path):
    path = tmp_path / "ground.pc2"
    exports.export_point_cache(ground, path, *FRAMES)
    start, samples = point_caches.read(path)
    assert (start, len(samples)) == (FRAMES[0], FRAMES[1] - FRAMES[0] + 1)
    for frame in (10, 25, 40):
        assert_stands_as_recorded(ground, frame, samples[frame - FRAMES[0]])


@pytest.mark.parametrize("remapped", [(100, 200), (100, 50)])
@pytest.mark.slow
def test_nodes_and_mesh_cache_play_in_the_scenes_frames_where_its_time_is_remapped(scene, tmp_path, remapped):
    scene.render.frame_map_old, scene.render.frame_map_new = remapped
    shots.walker(scene)
    bpy.ops.softground.add_character()
    options = scene.softground
    assert options.frame_end == 72 * remapped[1] // remapped[0]
    jobs.run(bake_job.bake(scene))
    ground, frames = options.ground, (options.frame_start, options.frame_end)
    exports.export_point_cache(ground, tmp_path / "ground.pc2", *frames)
    for cached in (False, True):
        if cached:
            point_caches.play(ground, tmp_path / "ground.pc2", frames[0], remapped[0] / remapped[1])
        for frame in np.linspace(*frames, 6).round().astype(int).tolist()[1:]:
            world = played(ground, frame)
            sample = recorded(ground, frame, *world[:, :2].T.astype(float))
            moved = world[:, 2] - ground_surface.rest_vertices(ground, 1.0)[:, 2]
            assert np.abs(moved - sample.display).max() <= TOLERANCE + 2e-6


def test_the_mesh_cache_plays_the_point_cache_in_place_of_the_nodes(scene, ground, tmp_path):
    path = tmp_path / "ground.pc2"
    exports.export_point_cache(ground, path, *FRAMES)
    display_mesh = baked_ground.display_mesh_of(ground)
    native = {frame: played(display_mesh, frame) for frame in (25, 40)}
    point_caches.play(ground, path, FRAMES[0])
    for frame in (25, 40):
        np.testing.assert_allclose(played(display_mesh, frame), native[frame], atol=2e-6)


def import_and_select(operator, path, **options):
    before = set(bpy.data.objects)
    operator(filepath=str(path), **options)
    return next(thing for thing in set(bpy.data.objects) - before if thing.type == "MESH")


def test_alembic_holds_the_moving_ground(scene, ground, tmp_path):
    path = tmp_path / "ground.abc"
    exports.export_alembic(ground, path, *FRAMES)
    copy = import_and_select(bpy.ops.wm.alembic_import, path, as_background_job=False)
    for frame in (12, 25, 40):
        assert_stands_as_recorded(ground, frame, played(copy, frame))


def test_usd_holds_the_moving_ground_and_its_shading(scene, ground, tmp_path):
    path = tmp_path / "ground.usdc"
    exports.export_usd(ground, path, *FRAMES)
    copy = import_and_select(bpy.ops.wm.usd_import, path)
    for frame in (12, 25, 40):
        assert_stands_as_recorded(ground, frame, played(copy, frame))
    assert "softground_compression" in copy.data.attributes


def write_and_read(kind, ground, folder, start, end):
    """An object of what was written."""
    export, importer, options = {
        "abc": (exports.export_alembic, bpy.ops.wm.alembic_import, {"as_background_job": False}),
        "usdc": (exports.export_usd, bpy.ops.wm.usd_import, {}),
    }[kind]
    export(ground, folder / f"ground.{kind}", start, end)
    return import_and_select(importer, folder / f"ground.{kind}", **options)


@pytest.mark.parametrize("kind", ["abc", "usdc"])
@pytest.mark.slow
def test_a_ground_that_the_user_subdivides_is_written_as_it_is_rendered(scene, ground, tmp_path, kind):
    display_mesh = baked_ground.display_mesh_of(ground)
    finer = display_mesh.modifiers.new("Finer", "SUBSURF")
    finer.levels = finer.render_levels = 1
    copy = write_and_read(kind, ground, tmp_path, 37, 40)
    for frame in (37, 40):
        np.testing.assert_allclose(played(copy, frame), played(display_mesh, frame), atol=1e-5)


def test_negative_frames_are_written_where_that_can_be_and_refused_where_not(scene, tmp_path):
    shots.walker(scene, frames=30)
    for curve in action_curves(scene.objects["Walker"].animation_data.action):
        for key in curve.keyframe_points:
            key.co.x -= 50
    bpy.ops.softground.add_character()
    ground = scene.softground.ground = plane(scene, vertices=2)
    scene.softground.frame_start, scene.softground.frame_end = -49, -20
    bpy.context.view_layer.update()
    jobs.run(bake_job.bake(scene))
    copy = write_and_read("abc", ground, tmp_path, -49, -20)
    for frame in (-40, -20):
        assert_stands_as_recorded(ground, frame, played(copy, frame))
    with pytest.raises(InputError, match=r"from frame 0 on, not from -49"):
        exports.export_usd(ground, tmp_path / "ground.usdc", -49, -20)
    assert [path.name for path in tmp_path.iterdir()] == ["ground.abc"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["abc", "usdc", "obj"])
def test_the_export_is_the_only_file_whatever_the_world_looks_like(scene, ground, tmp_path, kind):
    """Blender's USD exporter makes the world a light, with an image of its colour in a folder beside the file."""
    scene.world = bpy.data.worlds.new("Grey")
    scene.world.use_nodes = True
    path = tmp_path / f"ground.{kind}"
    if kind == "obj":
        exports.export_final(ground, path)
    else:
        {"abc": exports.export_alembic, "usdc": exports.export_usd}[kind](ground, path, *FRAMES)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("export", [exports.export_alembic, exports.export_usd])
def test_exporters_leave_selection_and_frames_as_they_were(scene, ground, tmp_path, export):
    scene.frame_set(7, subframe=0.25)
    bpy.context.view_layer.objects.active = scene.objects["Walker"]
    scene.objects["Walker"].select_set(True)
    frames = (scene.frame_start, scene.frame_end)
    export(ground, tmp_path / f"ground{'.abc' if export is exports.export_alembic else '.usdc'}", *FRAMES)
    assert [thing.name for thing in bpy.context.selected_objects] == ["Walker"]
    assert bpy.context.view_layer.objects.active.name == "Walker"
    assert (scene.frame_start, scene.frame_end, scene.frame_current_final) == (*frames, 7.25)


@pytest.mark.slow
@pytest.mark.parametrize("export", [exports.export_point_cache, exports.export_alembic, exports.export_usd])
def test_progress_counts_the_frames_that_are_written(scene, ground, tmp_path, export, monkeypatch):
    shown, before = [], list(bpy.app.handlers.frame_change_post)
    monkeypatch.setattr(exports, "_show", shown.append)
    export(ground, tmp_path / f"ground.{'usdc' if export is exports.export_usd else 'abc'}", *FRAMES)
    assert set(np.arange(1, 32) / 31) <= set(shown)
    assert list(dict.fromkeys(shown)) == sorted(set(shown))
    assert bpy.app.handlers.frame_change_post == before


@pytest.mark.parametrize("kind", ["abc", "usdc"])
def test_a_hidden_ground_is_exported_and_stays_hidden(scene, ground, tmp_path, kind):
    export, read = {
        "abc": (exports.export_alembic, bpy.ops.wm.alembic_import),
        "usdc": (exports.export_usd, bpy.ops.wm.usd_import),
    }[kind]
    display_mesh = baked_ground.display_mesh_of(ground)
    display_mesh.hide_set(True)
    display_mesh.hide_viewport = display_mesh.hide_render = True
    export(ground, tmp_path / f"ground.{kind}", 10, 12)
    assert (display_mesh.hide_get(), display_mesh.hide_viewport, display_mesh.hide_render) == (True, True, True)
    copy = import_and_select(read, tmp_path / f"ground.{kind}")
    assert len(copy.data.vertices) == len(display_mesh.data.vertices)


@pytest.mark.slow
def test_a_ground_that_is_hidden_with_its_collection_is_named_and_nothing_is_written(scene, ground, tmp_path):
    hidden = bpy.data.collections.new("Set")
    scene.collection.children.link(hidden)
    display_mesh = baked_ground.display_mesh_of(ground)
    scene.collection.objects.unlink(display_mesh)
    hidden.objects.link(display_mesh)
    hidden.hide_viewport = True
    with pytest.raises(InputError, match=r"Trail' is hidden with its collection: show"):
        exports.export_alembic(ground, tmp_path / "ground.abc", 10, 12)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_final_mesh_of_a_hidden_ground_is_where_the_ground_is(scene, ground):
    display_mesh = baked_ground.display_mesh_of(ground)
    display_mesh.hide_viewport = True
    display_mesh.location.x = 2.0
    bpy.context.view_layer.update()
    assert exports.final_mesh(ground).matrix_world.translation.x == pytest.approx(2.0)


def test_the_final_mesh_leaves_no_shape_keys_behind(scene, ground, tmp_path):
    keys = len(bpy.data.shape_keys)
    exports.export_final(ground, tmp_path / "ground.obj")
    exports.final_mesh(ground)
    assert len(bpy.data.shape_keys) == keys


@pytest.mark.slow
def test_images_hold_heights_and_masks_in_uv_space(scene, ground, tmp_path):
    resolution = 512
    paths = image_exports.export_images(ground, tmp_path, 24, 25, units=settings.units_of(scene), resolution=resolution)
    assert sorted(path.name for path in paths) == [
        f"Field_{name}_{frame:04d}.exr" for name in ("displacement", "mask") for frame in (24, 25)
    ]
    centre = ((np.arange(resolution) + 0.5) / resolution - 0.5) * 7.0
    x, y = (values.ravel() for values in np.meshgrid(centre, centre))
    for frame in (24, 25):
        sample = recorded(ground, frame, x, y)
        shape = (resolution, resolution)
        height = read_image(tmp_path / f"Field_displacement_{frame:04d}.exr")
        assert np.abs(height[..., 0] - sample.display.reshape(shape)).max() <= TOLERANCE + 2e-6
        mask = read_image(tmp_path / f"Field_mask_{frame:04d}.exr")
        assert np.abs(mask[..., 0] - sample.compression.reshape(shape)).max() <= 1e-3
        assert np.abs(mask[..., 1] - sample.rim.reshape(shape)).max() <= 1e-3 + TOLERANCE
        np.testing.assert_allclose(mask[..., 2], sample.age.reshape(shape), atol=1e-5)


def scale_uv(ground, factor, shift):
    layer = ground.data.uv_layers["UVMap"]
    values = np.empty(len(layer.uv) * 2, dtype=np.float32)
    layer.uv.foreach_get("vector", values)
    layer.uv.foreach_set("vector", values * factor + np.float32(shift))


@pytest.mark.parametrize(
    ("factor", "shift", "is_written"),
    slow_but_one([(10.0, 0.0, False), (1.0, 1.0, False), (1.0, 0.02, True), (0.5, 0.0, True)]),
    ids=["tiled", "another tile", "a margin outside", "a corner"],
)
def test_images_are_refused_where_prints_would_be_missing(scene, ground, tmp_path, factor, shift, is_written):
    scale_uv(ground, factor, shift)
    if is_written:
        image_exports.export_images(ground, tmp_path, 40, 40, units=settings.units_of(scene), resolution=256)
        assert read_image(tmp_path / "Field_displacement_0040.exr")[..., 0].min() < -0.03
        return
    with pytest.raises(InputError, match=r"Prints on ground 'Field' would be missing, as UV map 'UVMap'"):
        image_exports.export_images(ground, tmp_path, 40, 40, units=settings.units_of(scene), resolution=256)
    assert not list(tmp_path.iterdir())


def test_the_final_mesh_is_plain_and_stands_as_the_end_of_the_bake(scene, ground):
    display_mesh = baked_ground.display_mesh_of(ground)
    still = exports.final_mesh(ground)
    assert not still.modifiers
    assert still.data.shape_keys is None
    assert not list(still.data.keys())
    assert {name for name in still.data.attributes.keys() if name.startswith("softground")} == {  # noqa: SIM118
        "softground_compression",
        "softground_rim",
        "softground_age",
    }
    assert_stands_as_recorded(ground, 1e9, played(still, 1), tolerance=0.0)
    assert ground_mesh.is_baked(display_mesh)


def test_a_ground_without_a_bake_is_refused_with_the_remedy(scene, tmp_path):
    ground = plane(scene)
    for export in (
        lambda: exports.export_point_cache(ground, tmp_path / "x.pc2", 1, 2),
        lambda: exports.export_alembic(ground, tmp_path / "x.abc", 1, 2),
        lambda: exports.export_usd(ground, tmp_path / "x.usdc", 1, 2),
        lambda: image_exports.export_images(ground, tmp_path, 1, 2, units=settings.units_of(scene)),
        lambda: exports.final_mesh(ground),
    ):
        with pytest.raises(InputError, match=r"no bake on ground 'Field'.*Bake Footprints"):
            export()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("spoil", slow_but_one(["cut", "text", "bits"]))
def test_a_damaged_record_is_refused_and_the_ground_still_opens(scene, ground, tmp_path, spoil):
    mesh = ground_mesh.mesh_of(baked_ground.display_mesh_of(ground))
    stored = bytes(mesh[ground_mesh.RECORD])
    del mesh[ground_mesh.RECORD]
    mesh[ground_mesh.RECORD] = {
        "cut": np.frombuffer(stored[: len(stored) // 8 * 4], dtype=np.int32),
        "text": "hello",
        "bits": np.frombuffer(stored[:200] + bytes(64) + stored[264:], dtype=np.int32),
    }[spoil]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    scene = bpy.context.scene
    ground = scene.softground.ground
    assert played(baked_ground.display_mesh_of(ground), 60)[:, 2].min() < -0.01
    with pytest.raises(InputError, match=r"damaged|replaced"):
        exports.export_point_cache(ground, tmp_path / "x.pc2", 1, 2)
    bpy.ops.softground.clear_bake()
    assert not ground.hide_viewport


def test_a_shorter_bake_leaves_nothing_of_the_longer_record(scene, ground):
    longer, _ = baked_ground.load(ground)
    scene.softground.frame_end = 30
    jobs.run(bake_job.bake(scene))
    shorter, _ = baked_ground.load(ground)
    assert 0 < len(shorter) < len(longer)
    assert max(print_.end_frame for print_ in shorter) <= 30
