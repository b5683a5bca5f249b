"""Scenes that nobody should make: the bake either works or says what is wrong, and changes nothing then."""

import math
import random
import tempfile

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from softground_addon.blender.command_line import cli
from softground_addon.blender.compat import action_curves
from tests.blender import fingerprints, rigs, shots
from tests.tiers import slow_but_one


def bake(*options):
    """The exit code of a bake that writes into the scene but saves only its report."""
    with tempfile.TemporaryDirectory() as folder:
        return cli.run_in_blender(["bake", "--progress=none", f"--report={folder}/report.json", *options])


def dry_run(*options):
    return cli.run_in_blender(["bake", "--progress=none", "--dry-run", *map(str, options)])


def refused(capfd, *options):
    """The message of a bake that is refused, and has changed nothing of what a user made."""
    before = fingerprints.of_file()
    assert dry_run(*options) == 2
    assert fingerprints.of_file() == before
    return capfd.readouterr().err


@pytest.fixture
def walker(scene):
    return shots.walker(scene, frames=30)


def curves_of(armature):
    return list(action_curves(armature.animation_data.action))


@pytest.mark.slow
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e30])
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_keys_that_are_no_places_are_refused_before_they_are_computed_with(walker, capfd, value):
    curve = next(curve for curve in curves_of(walker) if "location" in curve.data_path)
    curve.keyframe_points[5].co[1] = value
    curve.update()
    before = repr(fingerprints.of_file())  # in which NaN is equal to itself
    assert dry_run() == 2
    assert "'Walker' has no finite pose at frame" in capfd.readouterr().err
    assert repr(fingerprints.of_file()) == before


@pytest.mark.parametrize(
    "matrix",
    [
        Matrix.Diagonal((-1, 1, 1, 1)),
        Matrix.Diagonal((1, 1, 0, 1)),
        Matrix.Diagonal((0, 0, 0, 1)),
        Matrix.Diagonal((1, 2, 1, 1)),
        Matrix.Diagonal((1e-6, 1e-6, 1e-6, 1)),
        Matrix.Diagonal((1e6, 1e6, 1e6, 1)),
        Matrix.Shear("XY", 4, (0.5, 0.5)),
        Matrix.Translation((1e7, -1e7, 0)),
        Matrix.Rotation(math.pi, 4, "X"),
    ],
    ids=["mirrored", "flat", "point", "stretched", "tiny", "giant", "sheared", "far", "upside down"],
)
def test_a_rig_under_any_matrix_is_baked_or_refused_by_name(walker, scene, capfd, matrix):
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    walker.parent = parent
    parent.matrix_world = matrix
    walker.matrix_parent_inverse = matrix @ parent.matrix_world.inverted_safe()
    bpy.context.view_layer.update()
    code = dry_run()
    said = capfd.readouterr().err
    assert code == 0 or (code == 2 and "Walker" in said), said


def test_bones_without_length_do_not_matter(scene, capfd):
    family = rigs.Family(("Hips", "Spine", "Chest", "Neck", "Head"), {part: "{s}" + part for part in rigs.LIMBS})
    armature = rigs.human(family)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        if bone.name.startswith(("Left", "Right")) and not bone.name.endswith(("thigh", "shin", "foot")):
            bone.tail = bone.head
            bone.length = 1e-5
    bpy.ops.object.mode_set(mode="OBJECT")
    rigs.key(armature, "location", {1: (0, 0, 0), 20: (0, 0, 0)})
    code = dry_run("--frames", "1-20")
    assert code in (0, 2), capfd.readouterr().err


@pytest.mark.slow
def test_a_rig_of_2000_bones_is_baked(walker):
    bpy.context.view_layer.objects.active = walker
    bpy.ops.object.mode_set(mode="EDIT")
    bones = walker.data.edit_bones
    for number in range(2000 - len(bones)):
        bone = bones.new(f"hair {number}")
        bone.head, bone.tail = (0.0, 0.001 * number, 1.7), (0.0, 0.001 * number, 1.8)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(walker.data.bones) == 2000
    assert dry_run() == 0


@pytest.mark.marathon
@pytest.mark.timeout(3600)
def test_an_action_of_100000_frames_is_baked(scene, tmp_path):
    shots.walker(scene, frames=100_000)
    report = tmp_path / "report.json"
    assert cli.run_in_blender(["bake", "--progress=none", "--cell-size=0.02", f"--report={report}"]) == 0


LONGEST = "ä" * 31  # 62 of the 63 bytes that Blender keeps


