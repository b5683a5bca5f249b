"""Whatever is in a preset, a manifest, a record or a command line: a result or a clear error, and no changed file."""

import contextlib
import io
import json
import os
import signal
import string
import struct
import time
import tracemalloc
import warnings
import zipfile
from functools import cache
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from softground_addon.batch import manifest
from softground_addon.blender import handlers, jobs
from softground_addon.blender.animation_layer.constraint_layer import LayerKind
from softground_addon.blender.baking import bake_job, bake_report, step_edits, step_soles
from softground_addon.blender.command_line import cli
from softground_addon.blender.ground import baked_ground, ground_mesh
from softground_addon.blender.panels import panels, response_panel
from softground_addon.blender.response import response_job
from softground_addon.blender.weather import ground_weather as weather
from softground_addon.core.composers.edited_steps import EditedSteps
from softground_addon.core.errors import InputError
from softground_addon.core.ground import presets
from softground_addon.core.ground.heightfield import FlatTerrain
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.ground.soft_ground import SoftGround
from softground_addon.core.playback.vertex_histories import vertex_histories
from softground_addon.core.record import record
from softground_addon.core.record.edits import StepEdit, step_id
from tests.blender import shots, weathered_shots
from tests.blender.steps.test_edited_steps import plate

QUICK = 40
WHOLE: list[int] = []
"""Inputs of each kind in the marathon."""

HANG_S = 20
"""What an input may take [s of the processor, so that a busy machine decides nothing]."""


