"""Files of events, read by what others wrote: mido, OpenTimelineIO's own library and Python's csv."""

import csv
import io
import json
import re

import numpy as np
import pytest

from softground_addon.core.events import event_files, event_midi
from softground_addon.core.events.events import COLUMNS
from softground_addon.core.ground.surfaces import SURFACES

RATE = 24.0


def event(time, phase, contact="foot.L", force=1.1, length=0.6, slide=0.1, surface="snow"):
    row = dict.fromkeys(COLUMNS, 0.0) | {"time_s": time, "frame": round(1 + time * RATE, 6), "phase": phase}
    row |= {"character": "Ina", "contact": contact, "side": contact[-1], "surface": surface, "step": "Ina/foot.L@9.0"}
    return row | {"peak_bw": force, "duration_s": length, "slide_speed": slide, "depth_m": 0.05}


EVENTS = [
    event(0.25, "heel_strike"),
    event(0.4, "foot_flat"),
    event(0.75, "heel_strike", "foot.R", force=2.4, surface="mud"),
    event(0.85, "toe_off", length=0.0),
    event(3661.5, "land", "hand.X", force=9.0, slide=5.0),
]
LANDINGS = [row for row in EVENTS if row["phase"] in ("heel_strike", "land")]


def test_json_lines_hold_every_column_and_say_in_what_it_is():
    head, *rows = map(json.loads, event_files.json_lines(EVENTS, frame_rate=RATE).splitlines())
    assert rows == EVENTS
    assert set(head["columns"]) == set(EVENTS[0])


def test_midi_notes_are_read_with_their_times_and_velocities():
    mido = pytest.importorskip("mido")
    file = mido.MidiFile(file=io.BytesIO(event_midi.dump(EVENTS)))
    assert (file.type, file.ticks_per_beat) == (0, 480)
    now, notes, sounding, texts = 0.0, [], {}, []
    for message in file:
        now += message.time
        if message.type == "note_on":
            sounding[message.note] = len(notes)
            notes.append([now, message.note, message.velocity, None])
        elif message.type == "note_off":
            notes[sounding.pop(message.note)][3] = now
        elif message.type == "marker":
            texts.append(message.text)
    assert_notes(notes)
    assert texts == ["Ina foot.L foot flat", "Ina foot.L toe off"]


def assert_notes(notes):
    assert [note[0] for note in notes] == pytest.approx([row["time_s"] for row in LANDINGS], abs=1 / 960)
    assert [note[3] - note[0] for note in notes] == pytest.approx([0.6] * 3, abs=2 / 960)
    assert [note[1] for note in notes] == [36, 49, 38]
    assert [note[2] for note in notes] == [round(127 * (f / 3) ** 0.7) for f in (1.1, 2.4, 3.0)]


def test_a_hard_floor_has_notes_of_its_own():
    notes = {event_midi.note(event(0.0, "land", f"foot.{side}", surface="hard")) for side in "LRX"}
    assert notes == {56, 57, 58}
    assert not notes & {note for of in SURFACES.values() for note in range(of.midi_note, of.midi_note + 3)}


def test_midi_is_as_its_standard_says():
    """A reader of our own, by RP-001: it fails at the first byte that the standard does not allow here."""
    content = event_midi.dump(EVENTS)
    assert content[:14] == b"MThd\x00\x00\x00\x06\x00\x00\x00\x01" + (480).to_bytes(2, "big")
    assert content[14:18] == b"MTrk"
    assert int.from_bytes(content[18:22], "big") == len(content) - 22
    at, tick, notes = 22, 0, []

    def number():
        nonlocal at
        value = 0
        while True:
            byte = content[at]
            at += 1
            value = value << 7 | byte & 0x7F
            if byte < 0x80:
                return value

    ended = False
    while at < len(content):
        assert not ended
        tick += number()
        status = content[at]
        at += 1
        if status == 0xFF:
            kind = content[at]
            at += 1
            length = number()
            ended = kind == 0x2F
            if kind == 0x51:
                assert content[at : at + length] == (500_000).to_bytes(3, "big")
            at += length
        else:
            assert status >> 4 in (0x8, 0x9, 0xB)
            first, second = content[at : at + 2]
            assert max(first, second) < 128
            at += 2
            if status >> 4 == 0x9:
                notes.append([tick / 960, first, second, None])
            elif status >> 4 == 0x8:
                next(note for note in reversed(notes) if note[1] == first)[3] = tick / 960
    assert ended
    assert_notes(notes)


