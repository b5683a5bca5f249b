"""Manifests: TOML or JSON in, shots with absolute paths out, and an error that names the place otherwise."""

import glob
import json
import os
import string
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from softground_addon.batch import manifest
from softground_addon.batch.manifest import BatchShot
from softground_addon.core.errors import InputError

FOLDER = Path(os.path.realpath("/shows/night"))


def parse(text: str, folder: Path = FOLDER) -> tuple[BatchShot, ...]:
    return manifest.parse(text, folder, "night.toml")


def test_a_shot_takes_the_defaults_that_it_does_not_say_otherwise():
    first, second = parse(
        """
        [defaults]
        preset = "snow"
        cell_size = 0.02
        save = "baked/{name}.blend"
        report = "baked/{name}.json"
        set = { "material.layer_depth" = 0.4, keep_forces = true }

        [[shots]]
        file = "010.blend"

        [[shots]]
        file = "020.blend"
        name = "twenty"
        scene = "Layout"
        preset = "grounds/bog.json"
        frames = [-5, 1120]
        set.material.layer_depth = 0.5
        edits = "edits/{name}.json"
        grounds = ["Yard=grounds/bog.json", "Crate", "Stairs=Snow"]
        response = "keys"
        """
    )
    assert first == BatchShot(
        name="010",
        file=FOLDER / "010.blend",
        preset="snow",
        cell_size=0.02,
        settings=(("material.layer_depth", "0.4"), ("keep_forces", "true")),
        save=FOLDER / "baked/010.blend",
        report=FOLDER / "baked/010.json",
    )
    assert second.options == [
        "--scene=Layout",
        f"--preset={FOLDER / 'grounds/bog.json'}",
        f"--ground=Yard={FOLDER / 'grounds/bog.json'}",
        "--ground=Crate",
        "--ground=Stairs=Snow",
        "--frames=-5-1120",
        "--cell-size=0.02",
        "--set=material.layer_depth=0.5",
        "--set=keep_forces=true",
        f"--edits={FOLDER / 'edits/twenty.json'}",
        "--response=keys",
        f"--save={FOLDER / 'baked/twenty.blend'}",
        f"--report={FOLDER / 'baked/twenty.json'}",
    ]


def test_json_says_the_same_as_toml():
    content = {"defaults": {"in_place": True}, "shots": [{"file": "a.blend", "frames": [1, 9]}]}
    toml = parse('defaults.in_place = true\nshots = [{ file = "a.blend", frames = [1, 9] }]')
    assert manifest.parse(json.dumps(content), FOLDER, "night.json", is_json=True) == toml


def test_a_shot_says_in_place_against_a_default_save():
    (shot,) = parse('defaults.save = "{name}.x.blend"\nshots = [{ file = "a.blend", in_place = true }]')
    assert (shot.save, shot.in_place) == (None, True)
    assert shot.outputs == (FOLDER / "a.blend",)


