"""Exporting a bake as the user does: by the operator and by the command line."""

import os
import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import bpy
import numpy as np
import pytest

from softground_addon.blender import jobs
from softground_addon.blender.baking import bake_job
from softground_addon.blender.command_line import cli
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.output import export_formats, exports, image_exports, opensim_exports
from tests.blender import command_line, point_caches, shots
from tests.blender.grounds import plane
from tests.blender.output.test_exports import assert_stands_as_recorded, import_and_select, played, read_image
from tests.tiers import slow_but_one


@pytest.fixture(scope="module")
def baked_file(addon, tmp_path_factory):
    """A plane with a UV map, baked with detail along the trail."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    shots.walker(scene, frames=48)
    bpy.ops.softground.add_character()
    ground = scene.softground.ground = plane(scene, vertices=2)
    layer = ground.data.uv_layers.new(name="UVMap")
    corners = np.array([ground.data.vertices[loop.vertex_index].co[:2] for loop in ground.data.loops])
    layer.uv.foreach_set("vector", (corners / 7.0 + 0.5).astype(np.float32).ravel())
    scene.softground.frame_start, scene.softground.frame_end = 20, 40
    bpy.context.view_layer.update()
    jobs.run(bake_job.bake(scene))
    path = tmp_path_factory.mktemp("baked") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def scene(baked_file, tmp_path):
    """The baked file, opened from a folder of the test's own."""
    path = tmp_path / "shot.blend"
    path.write_bytes(baked_file.read_bytes())
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene


def files_in(folder):
    return sorted(path.name for path in folder.iterdir() if path.suffix != ".blend")


@pytest.mark.parametrize(
    ("kind", "importer"),
    [("ALEMBIC", "alembic_import"), ("USD", "usd_import"), ("OBJ", "obj_import")],
)
def test_a_mesh_comes_back_with_the_same_heights_from_beside_the_blend(scene, tmp_path, kind, importer):
    ground = scene.softground.ground
    assert bpy.ops.softground.export(format=kind) == {"FINISHED"}
    name = f"shot_Field{export_formats.FORMATS[kind].suffix}"
    assert files_in(tmp_path) == [name]
    options = {"as_background_job": False} if kind == "ALEMBIC" else {}
    copy = import_and_select(getattr(bpy.ops.wm, importer), tmp_path / name, **options)
    for frame in (25, 40) if kind != "OBJ" else (1e9,):
        world = played(copy, int(min(frame, 100)))
        tolerance = {"tolerance": 1e-5} if kind == "OBJ" else {}
        assert_stands_as_recorded(ground, frame, world, **tolerance)


def opensim_table(path):
    """Columns of a storage file by name, as OpenSim's manual has it."""
    head, _, rest = path.read_text().partition("endheader\n")
    about = dict(line.split("=") for line in head.splitlines()[1:])
    labels, *rows = rest.splitlines()
    table = np.array([row.split("\t") for row in rows], float)
    assert table.shape == (int(about["nRows"]), int(about["nColumns"]))
    return dict(zip(labels.split("\t"), table.T, strict=True))


def test_opensim_replaces_its_own_loads_and_no_other_file_of_that_name(scene, tmp_path):
    model = tmp_path / "walk.xml"
    model.write_text("<OpenSimDocument><Model/></OpenSimDocument>")
    with pytest.raises(RuntimeError, match=r"'walk\.xml' is there already .*choose another name"):
        bpy.ops.softground.export(filepath=str(tmp_path / "walk.mot"), format="OPENSIM_MOT")
    assert files_in(tmp_path) == ["walk.xml"]
    assert model.read_text() == "<OpenSimDocument><Model/></OpenSimDocument>"
    model.unlink()
    for _ in range(2):
        assert bpy.ops.softground.export(filepath=str(tmp_path / "walk.mot"), format="OPENSIM_MOT") == {"FINISHED"}


