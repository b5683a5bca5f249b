"""Files are written whole or not at all."""

import os
from functools import partial
from pathlib import Path

import pytest

from softground_addon.core.errors import InputError
from softground_addon.core.files.files import check_place, remove_leftovers, replacing, write_text


def write_half(path):
    with replacing(path) as partial:
        partial.write_text("half")
        raise ZeroDivisionError


def write_to_full_disk(path, full):
    with replacing(path) as partial:
        partial.symlink_to(full)
        partial.write_text("x" * 100_000)


def test_text_is_written(tmp_path: Path):
    write_text(tmp_path / "a.json", "snow ❄\n")
    assert (tmp_path / "a.json").read_text(encoding="utf-8") == "snow ❄\n"
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_a_failure_half_way_leaves_the_old_file(tmp_path: Path):
    path = tmp_path / "a.json"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError):
        write_half(path)
    assert path.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_a_missing_folder_is_named_with_a_remedy(tmp_path: Path):
    with pytest.raises(InputError, match=r"nowhere.*choose another place"):
        write_text(tmp_path / "nowhere" / "a.json", "text")


def test_a_full_disk_is_named_and_leaves_the_old_file(tmp_path: Path):
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("no /dev/full on this system")
    path = tmp_path / "a.json"
    path.write_text("old")
    with pytest.raises(InputError, match="free disk space"):
        write_to_full_disk(path, full)
    assert path.read_text() == "old"


@pytest.mark.skipif(os.name != "posix", reason="permissions")
def test_a_file_that_a_group_may_write_stays_so(tmp_path: Path):
    path = tmp_path / "a.json"
    path.write_text("old")
    path.chmod(0o664)
    write_text(path, "new")
    assert (path.read_text(), path.stat().st_mode & 0o777) == ("new", 0o664)


def test_a_file_that_is_protected_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "a.json"
    path.write_text("old")
    monkeypatch.setattr(os, "access", lambda place, _mode: place != path)  # root may write anything
    for write in (check_place, partial(write_text, text="new")):
        with pytest.raises(InputError, match=r"a\.json' is write-protected"):
            write(path)
    assert path.read_text() == "old"


@pytest.mark.parametrize("kind", ["folder", "device"])
def test_what_is_no_file_is_not_replaced(tmp_path: Path, kind: str):
    path = tmp_path if kind == "folder" else tmp_path / "null"
    if kind == "device":
        path.symlink_to("/dev/null")
    with pytest.raises(InputError, match="not a file"):
        write_text(path, "text")
    assert path.exists()


def test_a_place_is_tried_beforehand_and_nothing_is_left_there(tmp_path: Path):
    path = tmp_path / "a.json"
    path.write_text("old")
    for place in (path, tmp_path / "new.json"):
        check_place(place)
    assert [(entry.name, entry.read_text()) for entry in tmp_path.iterdir()] == [("a.json", "old")]


@pytest.mark.parametrize(
    ("place", "says"),
    [("nowhere/a.json", "does not exist: create it"), (".", "not a file"), ("x" * 250 + ".json", "too long")],
)
def test_a_place_that_cannot_be_written_is_named_beforehand(tmp_path: Path, place: str, says: str):
    with pytest.raises(InputError, match=says):
        check_place(tmp_path / place)
    assert not list(tmp_path.iterdir())


def test_leftovers_of_a_killed_writer_are_found_by_their_name(tmp_path: Path):
    path = tmp_path / "a[1].json"
    with replacing(path) as partial:
        partial.write_text("half")
        other = tmp_path / partial.name.replace("a[1]", "b")
        other.write_text("of another file")
        remove_leftovers(path)
        assert not partial.exists()
        partial.write_text("whole")
    assert {entry.name for entry in tmp_path.iterdir()} == {"a[1].json", other.name}