def test_reaper_reads_regions_and_markers():
    text = event_files.reaper(EVENTS)
    assert not text.startswith("\ufeff")
    rows = list(csv.DictReader(io.StringIO(text)))
    assert list(rows[0]) == ["#", "Name", "Start", "End", "Length"]
    assert [row["#"] for row in rows] == ["R1", "M1", "R2", "M2", "R3"]
    assert list(rows[0].values()) == ["R1", "Ina foot.L heel strike", "0:00.250", "0:00.850", "0:00.600"]
    assert rows[4]["Start"] == "61:01.500"
    assert rows[1]["End"] == ""


def test_resolve_reads_one_marker_at_each_frame():
    lines = event_files.edl(EVENTS, frame_rate=RATE).splitlines()
    assert lines[:2] == ["TITLE: SoftGround", "FCM: NON-DROP FRAME"]
    cut = re.compile(r"(\d{3})  001      V     C        (\S{11}) (\S{11}) (\S{11}) (\S{11})  ")
    cuts = [match for line in lines if (match := cut.fullmatch(line))]
    marks = [line for line in lines if line.startswith(" |")]
    assert len(cuts) == len(marks) == len(EVENTS)
    for row, match in zip(EVENTS, cuts, strict=True):
        hours, minutes, seconds, frames = map(int, match[2].split(":"))
        frame = ((hours * 60 + minutes) * 60 + seconds) * 24 + frames - 3600 * 24
        assert frame == np.rint(row["time_s"] * 24)
    assert marks[0] == " |C:ResolveColorBlue |M:Ina foot.L heel strike |D:1"


def test_opentimelineio_reads_markers_with_all_that_is_known():
    otio = pytest.importorskip("opentimelineio")
    timeline = otio.adapters.read_from_string(event_files.otio(EVENTS, frame_rate=RATE), "otio_json")
    markers = timeline.tracks[0].markers
    assert [marker.name for marker in markers][:2] == ["Ina foot.L heel strike", "Ina foot.L foot flat"]
    for row, marker in zip(EVENTS, markers, strict=True):
        assert marker.marked_range.start_time.to_seconds() == pytest.approx(row["time_s"], abs=1e-4)
        assert dict(marker.metadata["softground"]) == row
    assert timeline.tracks[0].range_of_child_at_index(0).duration.to_seconds() == pytest.approx(3662.1)


def test_opentimelineio_is_in_schemas_of_its_first_versions():
    timeline = json.loads(event_files.otio(EVENTS, frame_rate=RATE))
    assert timeline["OTIO_SCHEMA"] == "Timeline.1"
    (track,) = timeline["tracks"]["children"]
    assert (track["OTIO_SCHEMA"], track["kind"]) == ("Track.1", "Audio")
    assert {marker["OTIO_SCHEMA"] for marker in track["markers"]} == {"Marker.2"}
    starts = [marker["marked_range"]["start_time"] for marker in track["markers"]]
    assert [start["value"] / start["rate"] for start in starts] == pytest.approx([row["time_s"] for row in EVENTS])


def test_no_events_are_files_too():
    assert event_midi.dump([]).endswith(b"\xff\x2f\x00")
    assert event_files.reaper([]) == "#,Name,Start,End,Length\n"
    for dump in (event_files.json_lines, event_files.edl, event_files.otio):
        assert dump([], frame_rate=RATE)