@pytest.mark.parametrize(
    "name", slow_but_one(["it's", 'say "hi"', "two\nlines", "❄", LONGEST, "a.001", '"]["', "\\", "{0}%s"])
)
def test_hostile_names_of_everything_are_only_names(walker, scene, capfd, name, tmp_path):
    walker.name = walker.data.name = scene.name = name
    for bone in walker.pose.bones:
        if "foot" in bone.name.lower():
            side = bone.name[-2:]
            bone.name = f"foot {name[:24]}{side}"
    report = tmp_path / "report.json"
    assert cli.run_in_blender(["bake", "--progress=none", f"--report={report}"]) == 0, capfd.readouterr().err
    assert scene.softground.characters[0].name == walker.name
    assert scene.softground.characters[0].soles[0].bone in walker.pose.bones


@pytest.fixture
def library(walker, tmp_path):
    """A file with the walker, and an empty scene."""
    path = tmp_path / "rig.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


def link(library, **names):
    with bpy.data.libraries.load(str(library), link=True) as (_, linked):
        for kind, name in names.items():
            setattr(linked, kind, [name])
    return linked


@pytest.mark.slow
def test_a_linked_rig_is_baked_and_not_changed(library, capfd):
    rig = link(library, objects="Walker").objects[0]
    bpy.context.scene.collection.objects.link(rig)
    content = library.read_bytes()
    assert bake("--frames", "1-30") == 0, capfd.readouterr().err
    assert rig.library is not None
    assert library.read_bytes() == content


def test_a_rig_whose_library_is_gone_is_told_with_the_library(library, tmp_path, capfd):
    rig = link(library, objects="Walker").objects[0]
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.softground.add_character()
    shot = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    library.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    said = refused(capfd)
    assert "'Walker'" in said
    assert "rig.blend' was not found" in said


@pytest.mark.parametrize("is_local", [False, True], ids=["overridden", "with the action alone linked"])
def test_a_rig_that_needs_a_library_that_is_gone_is_told_with_the_library(library, tmp_path, capfd, is_local):
    rig = link(library, objects="Walker").objects[0]
    bpy.context.scene.collection.objects.link(rig)
    rig = rig.override_create(remap_local_usages=True)
    if is_local:
        rig.make_local()
        rig.data = rig.data.copy()
    bpy.context.view_layer.objects.active = rig
    bpy.ops.softground.add_character()
    shot = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    library.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    said = refused(capfd)
    assert "'Walker'" in said
    assert "rig.blend' was not found" in said
    assert "has no bones" not in said


def test_an_overridden_rig_is_baked(library, capfd):
    rig = link(library, objects="Walker").objects[0]
    bpy.context.scene.collection.objects.link(rig)
    rig.override_create(remap_local_usages=True)
    assert bake("--frames", "1-30") == 0, capfd.readouterr().err


def test_a_linked_ground_is_refused_with_what_to_do(walker, tmp_path, capfd):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=200, y_subdivisions=200, size=8)
    bpy.context.object.name = "Ground"
    path = tmp_path / "ground.blend"
    bpy.data.libraries.write(str(path), {bpy.context.object})
    bpy.data.objects.remove(bpy.context.object)
    ground = link(path, objects="Ground").objects[0]
    bpy.context.scene.collection.objects.link(ground)
    bpy.context.scene.softground.ground = ground
    bpy.context.view_layer.objects.active = walker
    assert "'Ground'" in refused(capfd)


@pytest.mark.slow
def test_an_absurd_cell_size_is_refused_with_the_estimate(scene, capfd, monkeypatch):
    shots.walker(scene, frames=72)
    monkeypatch.setattr("softground_addon.core.loads.cell_limits.machine_memory", lambda: 2e9)
    said = refused(capfd, "--cell-size", "0.0001")
    assert "GB of memory" in said
    size = float(said.partition("at least ")[2].partition(" cm")[0]) / 1e2
    assert 1e-4 < size < 5e-3
    assert dry_run("--cell-size", max(size, 2e-3)) == 0


@pytest.mark.parametrize("memory", [None, 1e12])
@pytest.mark.slow
def test_an_absurd_cell_size_is_refused_on_a_machine_of_any_memory(scene, capfd, monkeypatch, memory):
    shots.walker(scene, frames=72)
    monkeypatch.setattr("softground_addon.core.loads.cell_limits.machine_memory", lambda: memory)
    said = refused(capfd, "--cell-size", "0.0001")
    assert "minutes are allowed: set a cell size" in said
    assert "Time Limit in Properties > Physics > Mesh and Look, or --set longest_bake=N, allows more" in said
    assert " 10 minutes are allowed" in refused(capfd, "--cell-size", "0.0001", "--set", "longest_bake=10")
    scene.frame_set(1)
    before = fingerprints.of_file()
    for operator in (bpy.ops.softground.bake, bpy.ops.softground.live):  # Match Depth presses cells of its own
        with pytest.raises(RuntimeError, match="minutes are allowed"):
            operator()
    assert fingerprints.of_file() == before