def test_a_pattern_is_a_shot_for_each_file(tmp_path):
    folder = Path(os.path.realpath(tmp_path))
    for name in ("b.blend", "a.blend", 'it\'s "two"\nlines ❄.blend', "c.txt"):
        (folder / name).touch()
    for pattern in ("*.blend", str(folder / "*.blend")):
        text = f"shots = [{{ files = {json.dumps(pattern)}, in_place = true }}]"
        shots = parse(text, folder)
        assert [shot.name for shot in shots] == ["a", "b", 'it\'s "two"\nlines ❄']
        assert [shot.file for shot in shots] == sorted(folder.glob("*.blend"))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("shots = ", "is not readable as TOML"),
        ("", "has no shots"),
        ("shots = []", "has no shots"),
        ("shots = [3]", "shot 1: must be a table"),
        ("shot = []", "unknown key 'shot'.*defaults, shots"),
        ("defaults = 3\nshots = [{}]", "'defaults' must be a table"),
        ("defaults.file = 'a'\nshots = [{}]", "defaults: unknown key 'file'"),
        ("[[shots]]\nsave = 'b.blend'", "shot 1: give either 'file'"),
        ("[[shots]]\nfile = 'a.blend'\nfiles = '*.blend'", "give either 'file'"),
        ("[[shots]]\nfile = 'a.blend'", "nothing would be kept"),
        ("[[shots]]\nfile = 3\nin_place = true", "'file' is 3"),
        ("[[shots]]\nfile = ''\nin_place = true", "'file' is ''"),
        ("[[shots]]\nfile = 'a.blend'\nsave = './a.blend'", "say in_place"),
        ("[[shots]]\nfile = 'a.blend'\nsave = 'b.blend'\nin_place = true", "not both"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = 1", "'in_place' must be true or false"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\nframes = [9, 3]", "'frames' is"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\nframes = '1-3'", "'frames' is"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\nframes = [1, 99999999]", "'frames' is"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\ncell_size = nan", "number of metres"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\npreset = 1", "'preset' is 1"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\ngrounds = 'Yard'", "'grounds' is 'Yard'; it must be a list"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\ngrounds = ['']", "'grounds' is ''"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\nresponse = 'no'", "'response' is 'no'; .*'layer' or 'keys'"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\nscene = ''", "'scene' is ''"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\nset = 1", "must be a table"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\nset = { a = inf }", "'a' is inf"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\nset = { a = [1] }", r"'a' is \[1\]"),
        (f"[[shots]]\nfile = 'a.blend'\nin_place = true\nset.{'a.' * 3000}b = 1", "within more than 10 others"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\nname = 'a/b'", "without any of /"),
        ("[[shots]]\nfile = 'a.blend'\nin_place = true\nname = '..'", "without any of /"),
        (f"[[shots]]\nfile = 'a.blend'\nin_place = true\nname = '{'ä' * 76}'", "150 bytes"),
        ("[[shots]]\nfiles = '*.nothing'\nin_place = true", r"no file fits the pattern '\*.nothing'"),
        ("[[shots]]\nfiles = '*.blend'\nname = 'a'\nin_place = true", "leave 'name' out"),
        ("[[shots]]\nfile = 'a.blend'\nsave = 'x'\n[[shots]]\nfile = 'A.blend'\nsave = 'y'", "two shots are named 'A'"),
        ("defaults.save = 'x'\nshots = [{ file = 'a.blend' }, { file = 'b.blend' }]", "'a' and 'b' both write"),
        ("shots = [{ file = 'a.blend', save = 'b.blend' }, { file = 'b.blend', save = 'c' }]", "over the shot"),
        ("shots = [{ file = 'a.blend', save = 'b', report = 'b' }]", "both write"),
    ],
)
def test_a_broken_manifest_is_refused_with_the_place_and_what_is_wrong(text, says):
    with pytest.raises(InputError, match=says) as error:
        parse(text)
    assert str(error.value).startswith("night.toml")


@pytest.mark.parametrize("name", ["a:b", "a?", "a\tb", "bog.", "bog ", "con", "NUL", "aux.v2", "com1 .x", "LPT\u00b2"])
def test_on_windows_a_name_is_refused_whose_files_would_be_others_or_devices(monkeypatch, name):
    text = f"[[shots]]\nfile = 'a.blend'\nin_place = true\nname = {json.dumps(name)}"
    assert parse(text)[0].name == name
    monkeypatch.setattr("softground_addon.batch.manifest_values._WINDOWS", True)
    with pytest.raises(InputError, match="cannot be part of a file's name on Windows"):
        parse(text)


@pytest.mark.parametrize("name", ["010", "bog.v2", "console", "auxiliary", "com10", "a con", ".hidden", "x" * 150])
def test_on_windows_other_names_are_taken(monkeypatch, name):
    monkeypatch.setattr("softground_addon.batch.manifest_values._WINDOWS", True)
    assert parse(f"[[shots]]\nfile = 'a.blend'\nin_place = true\nname = '{name}'")[0].name == name