def test_opensim_gets_the_forces_that_bear_the_body_y_up(scene, tmp_path):
    assert bpy.ops.softground.export(filepath=str(tmp_path / "walk"), format="OPENSIM_MOT") == {"FINISHED"}
    assert files_in(tmp_path) == ["walk.mot", "walk.xml"]
    columns = opensim_table(tmp_path / "walk.mot")
    loads = ElementTree.parse(tmp_path / "walk.xml").getroot()[0]
    assert loads.findtext("datafile") == "walk.mot"
    bodies = {force.findtext("applied_to_body"): force for force in loads.iter("ExternalForce")}
    assert bodies.keys() == {"calcn_l", "calcn_r"}
    vertical = {body: columns[force.findtext("force_identifier") + "y"] for body, force in bodies.items()}
    weight = scene.softground.characters[0].mass * 9.81
    np.testing.assert_allclose(np.mean(vertical["calcn_l"] + vertical["calcn_r"]), weight, rtol=0.1)
    # A left foot presses on the left: OpenSim's z points right of who walks along x.
    feet = {body: (columns[force.findtext("point_identifier") + "z"], vertical[body]) for body, force in bodies.items()}
    left, right = (np.average(z, weights=force) for z, force in (feet["calcn_l"], feet["calcn_r"]))
    assert abs(left - right) > 0.05
    heights = columns[bodies["calcn_l"].findtext("point_identifier") + "y"]
    assert np.abs(heights).max() < 0.05
    # The foot twists on the ground about the upward axis alone, no more than it is pressed.
    twist = {axis: columns[bodies["calcn_l"].findtext("torque_identifier") + axis] for axis in "xyz"}
    assert (twist["x"] == 0).all()
    assert (twist["z"] == 0).all()
    assert 0 < np.abs(twist["y"]).max() < 0.1 * vertical["calcn_l"].max()
    assert bpy.ops.softground.export(filepath=str(tmp_path / "walk"), format="OPENSIM_STO") == {"FINISHED"}
    assert opensim_table(tmp_path / "walk.sto").keys() == columns.keys()


def test_opensim_files_of_several_characters_differ_also_where_case_does_not_count(tmp_path, monkeypatch):
    everybody = [SimpleNamespace(motion=SimpleNamespace(name=name)) for name in ("A 1", "a_1", "A:1", "B")]
    monkeypatch.setattr(opensim_exports, "_write_one", lambda _who, path, _start, _end: [path])
    written = opensim_exports.write(everybody, tmp_path / "walk.mot", 1, 2)
    assert [path.name for path in written] == ["walk_A_1.mot", "walk_a_1_2.mot", "walk_A_1_3.mot", "walk_B.mot"]


def test_a_point_cache_holds_the_frames_asked_for_and_plays_on_the_ground(scene, tmp_path):
    ground = scene.softground.ground
    path = tmp_path / "cache" / "walk.pc2"
    path.parent.mkdir()
    result = bpy.ops.softground.export(filepath=str(path), format="PC2", frame_start=30, frame_end=32)
    assert result == {"FINISHED"}
    start, samples = point_caches.read(path)
    assert (start, len(samples)) == (30, 3)
    assert_stands_as_recorded(ground, 31, samples[1])
    display_mesh = baked_ground.display_mesh_of(ground)
    point_caches.play(ground, path, 30)
    assert_stands_as_recorded(ground, 32, played(display_mesh, 32))


def test_images_are_named_after_the_file_that_was_chosen(scene, tmp_path):
    path = tmp_path / "prints.exr"
    bpy.ops.softground.export(filepath=str(path), format="EXR", frame_start=39, frame_end=40, resolution=64)
    assert files_in(tmp_path) == [
        f"prints_{kind}_00{frame}.exr" for kind in ("displacement", "mask") for frame in (39, 40)
    ]
    assert read_image(tmp_path / "prints_displacement_0040.exr")[..., 0].min() < -0.01


def test_the_suffix_follows_the_format_and_nothing_else_of_the_name_changes(tmp_path):
    for before, kind, after in (
        ("walk.abc", "USD", "walk.usdc"),
        ("walk.usda", "USD", "walk.usda"),
        ("walk.v2", "PC2", "walk.v2.pc2"),
        ("walk", "EXR", "walk.exr"),
    ):
        assert export_formats.with_suffix(tmp_path / before, kind) == tmp_path / after


def test_the_final_mesh_stands_in_the_scene(scene):
    before = set(scene.objects)
    assert bpy.ops.softground.final_mesh() == {"FINISHED"}
    (still,) = set(scene.objects) - before
    assert_stands_as_recorded(scene.softground.ground, 1e9, played(still, 1), tolerance=0.0)


def spoil_nothing_baked(scene):
    bpy.ops.softground.clear_bake()


def spoil_settings(scene):
    scene.softground.material.youngs_modulus *= 2


def spoil_uv(scene):
    for thing in (scene.softground.ground, baked_ground.display_mesh_of(scene.softground.ground)):
        while thing.data.uv_layers:
            thing.data.uv_layers.remove(thing.data.uv_layers[0])


