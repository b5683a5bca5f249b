"""The forces of a bake as animated properties and as a table: the same numbers as in the report."""

import csv
import io

import bpy
import numpy as np
import pytest

from softground_addon.blender.compat import action_curves
from softground_addon.blender.ground import baked_ground
from softground_addon.blender.output import force_curves
from tests.blender import fingerprints
from tests.blender.shots import walker

FRAMES = 72


def bake_a_walk(scene):
    walker(scene, frames=FRAMES)
    bpy.ops.softground.add_character()
    bpy.ops.softground.bake()


@pytest.fixture
def baked(opened_as):
    return opened_as(bake_a_walk)


def test_the_curves_carry_the_body_s_weight_on_average(baked):
    bpy.ops.softground.force_curves()
    empty = bpy.data.objects["Walker Forces"]
    total = []
    for frame in range(12, 61):
        baked.frame_set(frame)
        total.append(sum(value for key, value in empty.items() if key.endswith(" force")))
    weight = baked.softground.characters[0].mass * 9.81
    assert np.mean(total) == pytest.approx(weight, rel=0.1)


def test_contact_is_one_where_there_is_force_and_else_zero(baked):
    bpy.ops.softground.force_curves()
    empty = bpy.data.objects["Walker Forces"]
    seen = set()
    for frame in range(1, FRAMES + 1):
        baked.frame_set(frame)
        for sole in ("foot.L", "foot.R"):
            contact, force = empty[f"{sole} contact"], empty[f"{sole} force"]
            seen.add(contact)
            assert contact in (0.0, 1.0)
            assert force == 0 or contact == 1
    assert seen == {0.0, 1.0}


def test_the_curves_play_in_the_scenes_frames_where_its_time_is_remapped(scene):
    scene.render.frame_map_old, scene.render.frame_map_new = 100, 200
    walker(scene, frames=40)
    bpy.ops.softground.add_character()
    scene.softground.cell_size = 0.02
    bpy.ops.softground.bake()
    bpy.ops.softground.force_curves()
    footprints, _ = baked_ground.load(scene.softground.ground)
    frames = np.arange(scene.softground.frame_start, scene.softground.frame_end + 1, dtype=float)
    force, contact = force_curves.forces_over_time(footprints, frames)["Walker", "foot.L"]
    empty = bpy.data.objects["Walker Forces"]
    for frame in range(5, 80, 6):
        scene.frame_set(frame)
        at = int(np.searchsorted(frames, frame))
        assert empty["foot.L force"] == pytest.approx(force[at], abs=1.0)
        assert empty["foot.L contact"] == contact[at]


def test_a_driver_can_read_them(baked):
    bpy.ops.softground.force_curves()
    cube = bpy.data.objects.new("Needle", None)
    baked.collection.objects.link(cube)
    driver = cube.driver_add("location", 2).driver
    variable = driver.variables.new()
    variable.targets[0].id = bpy.data.objects["Walker Forces"]
    variable.targets[0].data_path = '["foot.L force"]'
    driver.expression = f"{variable.name} / 1000"
    heights = set()
    for frame in range(1, FRAMES + 1, 6):
        baked.frame_set(frame)
        heights.add(round(cube.matrix_world.translation.z, 4))
    assert len(heights) > 3


def test_asking_again_replaces_the_curves(baked):
    bpy.ops.softground.force_curves()
    once = fingerprints.of_file()
    bpy.ops.softground.force_curves()
    assert fingerprints.of_file() == once
    empty = bpy.data.objects["Walker Forces"]
    assert len(action_curves(empty.animation_data.action)) == 4


def test_asking_again_leaves_what_the_user_has_animated_of_the_empty(baked):
    bpy.ops.softground.force_curves()
    empty = bpy.data.objects["Walker Forces"]
    for frame, height in ((1, 0.0), (40, 2.0)):
        empty.location.z = height
        empty.keyframe_insert("location", index=2, frame=frame)
    empty["mine"] = 7.0
    empty.keyframe_insert('["mine"]', frame=1)
    bpy.ops.softground.force_curves()
    curves = action_curves(empty.animation_data.action)
    assert sorted(curve.data_path for curve in curves if "foot" not in curve.data_path) == ['["mine"]', "location"]
    assert len(curves) == 6
    baked.frame_set(40)
    assert (empty.location.z, empty["mine"]) == (2.0, 7.0)


