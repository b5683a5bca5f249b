"""Records come back as they went in, and with what the artist changed of the steps."""

import io
import json
import tracemalloc
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from softground_addon.core.errors import InputError
from softground_addon.core.ground.material import GroundMaterial
from softground_addon.core.record import record
from softground_addon.core.record.edits import (
    StepEdit,
    edits_by_number,
    from_json,
    new_copy,
    step_id,
    to_json,
    without_step,
)
from softground_addon.core.record.footprints import Changes, recompose
from softground_addon.core.record.record import BakeRecord
from softground_addon.core.record.throws import Throw
from softground_addon.core.record.throws import to_json as to_json_of_throw
from tests.core.walkers import pressed, walk


@pytest.fixture(scope="module")
def footprints():
    return pressed(walk(steps=4), GroundMaterial(0.3e6, 0.35, 0.15))[1]


def with_text(content, **changes):
    """The record with other values in its text."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(buffer, "w") as target:
        for name in source.namelist():
            member = source.read(name)
            if name == "record.json":
                member = json.dumps(json.loads(member) | changes)
            target.writestr(name, member)
    return buffer.getvalue()


def test_what_an_earlier_version_has_stored_is_lifted_to_the_newest(monkeypatch):
    assert sorted(record.MIGRATIONS) == list(range(1, record.FORMAT))
    stored = record.dump(BakeRecord([], {"cell_size": 1.0}))
    lift = {record.FORMAT: lambda text, arrays: (text | {"about": {"cell_size_m": text["about"]["cell_size"]}}, arrays)}
    monkeypatch.setattr(record, "MIGRATIONS", record.MIGRATIONS | lift)
    monkeypatch.setattr(record, "FORMAT", record.FORMAT + 1)
    assert record.load(stored).about == record.load_edits(stored)[0] == {"cell_size_m": 1.0}


@pytest.mark.parametrize("version", [0, record.FORMAT + 1, "2", None])
def test_a_record_of_an_unknown_version_is_refused_with_what_to_do(version):
    stored = with_text(record.dump(BakeRecord([], {})), format=version)
    with pytest.raises(InputError, match=f"version {version}.*update SoftGround"):
        record.load(stored)
    with pytest.raises(InputError, match=f"version {version}.*update SoftGround"):
        record.load_edits(stored)


def test_edits_come_back_beside_the_footprints(footprints):
    edits = {
        step_id(footprints[0]): StepEdit(mute=True),
        step_id(footprints[1]): StepEdit(strength=0.5, move_m=(0.1, -0.2), turn_deg=12.5),
    }
    loaded = record.load(record.dump(BakeRecord(footprints, {"cell_size": 0.01}, edits)))
    assert loaded.edits == edits
    assert record.load_edits(record.dump(loaded)) == ({"cell_size": 0.01}, edits)
    assert len(loaded.footprints) == len(footprints)
    assert record.dump(loaded) == record.dump(BakeRecord(footprints, {"cell_size": 0.01}, edits))


@pytest.mark.parametrize("edits", [None, [], {"schema_version": 1}, {"schema_version": 1, "steps": {"A/b@1": 3}}])
def test_a_record_with_forged_edits_is_refused(edits):
    with pytest.raises(InputError, match="edits of steps"):
        record.load(with_text(record.dump(BakeRecord([], {})), edits=edits))
    with pytest.raises(InputError, match="edits of steps"):
        record.load_edits(with_text(record.dump(BakeRecord([], {})), edits=edits))


def test_the_ground_is_made_without_a_muted_step(footprints):
    edited = BakeRecord(footprints, {}, {step_id(footprints[1]): StepEdit(mute=True)})
    assert list(map(step_id, edited.edited)) == list(map(step_id, [footprints[0], *footprints[2:]]))
    before, after, muted = (recompose(prints).volumes() for prints in (footprints, edited.edited, footprints[1:2]))
    np.testing.assert_allclose(after, np.subtract(before, muted), rtol=1e-9)


def test_each_step_has_an_id_of_its_own(footprints):
    assert len({step_id(footprint) for footprint in footprints}) == len(footprints) > 3


def edit_of(footprint, edits):
    return edits_by_number([footprint], edits).get(0, StepEdit())


def moved(footprint, by, longer=0.0):
    return replace(footprint, start_frame=footprint.start_frame + by, end_frame=footprint.end_frame + by + longer)


def test_an_edit_stays_with_its_step_through_a_bake_with_small_changes(footprints):
    edits = {step_id(footprint): StepEdit(strength=0.1 * n) for n, footprint in enumerate(footprints)}
    for n, footprint in enumerate(footprints):
        half = (footprint.end_frame - footprint.start_frame) / 2
        assert half >= 5.0
        for changed in (moved(footprint, 4.0), moved(footprint, -4.0), moved(footprint, 0.0, longer=half)):
            assert edit_of(changed, edits) == StepEdit(strength=0.1 * n)
    # without the first step all others keep theirs, where numbers in a row would not
    assert [edit_of(footprint, edits).strength for footprint in footprints[1:]] == pytest.approx([0.1, 0.2, 0.3])


def test_an_edit_belongs_to_no_other_character_sole_or_time(footprints):
    (footprint,) = footprints[:1]
    edits = {step_id(footprint): StepEdit(mute=True)}
    assert edit_of(replace(footprint, character="other"), edits) == StepEdit()
    assert edit_of(replace(footprint, sole="other"), edits) == StepEdit()
    assert edit_of(moved(footprint, footprint.end_frame - footprint.start_frame + 1.0), edits) == StepEdit()


def test_copies_have_ids_and_numbers_of_their_own(footprints):
    count = len(footprints)
    edits = {step_id(footprints[1], copy): StepEdit(scale=1.0 + copy) for copy in (1, 3)}
    assert edits_by_number(footprints, edits) == {
        1 + count: StepEdit(scale=2.0),
        1 + 3 * count: StepEdit(scale=4.0),
    }
    assert new_copy(edits, footprints[1]) == step_id(footprints[1], 2)
    assert new_copy(edits, footprints[0]) == step_id(footprints[0], 1)
    assert edits_by_number(footprints, {step_id(footprints[1], 2): StepEdit()}) == {1 + 2 * count: StepEdit()}
    assert edits_by_number([moved(footprint, 3.0) for footprint in footprints], edits).keys() == {
        1 + count,
        1 + 3 * count,
    }
    assert without_step(footprints[:1], edits) == list(edits)


def test_names_with_the_ids_own_marks_make_no_confusion(footprints):
    odd = replace(footprints[0], character="A/b@3", sole="c@1/d")
    edits = from_json(to_json({step_id(odd): StepEdit(mute=True)}), "Edits")
    assert edit_of(odd, edits).mute
    assert not edit_of(replace(footprints[0], character="A", sole="b"), edits).mute


@pytest.mark.parametrize(
    ("step", "said"),
    [
        ({"muted": True}, "unknown field 'muted'. Known are: mute, strength, move_m, turn_deg"),
        ({"mute": 1}, "'mute' is 1"),
        ({"strength": -0.1}, "'strength' is -0.1"),
        ({"strength": float("nan")}, "'strength' is nan"),
        ({"strength": True}, "'strength' is True"),
        ({"move_m": [1.0]}, "'move_m' is"),
        ({"move_m": [1.0, 1e9]}, "'move_m' is"),
        ({"turn_deg": "90"}, "'turn_deg' is '90'"),
        ([], "must be a table"),
    ],
)
def test_an_edit_that_cannot_be_meant_is_named(step, said):
    with pytest.raises(InputError) as refused:
        from_json({"schema_version": 1, "steps": {"Walker/foot.L@7.0": step}}, "edits.json")
    assert "edits.json, step 'Walker/foot.L@7.0'" in str(refused.value)
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ([], "must be a table"),
        ({"steps": {}}, "version None"),
        ({"schema_version": 2, "steps": {}}, "version 2"),
        ({"schema_version": 1, "steps": {}, "more": 1}, "unknown field 'more'"),
        ({"schema_version": 1, "steps": {"Walker": {}}}, "not the id of a step"),
        ({"schema_version": 1, "steps": {"Walker/foot.L@nan": {}}}, "not the id of a step"),
    ],
)
def test_edits_that_are_none_are_refused(content, said):
    with pytest.raises(InputError, match=said):
        from_json(content, "edits.json")


def thrown(samples, **values):
    about = {"first": 1.0, "spacing": 1.0, "speed": 0.0, "landed_by": 1.0}
    return Throw(0, "toe_off", 2, True, **about | values, samples=samples)


def test_what_lasts_long_or_happens_late_throws_as_it_did(footprints):
    """A crate that is dragged for minutes, in the last frames that Blender has."""
    samples = np.random.default_rng(1).random((30_000, 4 + 6 * 2)).astype(np.float32)
    stored = record.dump(BakeRecord(footprints, {}, throws=[thrown(samples, first=1_048_000.0)]))
    (throw,) = record.load(stored).throws
    assert throw.first == 1_048_000.0
    assert (throw.samples == samples).all()


def test_throws_that_unpack_to_far_more_than_a_record_has_take_no_memory(footprints):
    throws = [to_json_of_throw(thrown(np.zeros((10_000, 604), np.float32)))] * 500
    forged = with_text(record.dump(BakeRecord(footprints, {})), throws=throws)
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="clear the bake"):
            record.load(zipped(forged))
        assert tracemalloc.get_traced_memory()[1] < 2e8
    finally:
        tracemalloc.stop()


def zipped(content):
    """The record in as little space as it takes."""
    buffer = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(content)) as source,
        zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as target,
    ):
        for name in source.namelist():
            target.writestr(name, source.read(name))
    return buffer.getvalue()


def test_half_a_character_anywhere_is_damage(footprints):
    stored = record.dump(BakeRecord(footprints, {}))
    with pytest.raises(InputError, match="clear the bake"):
        record.load(with_text(stored, about={"inputs": {"file": "\ud800"}}))
    assert record.load(with_text(stored, about={"file": "\U0001f43e \\ud800"})).about["file"] == "\U0001f43e \\ud800"


@pytest.mark.parametrize("count", [-1, 3, 1.5, "1", None])
def test_a_record_with_more_steps_on_floors_than_footprints_is_damaged(footprints, count):
    stored = record.dump(BakeRecord(footprints[1:2], {}, on_floors=footprints[:1]))
    assert [step.start_frame for step in record.load(stored).on_floors] == [footprints[0].start_frame]
    with pytest.raises(InputError, match="clear the bake"):
        record.load(with_text(stored, on_floors=count))


def test_a_place_that_a_body_cuts_again_much_later_is_read(footprints):
    print = footprints[0]
    few = Changes(
        print.start_frame + np.array([0.0, 2000.0]), np.array([0, 1, 2], np.int32), *2 * [np.ones(2, np.int32)]
    )
    carve = replace(print, compression=few, rim=few, load_frames=np.empty(0), load_n=np.empty(0), pressed_by=None)
    stored = record.dump(BakeRecord(list(footprints), {}, carves={0: carve}))
    assert record.load(stored).carves[0].compression.frames.tolist() == few.frames.tolist()
