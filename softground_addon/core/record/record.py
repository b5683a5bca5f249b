"""The record of a bake as bytes: a zip of plain arrays and one JSON text, with a checksum each. No pickles."""

from __future__ import annotations

import io
import json
import tokenize
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from .footprint_arrays import from_arrays, to_parts
from .footprints import Footprint

FORMAT = 1
"""Version of the bytes' layout."""

_TEXT = "record.json"
_DAMAGE = (
    *(zipfile.BadZipFile, zlib.error, EOFError, OSError, RuntimeError),  # of the archive: also "encrypted"
    *(KeyError, ValueError, TypeError),  # of the text; too deep a nesting is a RuntimeError
    *(SyntaxError, tokenize.TokenError, MemoryError),  # of an array's header: what numpy cannot read, and absurd sizes
)
"""What reading a damaged record may raise."""

TAIL = 2048
"""Records that differ do so in their last bytes: the archive's directory is there, with a checksum of everything."""

_FIXED_DATE = (1980, 1, 1, 0, 0, 0)  # equal bakes give equal bytes


def dump(footprints: Sequence[Footprint], about: Mapping[str, object]) -> bytes:
    """The footprints and what is known about them (numbers and texts, for JSON) as bytes."""
    names, arrays = to_parts(footprints)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        text = json.dumps({"format": FORMAT, "footprints": names, "about": dict(about)}, ensure_ascii=False)
        archive.writestr(zipfile.ZipInfo(_TEXT, _FIXED_DATE), text, zipfile.ZIP_DEFLATED)
        for key, array in arrays.items():
            kind: np.dtype[Any] = np.dtype(array.kind)
            entry = zipfile.ZipInfo(f"{key}.npy", _FIXED_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.file_size = array.size * kind.itemsize  # about: it decides how sizes are stored
            with archive.open(entry, "w") as member:
                header = {"descr": kind.str, "fortran_order": False, "shape": (array.size,)}
                np.lib.format.write_array_header_1_0(member, header)
                for part in array.parts:
                    member.write(part.astype(kind, copy=False).tobytes())
    return buffer.getvalue()


def load(record: bytes) -> tuple[list[Footprint], dict[str, object]]:
    """The footprints and what is known about them, from `dump`.

    Raises
    ------
    InputError
        If the bytes are cut short, damaged, or of another version.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(record)) as archive:
            content = json.loads(archive.read(_TEXT))
            if content["format"] != FORMAT:
                raise InputError(
                    f"The stored record of the footprints is of version {content['format']}; this SoftGround reads "
                    f"version {FORMAT}: bake again, or update SoftGround."
                )
            names, about = content["footprints"], dict(content["about"])
            arrays = {
                name.removesuffix(".npy"): np.load(io.BytesIO(archive.read(name)), allow_pickle=False)
                for name in archive.namelist()
                if name.endswith(".npy")
            }
    except _DAMAGE as error:
        raise InputError(
            f"The stored record of the footprints is damaged ({error}): clear the bake and bake again."
        ) from None
    return from_arrays(names, arrays), about