def test_all_missing_shots_are_named_at_once(tmp_path):
    (tmp_path / "there.blend").touch()
    path = tmp_path / "night.toml"
    path.write_text(
        "defaults.in_place = true\nshots = [{file='there.blend'}, {file='gone.blend'}, {file='lost.blend'}]"
    )
    with pytest.raises(InputError, match=r"2 of 3 shots are not there: '.*gone.blend', '.*lost.blend'"):
        manifest.load(path)


@pytest.mark.parametrize("content", [b"\xff\xfe", None])
def test_an_unreadable_manifest_is_named(tmp_path, content):
    path = tmp_path / "night.toml"
    if content:
        path.write_bytes(content)
    with pytest.raises(InputError, match=r"night\.toml' cannot be read"):
        manifest.load(path)


@pytest.mark.timeout(20)
def test_a_manifest_that_is_a_pipe_or_never_ends_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "huge.toml").touch()
    os.truncate(tmp_path / "huge.toml", 2**40)
    for path, says in ((tmp_path / "pipe.toml", "not a regular"), (Path("/dev/zero"), "not a regular"),
                       (tmp_path / "huge.toml", "larger than")):  # fmt: skip
        with pytest.raises(InputError, match=f"cannot be read.*{says}"):
            manifest.load(path)


@pytest.mark.parametrize(
    ("shots", "says"),
    [
        ("{ file = 'a.blend', save = 'night.toml' }", "'a' would write over the manifest"),
        ("{ file = 'a.blend', report = 'link/Night.TOML' }", "'a' would write over the manifest"),
        ("{ file = 'a.blend', report = 'bog.json' }, { file = 'b.blend', save = 'c', preset = 'bog.json' }",
         "'a' would write over a preset of 'b'"),
        ("{ file = 'a.blend', report = 'bog.json' }, { file = 'b.blend', save = 'c', grounds = ['Yard=bog.json'] }",
         "'a' would write over a preset of 'b'"),
        ("{ file = 'a.blend', report = 'e.json' }, { file = 'b.blend', save = 'c', edits = 'e.json' }",
         "'a' would write over the edits of 'b'"),
        ("{ file = 'a.blend', save = 'link/B.blend' }, { file = 'b.blend', save = 'c' }", "'a' would write over"),
        ("{ file = 'a.blend', save = 'x/C' }, { file = 'b.blend', save = 'x/c' }", "'a' and 'b' both write"),
        ("{ file = 'a.blend', in_place = true }, { name = 'other', file = 'a.blend', scene = 'B', save = 'c' }",
         "'a' would write over the shot"),
    ],
)  # fmt: skip
def test_no_result_takes_the_place_of_what_is_read_or_of_another(tmp_path, shots, says):
    for name in ("a.blend", "b.blend"):
        (tmp_path / name).write_text("a shot")
    (tmp_path / "link").symlink_to(tmp_path)
    path = tmp_path / "night.toml"
    path.write_text(f"shots = [{shots}]")
    with pytest.raises(InputError, match=says):
        manifest.load(path)


def test_shots_are_chosen_by_name_or_number():
    shots = parse("defaults.in_place = true\nshots = [{file='a.blend'}, {file='b.blend'}, {file='c.blend'}]")
    assert manifest.chosen(shots, []) == shots
    assert manifest.chosen(shots, ["c", "1", "3"]) == (shots[0], shots[2])
    for unknown in ("4", "0", "-1", "d"):
        with pytest.raises(InputError, match=f"no shot '{unknown}'. There are 3: a, b, c"):
            manifest.chosen(shots, [unknown])


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
KEYS = (
    *("name", "file", "files", "scene", "preset", "frames", "cell_size", "set", "edits"),
    *("save", "in_place", "report", "other"),
)
SHOTS = st.dictionaries(st.sampled_from(KEYS), VALUES, max_size=5)
LIKELY = st.fixed_dictionaries({"shots": st.lists(SHOTS, max_size=3)}, optional={"defaults": SHOTS})