@pytest.mark.parametrize(
    ("spoil", "kind", "said"),
    [
        (spoil_nothing_baked, "ALEMBIC", "no bake on ground 'Field'.*Bake Footprints"),
        (spoil_settings, "USD", "'Field' is outdated .*settings.*bake again"),
        (spoil_uv, "EXR", "outdated|no UV map: unwrap it"),
    ],
)
def test_what_cannot_be_exported_says_why_and_what_to_do(scene, tmp_path, capfd, spoil, kind, said):
    spoil(scene)
    before = files_in(tmp_path)
    assert cli.run_in_blender(["export", "--format", kind]) == cli.EXIT_BAD_INPUT
    error = capfd.readouterr().err
    assert error.startswith("softground: ")
    assert re.search(said, error)
    assert files_in(tmp_path) == before


def test_an_outdated_bake_is_exported_when_that_is_asked_for(scene, tmp_path):
    spoil_settings(scene)
    with pytest.raises(RuntimeError, match="outdated"):
        bpy.ops.softground.export(format="PC2")
    assert bpy.ops.softground.export(format="PC2", outdated=True) == {"FINISHED"}
    assert files_in(tmp_path) == ["shot_Field.pc2"]


@pytest.mark.parametrize("kind", export_formats.FORMATS)
def test_a_folder_that_is_missing_or_locked_is_named(scene, tmp_path, kind, monkeypatch):
    with pytest.raises(RuntimeError, match=r"no folder '.*nowhere'"):
        bpy.ops.softground.export(filepath=str(tmp_path / "nowhere" / "x"), format=kind)
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may write anywhere
    with pytest.raises(RuntimeError, match="cannot be written to: choose another"):
        bpy.ops.softground.export(filepath=str(tmp_path / "x"), format=kind)
    assert files_in(tmp_path) == []


@pytest.mark.parametrize("kind", export_formats.FORMATS)
def test_a_full_disk_is_named_and_leaves_the_older_file(scene, small_disk, kind, capfd):
    old = small_disk / f"ground{export_formats.FORMATS[kind].suffix}"
    old.write_bytes(b"old")
    filled = shutil.disk_usage(small_disk).free if kind.startswith(("EVENTS", "OPENSIM")) else 100 * 1024
    with (small_disk / "filler").open("wb") as filler:
        filler.write(bytes(filled))
    options = [f"--format={kind}", f"--output={old}", "--resolution=512"]
    assert cli.run_in_blender(["export", *options]) == cli.EXIT_BAD_INPUT
    said = capfd.readouterr().err
    assert re.search(
        r"softground: '.*/ground\S*' (could not be written \(No space left|may take up to).* disk space", said
    )
    assert {path.name: path.stat().st_size for path in small_disk.iterdir()} == {old.name: 3, "filler": filled}


def test_the_room_that_alembic_wants_is_what_it_takes_at_most(scene, tmp_path):
    display_mesh = baked_ground.display_mesh_of(scene.softground.ground)
    for smooth in (False, True):
        display_mesh.data.polygons.foreach_set("use_smooth", np.full(len(display_mesh.data.polygons), smooth))
        for end in (20, 40):
            exports.export_alembic(scene.softground.ground, tmp_path / "x.abc", 20, end)
            taken = (tmp_path / "x.abc").stat().st_size
            wanted = exports.size_of_alembic(display_mesh.data, end - 19)
            assert taken <= wanted <= 2 * taken, (smooth, end)


def test_the_button_waits_for_a_bake(scene):
    assert bpy.ops.softground.export.poll()
    bpy.ops.softground.clear_bake()
    assert not bpy.ops.softground.export.poll()


def test_the_command_line_writes_what_it_names_and_keeps_the_blend(scene, tmp_path, capfd):
    before = (tmp_path / "shot.blend").read_bytes()
    code = cli.run_in_blender(["export", "--format", "pc2", "--frames", "30-31", "--output", str(tmp_path / "a.pc2")])
    assert code == cli.EXIT_DONE
    assert str(tmp_path / "a.pc2") in capfd.readouterr().out
    assert len(point_caches.read(tmp_path / "a.pc2")[1]) == 2
    assert (tmp_path / "shot.blend").read_bytes() == before
    assert cli.run_in_blender(["export", "--format", "fbx"]) == cli.EXIT_BAD_INPUT
    assert cli.run_in_blender(["export", "--format", "exr", "--resolution", "0"]) == cli.EXIT_BAD_INPUT
    assert cli.run_in_blender(["export", "--format", "obj", "--scene", "None"]) == cli.EXIT_BAD_INPUT


