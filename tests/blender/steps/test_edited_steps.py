"""Edits of steps from a file: into the ground, the exports and the report, and with the step through further bakes."""

import json
import os
import re
from dataclasses import replace

import bpy
import numpy as np
import pytest

from softground_addon.blender import settings
from softground_addon.blender.command_line import cli
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.playback.display_key import DISPLAY_KEY
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit, step_id
from softground_addon.core.settings import identity_of, renamed
from tests.blender import shots
from tests.blender.grounds import heights, rest


@pytest.fixture(scope="module")
def shot(addon, tmp_path_factory):
    """A saved walk, and the report of its bake."""
    folder = tmp_path_factory.mktemp("edits")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    shots.walker(bpy.context.scene, frames=60)
    bpy.ops.softground.add_character()
    bpy.context.scene.softground.cell_size = 0.02
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "shot.blend"))
    assert bake(folder, save="plain.blend") == 0
    return folder, json.loads((folder / "report.json").read_text())


def bake(folder, edits=None, save="edited.blend"):
    options = [f"--save={folder / save}", f"--report={folder / 'report.json'}", "--progress=none"]
    if edits is not None:
        text = edits if isinstance(edits, str) else json.dumps({"schema_version": 1, "steps": edits})
        (folder / "edits.json").write_text(text)
        options.append(f"--edits={folder / 'edits.json'}")
    return cli.run_standalone(["bake", str(folder / "shot.blend"), *options])