@pytest.mark.slow
@given(LIKELY | VALUES)
def test_no_content_makes_anything_but_shots_or_a_clear_error(content):
    shots, message = (), ""
    try:
        shots = manifest.parse(json.dumps(content), FOLDER, "fuzz", is_json=True)
    except InputError as error:
        message = str(error)
    assert bool(shots) != message.startswith("fuzz")
    assert all(shot.file.is_absolute() and shot.outputs for shot in shots)
    assert all("\0" not in option for shot in shots for option in shot.options)


@given(st.text() | st.text(alphabet=string.punctuation + "ab=1\n"))
def test_no_text_makes_anything_but_shots_or_a_clear_error(text):
    for is_json in (False, True):
        with pytest.raises(InputError, match="fuzz"):
            manifest.parse(text, FOLDER, "fuzz", is_json=is_json)


def test_a_pattern_that_goes_through_a_whole_disk_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(manifest, "MOST_LOOKED_AT", 50)
    (tmp_path / "deep").mkdir()
    for number in range(60):
        (tmp_path / "deep" / f"{number}.txt").touch()
    (tmp_path / "a.blend").touch()
    for pattern in ("**/*.blend", "deep/*.blend", "**/**/**/**/*.blend", str(tmp_path / "**/x.blend")):
        with pytest.raises(InputError, match="goes through more than 50 files: name the folder"):
            manifest.parse(json.dumps({"shots": [{"files": pattern, "in_place": True}]}), tmp_path, "it", is_json=True)
    (shot,) = manifest.parse(
        json.dumps({"shots": [{"files": "*.blend", "in_place": True}]}), tmp_path, "it", is_json=True
    )
    assert shot.file == tmp_path / "a.blend"


def test_a_pattern_finds_what_a_shell_finds(tmp_path):
    for name in ("a/1.blend", "a/b/2.blend", "a/b/c/3.blend", "a/b/4.txt", "d/5.blend"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    patterns = (
        *("a/*.blend", "a/**/*.blend", "[ad]/?.blend", "a/b/../*.blend", "**/3.blend"),
        str(tmp_path / "d/*"),
    )
    expected = [glob.glob(str(tmp_path / pattern), recursive=True) for pattern in patterns]
    (tmp_path / "a" / "loop").symlink_to(tmp_path)  # which is not gone through
    for pattern, paths in zip(patterns, expected, strict=True):
        entry = {"files": pattern, "save": "out/{name}.blend"}
        shots = manifest.parse(json.dumps({"shots": [entry]}), tmp_path, "it", is_json=True)
        assert {shot.file for shot in shots} == {Path(os.path.realpath(path)) for path in paths}


@pytest.mark.parametrize(
    "text",
    [
        "[[shots]]\nfile = 'a.blend'\nin_place = true\nset = { " + "a." * 5000 + "b = 1 }",
        "[[shots]]\nfile = 'a.blend'\nin_place = true\ncell_size = 0x" + "f" * 5000,
        "[[shots]]\nfile = 'a.blend'\nframes = " + "[" * 300 + "]" * 300,
        "[[shots]]\nfile = 'a.blend'\nin_place = 0x" + "f" * 5000,
    ],
    ids=["nested", "huge number", "lists", "huge answer"],
)
def test_what_is_nested_or_long_without_end_is_refused(tmp_path, text):
    with pytest.raises(InputError, match="it"):
        manifest.parse(text, tmp_path, "it")


def test_settings_lie_within_ten_tables_and_no_more(tmp_path):
    def shots(depth):
        path = "a." * depth + "b"
        return manifest.parse(f"[[shots]]\nfile = 'a.blend'\nin_place = true\nset = {{ {path} = 1 }}", tmp_path, "it")

    assert shots(10)[0].settings == (("a." * 10 + "b", "1"),)
    with pytest.raises(InputError, match="within more than 10 others"):
        shots(11)