def test_the_rig_and_its_action_stay_untouched(baked):
    before = fingerprints.of_file()
    bpy.ops.softground.force_curves()
    after = fingerprints.of_file()
    assert after["objects"]["Walker"] == before["objects"]["Walker"]
    assert after["actions"]["Walk"] == before["actions"]["Walk"]


def test_the_table_holds_the_same_forces(baked, tmp_path):
    bpy.ops.softground.force_curves()
    bpy.ops.softground.export_forces(filepath=str(tmp_path / "forces"))
    rows = list(csv.DictReader(io.StringIO((tmp_path / "forces.csv").read_text())))
    assert len(rows) == 2 * FRAMES
    empty = bpy.data.objects["Walker Forces"]
    for row in rows[::7]:
        baked.frame_set(int(row["frame"]))
        assert float(row["force_n"]) == pytest.approx(empty[f"{row['sole']} force"], abs=1e-2)
        assert float(row["time_s"]) == pytest.approx((int(row["frame"]) - 1) / 24, abs=1e-6)
    assert all(0 < float(row["deviation_n"]) < 800 for row in rows if float(row["force_n"]) > 100)


def test_the_table_tells_all_of_each_force(baked, tmp_path):
    """Its direction, where it acts, and how it twists; nothing of a sole that is in the air."""
    bpy.ops.softground.export_forces(filepath=str(tmp_path / "forces"))
    rows = list(csv.DictReader(io.StringIO((tmp_path / "forces.csv").read_text())))
    bearing = [row for row in rows if float(row["force_n"]) > 100]
    for row in bearing:
        assert float(row["force_z_n"]) == pytest.approx(float(row["force_n"]), rel=0.1, abs=20)
        assert np.hypot(float(row["force_x_n"]), float(row["force_y_n"])) < float(row["force_z_n"])
        assert abs(float(row["free_moment_nm"])) < 0.1 * float(row["force_z_n"])
    assert any(float(row["free_moment_nm"]) != 0 for row in bearing)
    side = {sole: [float(r["centre_y_m"]) for r in bearing if r["sole"] == sole] for sole in ("foot.L", "foot.R")}
    assert abs(np.mean(side["foot.L"]) - np.mean(side["foot.R"])) > 0.05
    aloft = [row for row in rows if row["contact"] == "0" and float(row["force_z_n"]) == 0]
    assert aloft
    assert {row["centre_x_m"] for row in aloft} == {""}


def test_the_table_outlives_who_left_the_prints(baked, tmp_path, capfd):
    bpy.data.objects.remove(bpy.data.objects["Walker"])
    bpy.ops.softground.export_forces(filepath=str(tmp_path / "forces"))
    rows = list(csv.DictReader(io.StringIO((tmp_path / "forces.csv").read_text())))
    assert len(rows) == 2 * FRAMES
    assert {row[column] for row in rows for column in force_curves.ESTIMATED} == {""}
    assert "Normal forces only" in capfd.readouterr().out


def test_without_a_bake_both_say_what_is_missing(scene):
    assert not bpy.ops.softground.force_curves.poll()
    assert not bpy.ops.softground.export_forces.poll()


def test_overlapping_prints_of_one_sole_add_up():
    class Print:
        character, sole = "A", "foot"
        start_frame, end_frame = 1.0, 3.0
        load_frames, load_n = np.array([1.0, 3.0]), np.array([0.0, 200.0])

    ((force, contact),) = force_curves.forces_over_time([Print, Print], np.array([1.0, 2.0, 3.0, 4.0])).values()
    assert force.tolist() == [0.0, 200.0, 400.0, 0.0]
    assert contact.tolist() == [1.0, 1.0, 1.0, 0.0]
