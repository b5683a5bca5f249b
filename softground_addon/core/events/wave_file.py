"""Sound as a WAV file of 48 kHz and 24 bits, and files of others read."""

from __future__ import annotations

import io
import wave
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..numerics.arrays import Array

RATE = 48_000
"""Samples per second [Hz]."""
FULL = 2**23 - 1
"""Largest sample of 24 bits."""
LONGEST_SAMPLE = 10.0
"""Longest recording of a step [s]: the rest is cut."""


def dump(sound: Array) -> bytes:
    """The bytes of a file.

    Parameters
    ----------
    sound : (N, C) float array
        Between -1 and 1; louder ones are cut.
    """
    whole = np.rint(np.clip(sound, -1.0, 1.0) * FULL).astype("<i4")
    packed = whole.reshape(-1, 1).view(np.uint8)[:, :3]
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setnchannels(sound.shape[1])
        file.setsampwidth(3)
        file.setframerate(RATE)
        file.writeframes(packed.tobytes())
    return buffer.getvalue()


def read(path: Path) -> Array:
    """A recording as one channel at `RATE`, (N,), its largest sample 1.

    Raises
    ------
    InputError
        If it is no uncompressed WAV file of 8 to 32 bits.
    """
    try:
        with wave.open(str(path), "rb") as file:
            width, channels, rate = file.getsampwidth(), file.getnchannels(), file.getframerate()
            if not rate:
                raise wave.Error("it has no sampling rate")
            content = file.readframes(round(LONGEST_SAMPLE * rate))
    except (wave.Error, EOFError, OSError) as error:
        raise InputError(
            f"'{path}' cannot be read ({error}): save it as an uncompressed WAV file.", "unreadable_file", path=path
        ) from None
    bits = np.frombuffer(content[: len(content) // (width * channels) * width * channels], np.uint8).reshape(-1, width)
    whole = np.zeros((len(bits), 4), np.uint8)
    whole[:, 4 - width :] = bits if width > 1 else bits ^ 0x80  # of 8 bits, silence is 128
    samples = whole.view("<i4").reshape(-1, channels).mean(axis=1)
    samples = np.interp(np.arange(0, len(samples), rate / RATE), np.arange(len(samples)), samples)
    return np.asarray(samples / max(float(np.abs(samples).max(initial=0.0)), 1.0))
