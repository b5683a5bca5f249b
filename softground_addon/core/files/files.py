"""Files that are either the old one or the new one, whole."""

from __future__ import annotations

import glob
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import InputError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Another name in the same folder to write to; it takes the place and mode of `path` when all went well.

    Raises
    ------
    InputError
        If the folder is missing or cannot be written, the file is protected, or the disk is full. `path` is then as it
        was.
    """
    partial = _partial(path)
    try:
        yield partial
        with partial.open("r+b") as written:  # Windows syncs only what may be written
            os.fsync(written.fileno())
        if path.exists():
            shutil.copymode(path, partial)
        partial.replace(path)
    except OSError as error:
        raise _not_written(path, error) from error
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)


def check_place(path: Path) -> None:
    """Find out by trying, before there is anything to write, whether `replacing` could write a file.

    Raises
    ------
    InputError
        If the folder is missing or cannot be written, the file is protected, or something else has that name.
    """
    if not path.parent.is_dir():
        raise InputError(f"The folder of '{path}' does not exist: create it first.")
    partial = _partial(path)
    try:
        partial.touch()
        partial.unlink()
    except OSError as error:
        raise _not_written(path, error) from error


def check_room(path: Path, size: int) -> None:
    """Raise InputError unless a file of that size [bytes] has room on its disk: for writers that a full one ends."""
    free = shutil.disk_usage(path.parent).free
    if size > free:
        raise InputError(
            f"'{path}' may take up to {size / 1e6:,.0f} MB, and {free / 1e6:,.0f} MB are free: choose another place, "
            "or free disk space."
        )


def check_not_full(path: Path) -> None:
    """Raise OSError where nothing can be added to a file: a writer that does not tell may then have lost its end."""
    size = path.stat().st_size
    with path.open("r+b") as written:
        written.seek(size)
        written.write(bytes(_LARGEST_BLOCK))
        written.flush()
        os.fsync(written.fileno())
        written.truncate(size)


_LARGEST_BLOCK = 2**20
"""Of a disk [bytes]: what is added to a file may fit into its last block otherwise."""


def remove_leftovers(path: Path) -> None:
    """Remove what killed writers of `path` have left beside it; nobody may be writing it now."""
    for left in path.parent.glob(f".{glob.escape(path.stem)}.*.partial{glob.escape(path.suffix)}"):
        left.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all (see `replacing`)."""
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def _partial(path: Path) -> Path:
    """The name under which a file is written until it is whole."""
    if path.exists() and not path.is_file():
        raise InputError(f"'{path}' is a folder or a device, not a file: choose another name.")
    if path.exists() and not os.access(path, os.W_OK):
        raise InputError(f"'{path}' is write-protected: choose another name, or let it be written.")
    return path.with_name(f".{path.stem}.{os.getpid()}.partial{path.suffix}")  # some writers go by the suffix


def _not_written(path: Path, error: OSError) -> InputError:
    why = error.strerror or error
    return InputError(f"'{path}' could not be written ({why}): choose another place, or free disk space.")