def counts(whole, *quick):
    """A twentieth of the inputs in the slow tests, all in the marathon, and maybe a few in the quick tests."""
    WHOLE.append(whole)
    return pytest.mark.parametrize(
        "count",
        [*quick, pytest.param(whole // 20, marks=pytest.mark.slow), pytest.param(whole, marks=pytest.mark.marathon)],
    )


def hangs(*_):
    raise AssertionError(f"an input takes more than {HANG_S} s")


@contextlib.contextmanager
def no_hang():
    """Raise in what takes too long; where the system has such a clock."""
    if not hasattr(signal, "ITIMER_PROF"):
        yield
        return
    before = signal.signal(signal.SIGPROF, hangs)
    signal.setitimer(signal.ITIMER_PROF, HANG_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def each(strategy, count, check):
    """Check so many inputs, each within its time."""
    drawn = 0

    @settings(max_examples=count, database=None, suppress_health_check=list(HealthCheck))
    @given(strategy)
    def all_of_them(value):
        nonlocal drawn
        drawn += 1
        with no_hang():
            check(value)

    all_of_them()
    print(f"{drawn:,} inputs")
    assert drawn >= count


def test_the_tiers_draw_what_is_promised():
    assert sum(WHOLE) >= 50_000
    assert sum(whole // 20 for whole in WHOLE) >= 2_000


def test_an_input_that_hangs_is_noticed(monkeypatch):
    monkeypatch.setitem(globals(), "HANG_S", 0.1)

    def check(_):
        end = time.process_time() + 10.0
        while time.process_time() < end:
            pass

    with pytest.raises(AssertionError, match="takes more than"):
        each(st.just(1), 1, check)


def mutated(content):
    """Bytes near `content`: cut, overwritten, repeated."""
    place = st.integers(0, len(content))
    return st.one_of(
        place.map(lambda end: content[:end]),
        st.tuples(place, st.binary(max_size=8)).map(
            lambda at: content[: at[0]] + at[1] + content[at[0] + len(at[1]) :]
        ),
        st.tuples(place, place).map(lambda at: content[: at[0]] + content[at[1] :]),
    )


@counts(8000, QUICK)
def test_no_preset_file_makes_a_traceback(count, tmp_path):
    path = tmp_path / "fuzz.json"
    valid = (presets.FOLDER / "snow.json").read_bytes()

    def check(content):
        path.write_bytes(content)
        try:
            presets.load(path)
        except InputError as error:
            assert "fuzz.json" in str(error)  # noqa: PT017

    each(mutated(valid) | st.binary(max_size=64), count, check)


@counts(8000, QUICK)
def test_no_manifest_file_makes_a_traceback(count, tmp_path):
    (tmp_path / "a.blend").touch()
    valid = (
        b'[defaults]\npreset = "snow"\nsave = "baked/{name}.blend"\nset = { "material.layer_depth" = 0.4 }\n'
        b'[[shots]]\nfile = "a.blend"\nframes = [1, 20]\ncell_size = 0.01\n'
        b'[[shots]]\nfiles = "*.blend"\nin_place = true\n'
    )

    def check(content):
        for name in ("fuzz.toml", "fuzz.json"):
            (tmp_path / name).write_bytes(content)
            try:
                manifest.load(tmp_path / name)
            except InputError as error:
                assert "fuzz." in str(error)  # noqa: PT017

    each(mutated(valid) | st.binary(max_size=64), count, check)


INPUTS = ("night.json", "shots/a.blend", "shots/b.blend", "snow.json")
OUTPUTS = ("out/a.blend", "out/b.blend", "out/a.json", "out/b.json")


def aliases(name):
    """Other ways to say where a file is: through links, around corners, in other letters."""
    folder, _, last = name.rpartition("/")
    inside = f"{folder}/" if folder else ""
    return st.sampled_from([
        *(name, name, f"./{name}", f"out/../{name}", f"linked/{name}", f"{inside}{last.upper()}"),
        *(f"{inside}../{folder}/{last}" if folder else name, f"linked/out/../{name}"),
    ])  # fmt: skip


@counts(5000, QUICK)
def test_no_result_of_a_batch_takes_the_place_of_anything_else(count, tmp_path):
    for folder in ("shots", "out"):
        (tmp_path / folder).mkdir()
    (tmp_path / "linked").symlink_to(tmp_path)
    for name in INPUTS[1:]:
        (tmp_path / name).touch()

    def is_one(path):
        return os.path.realpath(tmp_path / path).lower()

    def check(drawn):
        sources, places = drawn
        entries = [
            {"file": source, "preset": "snow.json", "save": save, "report": report}
            for source, (save, report) in zip(sources, places, strict=True)
        ]
        (tmp_path / "night.json").write_text(json.dumps({"shots": entries}))
        written = [is_one(path) for pair in places for path in pair]
        collides = len(set(written)) < len(written) or not {is_one(name) for name in INPUTS}.isdisjoint(written)
        try:
            manifest.load(tmp_path / "night.json")
            assert not collides, entries
        except InputError as error:
            assert collides, error  # noqa: PT017

    place = st.sampled_from([*OUTPUTS * 3, *INPUTS]).flatmap(aliases)
    sources = st.just(["shots/a.blend", "shots/b.blend"])
    each(st.tuples(sources, st.lists(st.tuples(place, place), min_size=2, max_size=2)), count, check)


@pytest.fixture(scope="module")
def stored(addon, tmp_path_factory):
    """The record of a real bake."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    shots.walker(bpy.context.scene, frames=30)
    report = tmp_path_factory.mktemp("bake") / "report.json"
    assert cli.run_in_blender(["bake", "--progress=none", f"--report={report}"]) == 0
    (mesh,) = [mesh for mesh in bpy.data.meshes if ground_mesh.RECORD in mesh.keys()]  # noqa: SIM118
    content = bytes(mesh[ground_mesh.RECORD])
    record.load(content)
    return content


def rezipped(content, name, change, method=zipfile.ZIP_STORED):
    """The record with one member changed and every checksum right."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(buffer, "w", method) as target:
        for member in source.namelist():
            target.writestr(member, change if member == name else source.read(member))
    return buffer.getvalue()


@counts(3500, QUICK)
def test_no_record_makes_a_traceback(count, stored):
    with zipfile.ZipFile(io.BytesIO(stored)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    inside = st.sampled_from(sorted(members)).flatmap(
        lambda name: mutated(members[name]).map(lambda change: rezipped(stored, name, change))
    )

    def check(content):
        try:
            loaded = record.load(content)
        except InputError:
            return
        assert isinstance(loaded.about, dict)
        assert all(footprint.max_depth_m >= 0 for footprint in loaded.footprints)

    each(mutated(stored) | inside, count, check)


NUMBERS = (0.0, -1.0, 1e-300, 1e300, 2.0**31 - 1, -(2.0**31), 2.0**53, float("nan"), float("inf"), 1e9)
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)


def numbers_of(member):
    """The numbers of an array of the record, and its header."""
    start = 10 + int.from_bytes(member[8:10], "little")
    kind = np.int32 if b"<i4" in member[:start] else np.float64
    return np.frombuffer(member, kind, offset=start).copy(), member[:start]


def forged_array(member):
    """The array with some of its numbers replaced, all of them, or fewer or more of them than it says."""
    values, header = numbers_of(member)

    def with_number(at_and_value):
        at, value = at_and_value
        changed = values.copy()
        with np.errstate(invalid="ignore"):
            changed[at] = np.float64(value).astype(values.dtype)
        return header + changed.tobytes()

    where = st.integers(0, max(0, len(values) - 1)).map(lambda at: slice(at, at + 1)) | st.just(slice(None))
    numbers = st.sampled_from(NUMBERS) | st.floats() | st.integers(-10, 10).map(float)
    kinds = st.sampled_from(["<f8", "<i4", "<c16", "|O", "<M8[s]", "|S8", "<f2", "|b1", "<U2", "<u8"])
    return st.one_of(
        st.tuples(where, numbers).map(with_number),
        kinds.map(lambda kind: header.replace(b"<f8", kind.encode()).replace(b"<i4", kind.encode()) + values.tobytes()),
        st.integers(0, 64).map(lambda count: header + bytes(count)),
    )


def forged_text(member):
    """The record's text with a value anywhere in it replaced, or taken away."""
    odd = st.sampled_from([None, True, -1, 0, 1e300, "", "x", [], {}, [[]], {"a": 1}, 10**400, "\ud800", float("nan")])
    text = json.loads(member)

    def places(value, path=()):
        yield path
        for key, inner in (
            value.items() if isinstance(value, dict) else enumerate(value[:3]) if isinstance(value, list) else ()
        ):
            yield from places(inner, (*path, key))

    def replaced(at_and_value):
        (*path, last), value, gone = at_and_value
        changed = inner = json.loads(member)
        for key in path:
            inner = inner[key]
        if gone:
            del inner[last]
        else:
            inner[last] = value
        return json.dumps(changed).encode()

    somewhere = st.sampled_from(sorted(text)).flatmap(lambda key: st.sampled_from([*places(text[key], (key,))]))
    return st.tuples(somewhere, odd, st.booleans()).map(replaced) | odd.map(lambda value: json.dumps(value).encode())


def forged_by_member(stored):
    """Records of which one part is forged, compressed in some way, beside another one that no record has."""
    with zipfile.ZipFile(io.BytesIO(stored)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}

    def put_together(parts):
        name, change, method, extra, copies = parts
        buffer = io.BytesIO()
        with warnings.catch_warnings(), zipfile.ZipFile(buffer, "w", method) as target:
            warnings.simplefilter("ignore")  # two parts of one name
            for member, content in members.items():
                for _ in range(copies if member == name else 1):
                    target.writestr(member, change if member == name else content)
            for junk in extra:
                target.writestr(junk, bytes(1000))
        return buffer.getvalue()

    changed = st.sampled_from(sorted(members)).flatmap(
        lambda name: st.tuples(
            st.just(name),
            forged_array(members[name]) if name.endswith(".npy") else forged_text(members[name]),
            st.sampled_from((*METHODS[1:2] * 6, *METHODS)),
            st.sampled_from([(), (), (), ("extra.npy",), ("../../x",)]),
            st.sampled_from([1, 1, 1, 0, 2]),
        )
    )
    return changed.map(put_together)


@counts(20_000, QUICK)
@pytest.mark.timeout(3600)
def test_a_record_forged_by_member_is_read_within_its_bounds_or_refused(count, stored):
    def check(content):
        try:
            loaded = record.load(content)
        except InputError:
            return
        footprints, about = loaded.footprints, loaded.about
        vertex_histories(footprints, np.zeros(1), np.zeros(1), blur_sigma=0.005)
        for footprint in footprints:
            assert 1e-5 <= footprint.cell_size <= 10
            assert footprint.frame_step >= 1e-3
        with contextlib.suppress(InputError):
            assert 0.0 <= baked_ground.baked_with(about, "blur_sigma") <= 1.0

    each(forged_by_member(stored), count, check)


@counts(1000, QUICK)
@pytest.mark.timeout(3600)
def test_steps_of_a_forged_record_are_pressed_again_or_refused(count, stored):
    with zipfile.ZipFile(io.BytesIO(stored)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    ground = SoftGround(FlatTerrain(), GroundMaterial(0.3e6, 0.3, 0.1), "CENTRE_OF_PRESSURE")
    made_of = sorted(name for name in members if name.startswith(("contact.", "soles.")))
    forged = st.sampled_from(made_of).flatmap(
        lambda name: forged_array(members[name]).map(lambda change: rezipped(stored, name, change))
    )

    def check(content):
        with contextlib.suppress(InputError), np.errstate(all="ignore"):
            footprints = record.load(content).footprints
            EditedSteps(footprints, ground, footprints[1].cell_size).pressed_again({1: StepEdit(move_m=(0.1, 0.0))})

    each(forged, count, check)


@pytest.fixture(scope="module")
def felt(addon, tmp_path_factory):
    """A file with a bake in weather that its steps feel, with debris, and with a step that a mesh's sole presses."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    weathered_shots.added_walker(scene)
    scene.softground.sink_feet, scene.softground.cell_size = False, 0.05
    scene.softground.debris = scene.softground.steps_feel_weather = True
    plate(scene)
    bpy.ops.softground.bake()
    bpy.ops.softground.add_weather()
    assert bpy.ops.softground.bake() == {"FINISHED"}
    bake = jobs.run(step_edits.reading(scene))
    shoe = {step_id(bake.record.footprints[0]): StepEdit(sole="Shoe")}
    jobs.run(step_edits.editing(bake, step_soles.edits_with_soles(scene.objects, bake.made_with, shoe)))
    path = tmp_path_factory.mktemp("felt") / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@counts(1000)
@pytest.mark.timeout(3600)
def test_steps_and_weather_of_a_forged_bake_are_edited_or_refused(count, felt):
    bpy.ops.wm.open_mainfile(filepath=str(felt))
    scene = bpy.context.scene
    ground = scene.softground.ground
    mesh = ground_mesh.mesh_of(baked_ground.display_mesh_of(ground))
    content = bytes(mesh[ground_mesh.RECORD])
    loaded = record.load(content)
    (edited,) = loaded.edits.values()
    assert all((loaded.throws, loaded.thrown, loaded.about["inputs"]["weather"], edited.mesh))
    moved = {step_id(loaded.footprints[1]): StepEdit(move_m=(0.1, 0.0), shift_frames=2)}
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        text = archive.read("record.json")

    def check(forged):
        made = rezipped(content, "record.json", forged, zipfile.ZIP_DEFLATED)
        mesh.pop(ground_mesh.RECORD, None)  # an array that is there would keep its length
        mesh[ground_mesh.RECORD] = np.frombuffer(made + bytes(-len(made) % 4), np.int32)
        assert isinstance(bake_report.stale_reasons(scene), tuple)
        assert handlers.compare_bake() is None
        with contextlib.suppress(InputError), np.errstate(all="ignore"):
            jobs.run(step_edits.editing(jobs.run(step_edits.reading(scene)), moved))
        with contextlib.suppress(InputError), np.errstate(all="ignore"):
            weather.add(ground)
        bpy.context.view_layer.update()

    bad_values = [
        ("material", {"crust_stress": None}),
        ("painted", ""),
        ("pressure", "x"),
        ("frames", [float("nan"), 9]),
    ]
    for name, value in bad_values:  # which the marathon did
        forged = json.loads(text)
        inputs = forged["about"]["inputs"]
        inputs[name] = inputs[name] | value if isinstance(value, dict) else value
        check(json.dumps(forged).encode())
    each(forged_text(text), count, check)


@cache
def bomb(stored, method):
    """The record with a part more, of a gigabyte of zeros in little space."""
    buffer = io.BytesIO(stored)
    with (
        zipfile.ZipFile(buffer, "a", method, compresslevel=1) as archive,
        archive.open("more.npy", "w", force_zip64=True) as member,
    ):
        for _ in range(64):
            member.write(bytes(2**24))
    return buffer.getvalue()


@pytest.mark.slow
@pytest.mark.parametrize("announced", [None, 1000])
def test_an_unused_part_that_unpacks_to_a_gigabyte_takes_no_memory(stored, announced):
    content, size = bomb(stored, zipfile.ZIP_DEFLATED), struct.pack("<I", 2**30)
    assert size in content
    if announced is not None:
        content = content.replace(size, struct.pack("<I", announced))
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="clear the bake"):
            record.load(content)
        assert tracemalloc.get_traced_memory()[1] < 5e7
    finally:
        tracemalloc.stop()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["contact_cells.npy", "record.json"])
def test_a_part_that_unpacks_to_far_more_than_a_record_has_takes_no_memory(stored, name):
    content = rezipped(stored, name, bytes(2**28), zipfile.ZIP_DEFLATED)
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="clear the bake"):
            record.load(content)
        assert tracemalloc.get_traced_memory()[1] < 5e7
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("value", [-1.0, 2.0, 1e300, float("nan"), "x", None])
def test_a_blur_that_no_ground_has_is_refused(value):
    with pytest.raises(InputError, match="blur_sigma"):
        baked_ground.baked_with({"inputs": {"material": {"blur_sigma": value}}}, "blur_sigma")


@pytest.mark.parametrize("method", METHODS[2:])
def test_parts_compressed_in_other_ways_are_refused(stored, method):
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(stored)) as source, zipfile.ZipFile(buffer, "w", method) as target:
        for name in source.namelist():
            target.writestr(name, source.read(name))
    content = bytearray(buffer.getvalue())
    content[80] ^= 0xFF  # which lzma says in its own way
    for forged in (buffer.getvalue(), bytes(content)):
        with pytest.raises(InputError, match="damaged"):
            record.load(forged)


@pytest.fixture
def forgeable(scene):
    """A bake on a ground and a response on its character, with all that keeps them apart from the meshes."""
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    scene.softground.cell_size, scene.softground.grounding.use = 0.05, True
    jobs.run(bake_job.bake(scene))
    mesh = scene.softground.ground.data
    return scene, mesh, bpy.data.objects[LayerKind.RESPONSE.value]


PROPERTY_VALUES = st.one_of(
    st.sampled_from([0, -1, 2**31 - 1, 1e300, float("nan"), "", "x", "[]", "{}", '{"?:x": "1"}', "[[", "[" * 5000]),
    st.sampled_from([[1, 2], [0.5], {}, {"steps": "many"}, {"steps": 1, "max_depth_m": float("inf")}, True, b"x"]),
    st.sampled_from(
        ['{"settings": []}', '{"version": "4.5", "future:Walker": "9"}', '[{"frame": null}]', '["gap_mm"]']
    ),
    st.text(max_size=8).filter(lambda text: "\0" not in text),
)


@counts(5000)
@pytest.mark.timeout(3600)
def test_no_stored_property_makes_a_traceback(count, forgeable):
    scene, mesh, action = forgeable
    names = [(mesh, name) for name in ground_mesh.PROPERTIES]
    names += [(action, name) for name in (response_job.ROOT_CONTROL, response_job.SPEED, response_job.WORST)]
    values = {(owner.name, name): owner[name] for owner, name in names if owner.get(name) is not None}
    values = {
        key: value
        if isinstance(value, str | float)
        else value.to_dict()
        if hasattr(value, "to_dict")
        else value.to_list()
        for key, value in values.items()
    }

    def check(forged):
        (owner, name), value = forged
        before = values.get((owner.name, name))
        owner[name] = value
        try:
            assert isinstance(bake_report.stale_reasons(scene), tuple)
            assert handlers.compare_bake() is None
            for panel in (panels.SOFTGROUND_PT_bake, response_panel.SOFTGROUND_PT_feet):
                panel.draw(drawn(), bpy.context)
            with contextlib.suppress(InputError):
                baked_ground.load(scene.softground.ground)
        finally:
            del owner[name]
            if before is not None:
                owner[name] = before

    each(st.tuples(st.sampled_from(names), PROPERTY_VALUES), count, check)


FORGED = {
    "FLOAT": (float("nan"), float("inf"), -1e38),
    "INT": (-(2**31), 2**31 - 1),
    "ENUM": (-1, 99),
    "STRING": ("x" * 3000,),
    "BOOLEAN": (7,),
}
"""Values that no field of a kind takes; stored past its bounds, as forged files have them."""


def stored_fields(group):
    """Each field below a group of settings that holds a value, with the group that it is of."""
    for field in group.bl_rna.properties:
        if field.identifier in ("rna_type", "name"):
            continue
        value = getattr(group, field.identifier)
        if field.type == "COLLECTION" and len(value):
            yield from stored_fields(value[0])
        elif isinstance(value, bpy.types.PropertyGroup):
            yield from stored_fields(value)
        elif field.type in FORGED:
            yield group, field


@pytest.mark.marathon
@pytest.mark.timeout(1800)
@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="scripts do not reach what Blender 5 stores of such fields")
def test_no_stored_setting_makes_a_traceback(scene, capfd):
    shots.walker(scene, frames=30)
    bpy.ops.softground.add_character()
    character = scene.softground.characters[0]
    lock = character.holds.add()
    lock.foot, lock.frame = character.soles[0].name, 5
    scene.softground.cell_size = 0.05
    bpy.ops.softground.bake()
    fields = list(stored_fields(scene.softground))
    assert len(fields) > 50
    for group, field in fields:
        name = field.identifier
        before = group.get(name)
        for value in FORGED[field.type]:
            group[name] = [value] * field.array_length if getattr(field, "is_array", False) else value
            for operator in (bpy.ops.softground.bake, bpy.ops.softground.clean_feet):
                with contextlib.suppress(RuntimeError):
                    operator()
            said = "".join(capfd.readouterr())
            assert "Traceback" not in said, (name, value, said)
            for panel in (panels.SOFTGROUND_PT_character, panels.SOFTGROUND_PT_ground, panels.SOFTGROUND_PT_bake):
                panel.draw(drawn(), bpy.context)
            assert handlers.compare_bake() is None
        if before is None:
            del group[name]
        else:
            group[name] = before


def drawn():
    """A panel whose layout takes whatever is drawn."""
    panel = MagicMock()
    panel.layout.operator.return_value = MagicMock()
    return panel


OPTIONS = (
    "--preset",
    "--frames",
    "--cell-size",
    "--set",
    "--save",
    "--in-place",
    "--report",
    "--progress",
    "--dry-run",
)
VALUES = st.one_of(
    st.sampled_from(["snow", "1-9", "0.02", "none", "json", "material.youngs_modulus=1e6", "characters[0].mass=1e30"]),
    st.sampled_from(
        ["material", "material.preset=x", "ground=Walker", "characters[-1].mass=3", "9-1", "nan", "-inf", ""]
    ),
    st.text(string.printable, max_size=12),
    st.text(max_size=6),
)


@counts(500)
@pytest.mark.timeout(3600)
def test_no_command_line_makes_a_traceback_or_changes_the_shot(count, addon, tmp_path, monkeypatch, capfd):
    shot = tmp_path / "shot.blend"
    bpy.ops.wm.read_factory_settings(use_empty=True)
    shots.walker(bpy.context.scene, frames=9)
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    content = shot.read_bytes()
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)

    def check(arguments):
        arguments = [argument.replace("/", "_").replace("\\", "_") for argument in arguments]  # stay in this folder
        bpy.ops.wm.open_mainfile(filepath=str(shot))
        assert cli.run_in_blender(arguments) in (0, 2)
        assert "Traceback" not in capfd.readouterr().err
        assert "--in-place" in arguments or shot.read_bytes() == content
        shot.write_bytes(content)

    option = st.one_of(
        st.sampled_from(OPTIONS).map(lambda name: [name]),
        st.tuples(st.sampled_from(OPTIONS), VALUES).map(list),
        st.tuples(st.sampled_from(OPTIONS), VALUES).map(lambda pair: ["=".join(pair)]),
        VALUES.map(lambda value: [value]),
    )
    lines = st.lists(option, max_size=4).map(lambda parts: ["bake", *(word for part in parts for word in part)])
    each(lines | st.lists(VALUES, max_size=3) | lines.map(lambda line: [*line, "--dry-run"]), count, check)


def test_a_record_that_claims_to_be_huge_is_refused(stored):
    """An array that says it has a trillion values must not be believed."""
    with zipfile.ZipFile(io.BytesIO(stored)) as archive:
        name = next(name for name in archive.namelist() if name.endswith(".npy"))
        member = archive.read(name)
    header = member[10 : 10 + int.from_bytes(member[8:10], "little")]
    claimed = header.decode().split("'shape': ")[1].split(")")[0] + ")"
    lie = header.decode().replace(claimed, "(999999999999,)")[: len(header) - 1].rstrip().ljust(len(header) - 1) + "\n"
    with pytest.raises(InputError, match="damaged"):
        record.load(rezipped(stored, name, member[:10] + lie.encode() + member[10 + len(header) :]))


def test_a_record_that_claims_to_be_encrypted_is_refused(stored):
    """As one flipped bit of the archive's directory makes it."""
    spoiled = bytearray(stored)
    spoiled[stored.index(b"PK\x01\x02") + 8] |= 1
    with pytest.raises(InputError, match="damaged"):
        record.load(bytes(spoiled))


def test_json_nested_without_end_is_refused(stored):
    with pytest.raises(InputError):
        record.load(rezipped(stored, "record.json", b"[" * 100_000))
    with pytest.raises(InputError):
        manifest.parse(json.dumps({"shots": 1})[:-1] + "[" * 100_000, manifest.Path("/"), "fuzz", is_json=True)
