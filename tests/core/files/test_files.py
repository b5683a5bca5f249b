"""Files are written whole or not at all."""

import os
from functools import partial
from pathlib import Path

import pytest

from softground_addon.core.errors import InputError
from softground_addon.core.files import files
from softground_addon.core.files.files import (
    check_place,
    identity,
    read_regular,
    remove_leftovers,
    replacing,
    write_text,
)


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


class InUseError(PermissionError):
    """As Windows raises it for a file that another program has open."""

    winerror = 32


@pytest.mark.parametrize("times", [0, 3, 100])
def test_a_file_that_a_scanner_looks_at_for_a_moment_is_replaced(tmp_path, monkeypatch, times):
    rename, tries = Path.replace, []

    def replace(self, target):
        tries.append(self)
        if len(tries) <= times:
            raise InUseError(13, "in use", str(target))
        return rename(self, target)

    path, pauses = tmp_path / "a.json", []
    path.write_text("old")
    monkeypatch.setattr(Path, "replace", replace)
    monkeypatch.setattr("softground_addon.core.files.files.time.sleep", pauses.append)
    if times < 100:
        write_text(path, "new")
        assert path.read_text() == "new"
        assert len(pauses) == times
    else:
        with pytest.raises(InputError, match="could not be written"):
            write_text(path, "new")
        assert path.read_text() == "old"
        assert 1.0 < sum(pauses) < 3.0
    assert list(tmp_path.iterdir()) == [path]


def test_where_writing_is_forbidden_nobody_waits(tmp_path, monkeypatch):
    def replace(self, target):
        raise PermissionError(1, "not permitted", str(target))

    monkeypatch.setattr(Path, "replace", replace)
    monkeypatch.setattr("softground_addon.core.files.files.time.sleep", lambda pause: pytest.fail("waits"))
    with pytest.raises(InputError, match="not permitted"):
        write_text(tmp_path / "a.json", "new")


def test_a_failure_half_way_leaves_the_old_file(tmp_path: Path):
    path = tmp_path / "a.json"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError):
        write_half(path)
    assert path.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_a_missing_folder_is_named_with_a_remedy(tmp_path: Path):
    with pytest.raises(InputError, match=r"nowhere.*choose another folder"):
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


@pytest.mark.parametrize(
    "kind",
    [
        "folder",
        pytest.param("device", marks=pytest.mark.skipif(not Path("/dev/null").exists(), reason="devices")),
    ],
)
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


@pytest.mark.parametrize("other", ["010.v2.blend", "010.partial.blend", "0100.blend", "010.json", "010"])
def test_no_leftovers_of_another_file_are_taken_for_its_own(tmp_path: Path, other: str):
    with replacing(tmp_path / other) as partial:
        partial.write_text("being saved")
        remove_leftovers(tmp_path / "010.blend")
        assert partial.read_text() == "being saved"


def test_what_another_machine_writes_is_left_to_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "010.blend"
    monkeypatch.setattr(files, "_MACHINE", "0" * 8)
    with replacing(path) as partial:
        partial.write_text("being saved")
        monkeypatch.undo()
        remove_leftovers(path)
        assert partial.exists()


def test_two_writers_of_one_file_do_not_share_a_name(tmp_path: Path):
    path = tmp_path / "010.blend"
    with replacing(path) as first, replacing(path) as other:  # as in two containers with the same process id
        first.write_text("one")
        other.write_text("other")
        assert first != other
    assert path.read_text() == "one"


def test_what_blenders_own_saving_leaves_is_removed(tmp_path: Path):
    path, users = tmp_path / "010.blend", tmp_path / "010.blend@"
    users.touch()
    with pytest.raises(InputError), replacing(path) as partial:
        partial.with_name(f"{partial.name}@").write_text("half")  # it ends before it has renamed
    assert list(tmp_path.iterdir()) == [users]
    leftover = tmp_path / f"{partial.name}@"
    leftover.touch()
    remove_leftovers(path)
    assert list(tmp_path.iterdir()) == [users]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes and devices")
def test_pipes_devices_and_endless_files_are_not_read(tmp_path: Path):
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "pipe", Path("/dev/zero"), tmp_path):
        with pytest.raises(OSError, match="not a regular file"):
            read_regular(place, 1000)
    path = tmp_path / "a.json"
    path.write_text("content")
    assert read_regular(path, 7) == b"content"
    with pytest.raises(OSError, match="larger than 6 bytes"):
        read_regular(path, 6)


def test_a_file_has_one_identity_whatever_its_name(tmp_path: Path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    names = ("real/Ä.blend", "link/Ä.blend", "real/../link/ä.BLEND", "real/A\u0308.blend")
    assert len({identity(tmp_path / name) for name in names}) == 1
    assert identity(tmp_path / "real/a.blend") != identity(tmp_path / "real/b.blend")


class Disk:
    """What a power cut leaves of a folder: of each file what was synced, under the names that were synced with it."""

    def __init__(self, monkeypatch, folder):
        self.folder, self.written, self.names = folder, {}, {}
        self.keep_names()
        fsync, replace = os.fsync, Path.replace
        self.log = []

        def synced(handle):
            fsync(handle)
            path = Path(os.readlink(f"/proc/self/fd/{handle}"))
            if path == folder:
                self.keep_names()
            else:
                self.written[path.stat().st_ino] = path.read_bytes()
            self.log.append(path.name)

        def replaced(path, target):
            self.log.append("rename")
            return replace(path, target)

        monkeypatch.setattr(os, "fsync", synced)
        monkeypatch.setattr(Path, "replace", replaced)

    def keep_names(self):
        for path in self.folder.iterdir():
            self.written.setdefault(path.stat().st_ino, path.read_bytes())
        self.names = {path.name: path.stat().st_ino for path in self.folder.iterdir()}

    def after_power_cut(self):
        return {name: self.written[node] for name, node in self.names.items()}


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="asks Linux for the names of open files")
@pytest.mark.parametrize("before", [None, "old"])
def test_what_is_done_stays_done_after_a_power_cut(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, before: str | None):
    path = tmp_path / "a.json"
    if before is not None:
        path.write_text(before)
    disk = Disk(monkeypatch, tmp_path)
    with replacing(path) as partial:
        partial.write_text("new")
        old = {} if before is None else {"a.json": before.encode()}
        assert disk.after_power_cut() == old
    assert disk.after_power_cut() == {"a.json": b"new"}
    assert disk.log[1:] == ["rename", tmp_path.name]  # the content first, then the name, then the folder


def test_a_name_that_is_no_text_is_refused_beforehand(tmp_path: Path):
    with pytest.raises(InputError, match="not Unicode text"):
        check_place(tmp_path / "a\udcff.json")
