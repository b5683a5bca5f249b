"""A zip of plain members from a file that anybody may have made: nothing is unpacked that is not known to be small."""

from __future__ import annotations

import io
import zipfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGEST_RATIO = 100
SPARE = 2**24
"""Most that the members may take, in sizes of the archive, and on top of that [bytes]; real records take 2 to 14."""

LARGEST_TEXT = 2**24
"""Most that a text may take [bytes]: 200,000 footprints have 12 MB; read as JSON, it may take 20 times as much."""

_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def most_of(size: int) -> int:
    """Most that an archive of that size unpacks to, both in bytes."""
    return LARGEST_RATIO * size + SPARE


def check_directory(archive: zipfile.ZipFile, size: int) -> None:
    """Raise ValueError unless the directory of an archive of that size [bytes] announces parts that can be unpacked.

    Notes
    -----
    `read` takes no more of a member than is announced, so that this bounds the memory of all.
    """
    if len(archive.infolist()) != len(archive.NameToInfo):
        raise ValueError("two of its parts have one name")
    if any(member.compress_type not in _METHODS for member in archive.infolist()):
        raise ValueError("a part is compressed in another way")
    if sum(member.file_size for member in archive.infolist()) > most_of(size):
        raise ValueError("its parts are larger than they can be")


def read(archive: zipfile.ZipFile, name: str, largest: float = np.inf) -> bytes:
    """A member, whose checksum is right; ValueError where it is larger [bytes] or smaller than announced."""
    size = archive.getinfo(name).file_size
    if size > largest:
        raise ValueError(f"{name} is too large")
    with archive.open(name) as member:
        content = member.read(size) if size else b""  # without a size, all that it unpacks to is made at once
    if len(content) != size:
        raise ValueError(f"{name} is shorter than announced")
    return content


def array(member: bytes) -> NDArray[Any]:
    """The flat array that a member holds, without a copy.

    Raises
    ------
    ValueError
        If the member's header and its size do not fit each other; if numpy cannot read it, also SyntaxError,
        `tokenize.TokenError` and MemoryError.
    """
    stream = io.BytesIO(member)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError("an array of another version")
    shape, _, kind = np.lib.format.read_array_header_1_0(stream)
    values: NDArray[Any] = np.frombuffer(member, kind, offset=stream.tell())
    if shape != values.shape:
        raise ValueError(f"an array of {len(values)} values that announces {shape}")
    return values
