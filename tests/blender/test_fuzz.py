"""Whatever is in a preset, a manifest, a record or a command line: a result or a clear error, and no changed file."""

import io
import json
import string
import zipfile

import bpy
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from softground_addon.batch import manifest
from softground_addon.blender.command_line import cli
from softground_addon.blender.ground import ground_mesh
from softground_addon.core.errors import InputError
from softground_addon.core.ground import presets
from softground_addon.core.record import record
from tests.blender import shots

QUICK = 40


def counts(whole):
    """Few inputs in the quick tests, a tenth in the slow ones, all in the marathon; the four kinds make 20,000."""
    return pytest.mark.parametrize(
        "count",
        [QUICK, pytest.param(whole // 10, marks=pytest.mark.slow), pytest.param(whole, marks=pytest.mark.marathon)],
    )


def each(strategy, count, check):
    """Check so many inputs."""

    @settings(max_examples=count, database=None, suppress_health_check=list(HealthCheck))
    @given(strategy)
    def all_of_them(value):
        check(value)

    all_of_them()


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


@counts(8000)
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


@counts(8000)
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


def rezipped(content, name, change):
    """The record with one member changed and every checksum right."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(buffer, "w") as target:
        for member in source.namelist():
            target.writestr(member, change if member == name else source.read(member))
    return buffer.getvalue()


@counts(3500)
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
