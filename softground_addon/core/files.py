"""Files that are either the old one or the new one, whole."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Another name in the same folder to write to; it takes the place of `path` when the block ends well.

    Raises
    ------
    InputError
        If the folder is missing or cannot be written, or the disk is full. `path` is then as it was.
    """
    partial = path.with_name(f".{path.stem}.{os.getpid()}.partial{path.suffix}")  # some writers go by the suffix
    try:
        yield partial
        with partial.open("rb") as written:
            os.fsync(written.fileno())
        partial.replace(path)
    except OSError as error:
        raise InputError(
            f"'{path}' could not be written ({error.strerror or error}): choose another place, or free disk space."
        ) from error
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all (see `replacing`)."""
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")