@pytest.mark.parametrize(
    ("kind", "asked", "written"),
    [
        ("events-json", "e.json", None),
        ("events-json", "e.jsonl", "e.jsonl"),
        ("events-json", "e", "e.jsonl"),
        ("pc2", "walk.abc", None),
        ("pc2", "walk.v2", None),
        ("obj", "walk.v2.obj", "walk.v2.obj"),
        ("exr", "maps.png", None),
    ],
)
def test_the_command_line_writes_no_name_that_was_not_asked_for(scene, tmp_path, capfd, kind, asked, written):
    code = cli.run_in_blender(["export", "--format", kind, "--output", str(tmp_path / asked)])
    assert files_in(tmp_path) == ([written] if written else [])
    assert code == (cli.EXIT_DONE if written else cli.EXIT_BAD_INPUT)
    assert written or f"'{asked}' does not end in ." in capfd.readouterr().err


@pytest.mark.parametrize("kind", ["ALEMBIC", "USD"])
def test_a_format_that_blender_was_built_without_is_refused_with_the_reason(scene, tmp_path, capfd, monkeypatch, kind):
    lacking = replace(export_formats.FORMATS[kind], built=False)
    monkeypatch.setitem(export_formats.FORMATS, kind, lacking)
    with pytest.raises(RuntimeError, match=f"built without {lacking.label}: choose another format"):
        bpy.ops.softground.export(format=kind)
    assert cli.run_in_blender(["export", "--format", kind.lower()]) == cli.EXIT_BAD_INPUT
    assert f"built without {lacking.label}" in capfd.readouterr().err
    assert files_in(tmp_path) == []


@pytest.mark.slow
def test_the_bpy_module_writes_the_same_file(scene, tmp_path):
    within, alone = tmp_path / "within.pc2", tmp_path / "alone.pc2"
    options = ("--format", "pc2", "--frames", "30-31", "--output")
    assert cli.run_in_blender(["export", *options, str(within)]) == cli.EXIT_DONE
    done = command_line.run("export", tmp_path / "shot.blend", *options, alone)
    assert done.returncode == cli.EXIT_DONE, done.stderr
    assert str(alone) in done.stdout.splitlines()
    assert alone.read_bytes() == within.read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("shot", slow_but_one(["missing.blend", "flat.blend"]))
def test_the_bpy_module_names_a_shot_that_cannot_be_exported(addon, tmp_path, shot):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "flat.blend"))
    done = command_line.run("export", tmp_path / shot, "--format", "obj")
    assert done.returncode == cli.EXIT_BAD_INPUT
    assert done.stderr.startswith("softground: ")
    assert "Traceback" not in done.stderr
    assert files_in(tmp_path) == []


@pytest.mark.parametrize("kind", ["alembic", "obj"])
def test_another_scene_than_the_open_one_is_exported_by_its_name(scene, tmp_path, kind):
    name = scene.name
    bpy.context.window.scene = bpy.data.scenes.new("Other")
    assert cli.run_in_blender(["export", "--format", kind, "--scene", name, "--output", str(tmp_path / "a")]) == 0
    assert files_in(tmp_path) == [f"a{export_formats.FORMATS[kind.upper()].suffix}"]
    assert bpy.context.scene.name == "Other"


def test_an_interrupted_export_leaves_the_older_file(scene, tmp_path, monkeypatch):
    path = tmp_path / "a.pc2"
    path.write_bytes(b"older")
    monkeypatch.setattr(exports.point_cache, "_VERSION", "no number")
    with pytest.raises(Exception, match=r"integer|argument"):
        export_formats.export(scene, export_formats.Options("PC2", path, 30, 31))
    assert path.read_bytes() == b"older"
    assert files_in(tmp_path) == ["a.pc2"]


def test_images_that_are_interrupted_are_whole_and_not_denied(scene, tmp_path, monkeypatch, capfd):
    save = image_exports._save

    def save_one(*arguments):
        if files_in(tmp_path):
            raise KeyboardInterrupt
        save(*arguments)

    monkeypatch.setattr(image_exports, "_save", save_one)
    options = ["--format=exr", f"--output={tmp_path / 'x.exr'}", "--resolution=64"]
    assert cli.run_in_blender(["export", *options]) == cli.EXIT_INTERRUPTED
    assert files_in(tmp_path) == ["x_displacement_0020.exr"]
    assert capfd.readouterr().err == "softground: interrupted; no file was left half-written.\n"


def test_a_scene_that_was_never_saved_proposes_a_name_too(scene):
    bpy.ops.wm.read_homefile(use_empty=True)
    assert export_formats.default_path(bpy.context.scene.softground.ground, "USD") == Path("untitled_ground.usdc")
