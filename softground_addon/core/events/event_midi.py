"""Events as a Standard MIDI File: steps are notes, for drum machines and samplers.

References
----------
Standard MIDI Files 1.0, RP-001, MIDI Manufacturers Association 1988.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from itertools import chain

from ..ground import surfaces
from .events import LANDINGS, Event, label

TICKS_PER_QUARTER = 480
TEMPO = 500_000
"""Tempo of 120 beats per minute [µs per quarter]: a tick is 1/960 s."""
TICKS_PER_SECOND = TICKS_PER_QUARTER * 1_000_000 // TEMPO

FULL_FORCE = 3.0
"""Peak force that gives the largest velocity [body weights]."""
LOUDNESS = 0.7
"""Exponent of the velocity over the force."""
SLIDE_CONTROLLER, DEPTH_CONTROLLER = 16, 17
"""General purpose controllers 1 and 2."""
FULL_SLIDE, FULL_DEPTH = 2.0, 0.3
"""Speed and depth of their largest value [m/s], [m]."""
PERCUSSION = 9
"""Channel that instruments keep for drums: no character gets it."""

_Message = tuple[int, int, bytes]
"""Tick, order among those of the same tick, bytes."""


def dump(events: Sequence[Event]) -> bytes:
    """The bytes of the file: format 0, a channel for each character.

    A step is a note by surface and foot, as long as its contact, its velocity 127·clip(F/(3 BW), 0, 1)^0.7;
    controllers before it carry slide and depth. The other phases are text markers.
    """
    who = list(dict.fromkeys(row["character"] for row in events))
    channels = [channel for channel in range(16) if channel != PERCUSSION]
    messages = sorted(chain.from_iterable(_messages(row, channels[who.index(row["character"]) % 15]) for row in events))
    track = bytearray(b"\x00\xff\x51\x03" + TEMPO.to_bytes(3, "big"))
    now = 0
    for tick, _, content in messages:
        track += _variable(tick - now) + content
        now = tick
    track += b"\x00\xff\x2f\x00"
    head = struct.pack(">4sIHHH", b"MThd", 6, 0, 1, TICKS_PER_QUARTER)
    return head + struct.pack(">4sI", b"MTrk", len(track)) + bytes(track)


def velocity(peak_bw: float) -> int:
    """Velocity of a note, 1 to 127: 0 would end it."""
    return max(1, round(127 * min(max(peak_bw / FULL_FORCE, 0.0), 1.0) ** LOUDNESS))


def note(event: Event) -> int:
    """Of an event's surface and foot."""
    on = event["surface"]
    of_surface = surfaces.HARD_NOTE if on == surfaces.HARD else surfaces.find(on).midi_note
    return of_surface + {"L": 0, "R": 1}.get(event["side"], 2)


def _messages(event: Event, channel: int) -> Iterable[_Message]:
    at = _tick(event["time_s"])
    if event["phase"] not in LANDINGS:
        text = label(event).encode()
        yield at, 1, b"\xff\x06" + _variable(len(text)) + text
        if event["phase"] == "slide_start":
            yield at, 1, _controller(channel, SLIDE_CONTROLLER, event["slide_speed"] / FULL_SLIDE)
        return
    yield at, 1, _controller(channel, SLIDE_CONTROLLER, event["slide_speed"] / FULL_SLIDE)
    yield at, 1, _controller(channel, DEPTH_CONTROLLER, event["depth_m"] / FULL_DEPTH)
    yield at, 2, bytes((0x90 | channel, note(event), velocity(event["peak_bw"])))
    off = max(at + 1, _tick(event["time_s"] + event["duration_s"]))
    yield off, 0, bytes((0x80 | channel, note(event), 0))


def _controller(channel: int, number: int, part: float) -> bytes:
    return bytes((0xB0 | channel, number, round(127 * min(max(part, 0.0), 1.0))))


def _tick(time: float) -> int:
    return max(0, round(time * TICKS_PER_SECOND))


def _variable(number: int) -> bytes:
    """A variable-length quantity: seven bits in each byte, the highest first."""
    parts = [number & 0x7F]
    while number := number >> 7:
        parts.append(number & 0x7F | 0x80)
    return bytes(reversed(parts))
