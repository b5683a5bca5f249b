"""A receipt says that a shot is done only while what it read and wrote is on disk, byte for byte."""

import json
import os
import re
from pathlib import Path

import pytest

from softground_addon.batch import receipts

ROOT = Path(__file__).parents[2]
OPTIONS = ["--preset=snow", "--save=baked.blend"]


@pytest.fixture
def baked(tmp_path):
    """A shot with a linked rig, its results and their receipt."""
    for name in ("shot.blend", "rig.blend", "baked.blend", "report.json"):
        (tmp_path / name).write_text(name)
    write(tmp_path)
    return tmp_path


def write(folder, **changes):
    given = {
        "made_by": "SoftGround 1",
        "options": OPTIONS,
        "read": receipts.checksums([folder / "shot.blend", folder / "rig.blend"]),
        "wrote": receipts.checksums([folder / "baked.blend", folder / "report.json"]),
        "totals": {"steps": 4},
    }
    (folder / "receipt.json").write_text(receipts.dump(**(given | changes)))


def done(folder, made_by="SoftGround 1", options=OPTIONS, source="shot.blend", outputs=("baked.blend", "report.json")):
    return receipts.totals_if_done(
        folder / "receipt.json",
        made_by=made_by,
        options=options,
        source=folder / source,
        outputs=[folder / name for name in outputs],
    )


def test_a_shot_is_done_when_its_receipt_holds(baked):
    assert done(baked) == {"steps": 4}


@pytest.mark.parametrize("name", ["shot.blend", "rig.blend", "baked.blend", "report.json"])
def test_a_file_that_has_changed_or_is_gone_undoes_it(baked, name):
    (baked / name).write_text("changed")
    assert done(baked) is None
    (baked / name).unlink()
    assert done(baked) is None


@pytest.mark.parametrize("year", [1971, 2037])
def test_a_clock_that_was_set_changes_nothing(baked, year):
    for path in baked.iterdir():
        os.utime(path, (moment := (year - 1970) * 365 * 86400, moment))
    assert done(baked) == {"steps": 4}


def test_nothing_that_batches_reads_a_clock_that_can_be_set():
    folders = ("softground_addon/core", "softground_addon/batch", "softground_addon/blender/command_line", "farm")
    read = re.compile(r"time\.time|time_ns|datetime|localtime|gmtime|st_[mac]time|getmtime")
    sources = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    assert [str(path) for path in sources if read.search(path.read_text(encoding="utf-8"))] == []


@pytest.mark.parametrize(
    "change",
    [
        {"made_by": "SoftGround 2"},
        {"options": ["--preset=mud"]},
        {"source": "other.blend"},
        {"outputs": ("baked.blend",)},
        {"outputs": ("baked.blend", "report.json", "more.json")},
    ],
)
def test_another_bake_is_not_done(baked, change):
    assert done(baked, **change) is None


def test_a_shot_baked_in_place_is_done_as_what_it_became(baked):
    shot = baked / "shot.blend"
    before = receipts.checksums([shot])
    shot.write_text("baked")
    write(baked, read=before, wrote=receipts.checksums([shot]))
    assert done(baked, outputs=["shot.blend"]) == {"steps": 4}
    shot.write_text("edited again")
    assert done(baked, outputs=["shot.blend"]) is None


def test_a_damaged_receipt_is_none(baked):
    path = baked / "receipt.json"
    whole = path.read_bytes()
    for size in range(0, len(whole) - 2, 7):
        path.write_bytes(whole[:size])
        assert done(baked) is None
    content = json.loads(whole)
    for key in content:
        for value in (None, 3, [], [3], "x"):
            path.write_text(json.dumps(content | {key: value}))
            assert done(baked) is None or (key, value) == ("totals", [])
    path.unlink()
    assert done(baked) is None


@pytest.mark.timeout(20)
@pytest.mark.parametrize("kind", ["device", "pipe", "folder"])
@pytest.mark.parametrize("where", ["read", "wrote"])
def test_a_receipt_that_names_what_never_ends_is_none(baked, kind, where):
    endless = {"device": Path("/dev/zero"), "pipe": baked / "pipe", "folder": baked}[kind]
    os.mkfifo(baked / "pipe")
    path = baked / "receipt.json"
    content = json.loads(path.read_text())
    content[where][str(endless)] = "0" * 64
    path.write_text(json.dumps(content))
    assert done(baked, outputs=("baked.blend", "report.json", *([str(endless)] if where == "wrote" else []))) is None


@pytest.mark.timeout(20)
def test_a_pipe_in_place_of_a_receipt_is_none(baked):
    (baked / "receipt.json").unlink()
    os.mkfifo(baked / "receipt.json")
    assert done(baked) is None


def test_a_receipt_that_is_absurdly_large_is_not_read(baked):
    with (baked / "receipt.json").open("r+b") as receipt:
        receipt.truncate(2**40)
    assert done(baked) is None