def ground_in(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene.softground.ground


def stored(ground):
    return bytes(baked_ground.stored_record(ground))


@pytest.mark.slow
def test_edits_from_a_file_are_in_the_ground_the_report_and_the_next_bake(shot):
    folder, plain = shot
    first, two, three = (step["id"] for step in plain["steps"][1:4])
    edits = {first: {"strength": 0.5}, two: {"move_m": [0.0, 0.5], "turn_deg": 30.0}, three: {"mute": True}}
    assert bake(folder, edits) == 0
    report = json.loads((folder / "report.json").read_text())
    before, after = ({step["id"]: step for step in steps["steps"]} for steps in (plain, report))
    assert {name: step["edit"] for name, step in after.items() if "edit" in step} == edits
    assert after[first]["max_depth_m"] == pytest.approx(0.5 * before[first]["max_depth_m"], rel=1e-3)
    np.testing.assert_allclose(np.subtract(after[two]["position"], before[two]["position"])[:2], (0.0, 0.5), atol=0.02)
    assert [name for name, step in after.items() if step.get("left_out")] == [three]
    assert report["totals"]["steps"] == plain["totals"]["steps"] - 1
    ground = ground_in(folder / "edited.blend")
    pressed = heights(ground, DISPLAY_KEY)[:, 2] - rest(ground)[:, 2]
    for step, depth in ((before[two], 0.0), (after[two], 0.01), (before[three], 0.0)):
        under = np.linalg.norm(rest(ground)[:, :2] - step["position"][:2], axis=1) < 0.05
        assert -pressed[under].min() > depth if depth else np.abs(pressed[under]).max() < 2e-3
    steps, _ = baked_ground.load(ground)
    bpy.ops.softground.bake()
    again, _ = baked_ground.load(ground)  # what was edited stays so
    assert list(map(step_id, again)) == list(map(step_id, steps))
    assert len(again) == plain["totals"]["steps"] - 1
    np.testing.assert_allclose([each.position for each in again], [step.position for step in steps], atol=1e-3)


@pytest.mark.slow
def test_edits_that_are_reset_leave_the_bytes_of_a_bake_without(shot):
    folder, plain = shot
    first = stored(ground_in(folder / "plain.blend"))
    assert bake(folder, {plain["steps"][2]["id"]: {"move_m": [0.1, 0.2]}}) == 0
    ground = ground_in(folder / "edited.blend")
    assert stored(ground) != first
    loaded = record.load(stored(ground))
    assert {step_id(step): loaded.pressed_again.get(n) is not None for n, step in enumerate(loaded.footprints)}[
        plain["steps"][2]["id"]
    ]
    assert bake(folder, {}) == 0
    assert stored(ground_in(folder / "edited.blend")) == first


@pytest.mark.slow
def test_edits_go_with_a_character_that_gets_another_name(shot):
    folder, plain = shot
    name = plain["steps"][2]["id"]
    assert bake(folder, {name: {"move_m": [0.1, 0.2]}}) == 0
    ground = ground_in(folder / "edited.blend")
    before = [each.position for each in baked_ground.load(ground)[0]]
    bpy.data.objects["Walker"].name = "Ann"
    bpy.ops.softground.bake()
    assert baked_ground.edits_of(ground).keys() == {name.replace("Walker", "Ann")}
    np.testing.assert_allclose([each.position for each in baked_ground.load(ground)[0]], before, atol=1e-3)


def test_edits_stay_with_their_character_whatever_the_order_of_the_list_and_its_name(shot):
    folder, plain = shot
    name = plain["steps"][2]["id"]
    assert bake(folder, {name: {"move_m": [0.1, 0.2]}}) == 0
    ground, characters = ground_in(folder / "edited.blend"), bpy.context.scene.softground.characters
    bpy.data.objects["Walker"].name = "Ann"
    ball = characters.add()
    ball.name = "Ball"
    characters.move(1, 0)
    now = [settings.character_of(each) for each in characters]
    assert [each.name for each in now] == ["Ball", "Ann"]
    assert baked_ground.edits_of(ground, now).keys() == {name.replace("Walker", "Ann")}


def test_edits_stay_with_their_characters_in_files_of_earlier_versions_where_two_were_added_by_one_name(shot):
    ground_in(shot[0] / "plain.blend")
    scene = bpy.context.scene
    first = bpy.data.objects["Walker"]
    first.name = "Ann"
    other = bpy.data.objects.new("Walker", first.data)
    scene.collection.objects.link(other)
    entry = scene.softground.characters.add()
    entry.name, entry.armature = "Walker", other
    now = [settings.character_of(each) for each in scene.softground.characters]
    assert len({identity_of(vars(each)) for each in now}) == 2
    before = [{"name": each.name, **({"added_as": each.added_as} if each.added_as else {})} for each in now]
    first.name = "Eve"
    now = [settings.character_of(each) for each in scene.softground.characters]
    assert renamed(before, now) == {"Ann": "Eve", "Walker": "Walker"}


def test_an_edit_without_a_step_is_kept_and_named(shot):
    folder, _ = shot
    assert bake(folder, {"Walker/foot.L@900.0": {"mute": True}}) == 0
    report = json.loads((folder / "report.json").read_text())
    (finding,) = [finding for finding in report["self_check"] if finding["code"] == "edit_without_step"]
    assert "'Walker/foot.L@900.0'" in finding["message"]
    ground = ground_in(folder / "edited.blend")
    assert baked_ground.edits_of(ground) == {"Walker/foot.L@900.0": StepEdit(mute=True)}
    assert ground_mesh.is_baked(ground)


def test_an_edit_whose_sole_is_not_in_the_bake_is_named(shot):
    folder, plain = shot
    name = plain["steps"][2]["id"]
    assert bake(folder, {name: {"sole": "Fox/paw.L"}}) == 0
    report = json.loads((folder / "report.json").read_text())
    (finding,) = [finding for finding in report["self_check"] if finding["code"] == "edit_without_sole"]
    assert f"'{name}'" in finding["message"]
    assert "'Fox/paw.L'" in finding["message"]


def prints_on(ground):
    """The bytes of the prints and edits of a bake, whatever else is said of it."""
    return record.dump(replace(record.load(stored(ground)), about={}))


def plate(scene, name="Shoe", size=(0.1, 0.4, 0.05)):
    """A box beside the walk, its length along y."""
    x, y, z = (np.array(size) / 2).tolist()
    corners = [(a, b, c) for a in (-x, x) for b in (-y, y) for c in (-z, z)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    obj.location = (3.0, 3.0, 1.0)
    return obj


def shot_with(folder, name, change):
    """Another shot in the folder: the walk with something changed; its report by edits of a step."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "shot.blend"))
    change(bpy.context.scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / name), copy=True)

    def bake_it(edits, save="edited.blend"):
        (folder / "edits.json").write_text(json.dumps({"schema_version": 1, "steps": edits}))
        options = [f"--save={folder / save}", f"--report={folder / 'report.json'}", "--progress=none"]
        return cli.run_standalone(["bake", str(folder / name), f"--edits={folder / 'edits.json'}", *options])

    return bake_it


@pytest.mark.slow
def test_a_step_takes_the_sole_of_a_mesh_and_keeps_it_without_the_mesh(shot):
    folder, plain = shot
    name = plain["steps"][2]["id"]
    edits = {name: {"sole": "Shoe", "turn_deg": 10.0}}
    assert shot_with(folder, "shoe.blend", plate)(edits, save="shod.blend") == 0
    report = json.loads((folder / "report.json").read_text())
    step = next(step for step in report["steps"] if step["id"] == name)
    assert step["edit"] == {"turn_deg": 10.0, "sole": "Shoe"}
    assert step["area_m2"] == pytest.approx(0.1 * 0.4, rel=0.1)
    assert "edit_without_sole" not in {finding["code"] for finding in report["self_check"]}
    ground_in(folder / "shod.blend")
    bpy.ops.softground.bake()  # on the ground that the first bake made
    shod = prints_on(bpy.context.scene.softground.ground)
    bpy.data.objects.remove(bpy.data.objects["Shoe"])
    bpy.ops.softground.bake()
    assert prints_on(bpy.context.scene.softground.ground) == shod
    (folder / "edits.json").write_text(json.dumps({"schema_version": 1, "steps": edits}))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "barefoot.blend"))
    options = [f"--edits={folder / 'edits.json'}", f"--save={folder / 'again.blend'}", "--progress=none"]
    assert cli.run_standalone(["bake", str(folder / "barefoot.blend"), *options]) == 0
    assert prints_on(ground_in(folder / "again.blend")) == shod  # as the bake on the ground keeps it


def broken(make):
    def change(scene):
        make(plate(scene))

    return change


def without_faces(obj):
    obj.data.clear_geometry()


def upright(obj):
    obj.data.clear_geometry()
    obj.data.from_pydata([(0, 0, 0), (0, 0.3, 0), (0, 0.3, 0.2)], [], [(0, 1, 2)])


def not_a_number(obj):
    obj.data.vertices[3].co.x = float("nan")


def in_other_units(obj):
    obj.scale = (100.0, 100.0, 100.0)


def tiny(obj):
    obj.scale = (0.001, 0.001, 0.001)


def an_empty(obj):
    obj.name = "Other"
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Shoe", None))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (without_faces, "'Shoe' has no faces to press steps with: give its mesh faces"),
        (upright, "'Shoe' has no underside to press steps with: .* Turn it until its sole lies flat"),
        (not_a_number, "'Shoe' has vertices without a valid position .*: delete them"),
        (in_other_units, "'Shoe' is 40 m long, and a sole at most 10 m: scale it"),
        (tiny, "'Shoe' is 0.4 mm long, and a sole at least 5 mm: scale it"),
        (an_empty, "'Shoe' has no mesh to take a sole from: choose a mesh object"),
    ],
)
def test_a_mesh_that_can_be_no_sole_is_named_with_the_remedy(shot, capsys, make, said):
    folder, plain = shot
    bake_it = shot_with(folder, "broken.blend", broken(make))
    assert bake_it({plain["steps"][2]["id"]: {"sole": "Shoe"}}) == cli.EXIT_BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(said, line)


@pytest.mark.slow
def test_a_linked_mesh_presses_by_its_full_name(shot, tmp_path):
    folder, plain = shot
    name = plain["steps"][2]["id"]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    plate(bpy.context.scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "props.blend"))

    def link(scene):
        plate(scene, size=(0.05, 0.2, 0.05))
        with bpy.data.libraries.load(str(tmp_path / "props.blend"), link=True) as (_, into):
            into.objects = ["Shoe"]
        scene.collection.objects.link(into.objects[0])

    bake_it = shot_with(folder, "linked.blend", link)
    areas = []
    for sole in ("Shoe", "Shoe [props.blend]"):
        assert bake_it({name: {"sole": sole}}) == 0
        report = json.loads((folder / "report.json").read_text())
        areas.append(next(step["area_m2"] for step in report["steps"] if step["id"] == name))
    assert areas == [pytest.approx(0.05 * 0.2, rel=0.2), pytest.approx(0.1 * 0.4, rel=0.1)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "are not valid JSON"),
        ('{"schema_version": 1, "steps": {"Walker/foot.L@7.0": {"depth": 1}}}', "unknown field 'depth'"),
        ('{"schema_version": 1, "steps": {"Walker/foot.L@7.0": {"strength": NaN}}}', "'strength' is nan"),
        ('{"schema_version": 1, "steps": {"Walker/foot.L@7.0": {"sole": 7}}}', "'sole' is 7"),
        ('{"schema_version": 1, "steps": {"Walker/foot.L@7.0": {"sole": "\\ud800/paw"}}}', r"'sole' is '\ud800/paw'"),
        ('{"schema_version": 1, "steps": {"\\ud800/foot.L@7.0": {"mute": true}}}', "not the id of a step"),
        ('{"schema_version": 9, "steps": {}}', "version 9"),
        ("[" * 100_000, "are not valid JSON"),
    ],
)
def test_a_bad_file_of_edits_gets_one_clear_line(shot, capsys, text, said):
    folder, _ = shot
    assert bake(folder, text) == cli.EXIT_BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"softground: The edits '{folder / 'edits.json'}'")
    assert said in line


def test_edits_that_are_not_there_are_named(shot, capsys):
    folder, _ = shot
    options = [f"--edits={folder / 'nowhere.json'}", "--dry-run"]
    assert cli.run_standalone(["bake", str(folder / "shot.blend"), *options]) == cli.EXIT_BAD_INPUT
    assert "nowhere.json' cannot be read: No such file" in capsys.readouterr().err


@pytest.mark.skipif(os.name != "posix", reason="pipes")
@pytest.mark.timeout(60)
@pytest.mark.parametrize("kind", ["pipe", "endless"])
def test_edits_that_never_end_are_refused(shot, tmp_path, capsys, kind):
    folder, _ = shot
    path = tmp_path / "edits.json"
    os.mkfifo(path) if kind == "pipe" else path.symlink_to("/dev/zero")
    assert (
        cli.run_standalone(["bake", str(folder / "shot.blend"), f"--edits={path}", "--dry-run"]) == cli.EXIT_BAD_INPUT
    )
    assert "edits.json' cannot be read: it is not a regular file" in capsys.readouterr().err