def test_whoever_allows_a_long_bake_gets_it(scene, capfd, monkeypatch):
    shots.walker(scene, frames=24)
    monkeypatch.setattr("softground_addon.core.loads.cell_limits.SECONDS_PER_CELL", 100.0)
    assert "hours" in refused(capfd, "--cell-size", "0.02")
    assert dry_run("--cell-size", "0.02", "--set", "longest_bake=10000") == 0, capfd.readouterr().err


def test_another_add_ons_failing_handler_does_not_spoil_a_bake(walker):
    calls = []

    def handler(*_):
        calls.append(1)
        raise RuntimeError("not ours")

    bpy.app.handlers.frame_change_post.append(handler)
    try:
        assert bake() == 0
    finally:
        bpy.app.handlers.frame_change_post.remove(handler)


FAMILY = rigs.Family(
    ("Hips", "Spine", "Chest", "Neck", "Head"),
    {part: "{s}" + "".join(word.title() for word in part.split("_")) for part in rigs.LIMBS},
)


def random_scene(chance):
    """A rig of any size that moves in some way over some ground."""
    scene = bpy.context.scene
    if chance.random() < 0.6:
        armature = shots.walker(scene, frames=chance.choice([3, 25, 40]), rate=chance.choice([12, 24, 60]))
    else:
        armature = rigs.human(FAMILY, turn=chance.uniform(0, 6))
        steps = {f: [chance.gauss(0, 0.3) for _ in range(3)] for f in range(1, 30, chance.choice([3, 9]))}
        rigs.key(armature, "location", steps)
    armature.scale = [chance.choice([0.01, 0.1, 1, 1, 1, 5, 100])] * 3
    armature.location = [chance.choice([0, 0, 3, -1e3]) for _ in range(3)]
    armature.rotation_euler = [chance.choice([0, 0, 0, 1]) for _ in range(3)]
    scene.unit_settings.scale_length = chance.choice([1, 1, 0.01, 100])
    scene.gravity = chance.choice([(0, 0, -9.81), (0, 0, -9.81), (0, 0, 0), (0, 0, -1.6), (5, 0, 5)])
    if chance.random() < 0.5:
        size = chance.choice([0.1, 4, 20, 500])
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=chance.choice([2, 60, 250]), y_subdivisions=60, size=size)
        ground = bpy.context.object
        ground.rotation_euler = [chance.choice([0, 0, 0.2, 1.5, 3.1]), 0, chance.random()]
        ground.scale = [chance.choice([1, 1, 1, -1, 0.001]) for _ in range(3)]
        if chance.random() < 0.3:
            for vertex in ground.data.vertices:
                vertex.co.z = chance.gauss(0, 0.02 * size)
        scene.softground.ground = ground
    material = scene.softground.material
    material.youngs_modulus = 10 ** chance.uniform(3, 8)
    material.poisson_ratio = chance.choice([0, 0.2, 0.5])
    material.characteristic_time = 10 ** chance.uniform(-3, 1)
    material.layer_depth = chance.choice([0.01, 0.3, 3])
    scene.softground.cell_size = chance.choice([0.005, 0.01, 0.01, 0.05, 0.5])
    bpy.context.view_layer.objects.active = armature


def fifty(first, *marks):
    return pytest.param(range(first, first + 50), marks=[*marks, pytest.mark.timeout(3600)])


@pytest.mark.parametrize(
    "numbers",
    [
        range(4),
        pytest.param(range(20), marks=pytest.mark.slow),
        *(fifty(first, pytest.mark.marathon) for first in range(0, 500, 50)),
    ],
    ids=lambda numbers: f"{numbers.start}-{numbers.stop}",
)
def test_a_random_scene_is_baked_or_refused_and_the_ground_is_finite(addon, capfd, monkeypatch, numbers):
    monkeypatch.setattr("softground_addon.core.loads.cell_limits.machine_memory", lambda: 1e9)  # giants are refused
    codes = {0: 0, 2: 0}
    for number in numbers:
        chance = random.Random(1000 + number)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        random_scene(chance)
        code = dry_run() if number % 2 else bake()
        said = capfd.readouterr().err
        assert code in codes, f"scene {number}: {said}"
        assert "Traceback" not in said, f"scene {number}: {said}"
        codes[code] += 1
        for mesh in bpy.data.meshes:
            positions = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
            mesh.attributes["position"].data.foreach_get("vector", positions)
            assert np.isfinite(positions).all(), f"scene {number}"
    print(codes)
    assert codes[0]
