"""Files are written whole or not at all."""

from pathlib import Path

import pytest

from softground_addon.core.errors import InputError
from softground_addon.core.files import replacing, write_text


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
