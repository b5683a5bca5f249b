"""Files that are either the old one or the new one, whole."""

from __future__ import annotations

import errno
import hashlib
import os
import platform
import re
import secrets
import shutil
import stat
import time
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import InputError

_MACHINE = hashlib.sha256(platform.node().encode(errors="replace")).hexdigest()[:8]
"""Part of the names of partial files: another machine cannot see if they are still being written."""

LARGEST = 2**40
"""Largest size of a file that is read [bytes]; larger ones are not on a disk, such as the kernel's memory."""

_BLOCK = 2**20
"""Size of a part that is read at a time [bytes]."""


def identity(path: Path) -> str:
    """The same for all names of one file, or of the one that will be written there: through links, in any case."""
    return unicodedata.normalize("NFC", os.path.realpath(path)).casefold()


def regular_blocks(path: Path, largest: int = LARGEST) -> Iterator[bytes]:
    """The content of a regular file, as long as it is now, block by block.

    Raises
    ------
    OSError
        If it cannot be read, is a pipe or a device, which may never end, or is larger than `largest` bytes.
    """
    about = path.stat()
    if not stat.S_ISREG(about.st_mode):
        raise OSError(errno.EINVAL, "it is not a regular file", str(path))
    if about.st_size > largest:
        raise OSError(errno.EFBIG, f"it is larger than {largest} bytes", str(path))
    remaining = about.st_size
    with path.open("rb") as content:
        while remaining > 0 and (block := content.read(min(remaining, _BLOCK))):
            remaining -= len(block)
            yield block


def read_regular(path: Path, largest: int) -> bytes:
    """The whole of `regular_blocks`."""
    return b"".join(regular_blocks(path, largest))


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
        _rename(partial, path)
        _sync_folder(path.parent)  # without which a power cut may take the new name back
    except OSError as error:
        raise _not_written(path, error) from error
    finally:
        for leftover in (partial, partial.with_name(f"{partial.name}@")):  # which Blender saves to before it renames
            with suppress(OSError):
                leftover.unlink(missing_ok=True)


def check_place(path: Path) -> None:
    """Try, before there is anything to write, if `replacing` could write a file.

    Raises
    ------
    InputError
        If the folder is missing or cannot be written, the file is protected, or something else has that name.
    """
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise _refused(path, "is not Unicode text: choose another name, or rename the folder.") from None
    if not path.parent.is_dir():
        raise _refused(path, "is in a folder that does not exist: create it first.")
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
        needed = f"may take up to {size / 1e6:,.0f} MB, and {free / 1e6:,.0f} MB are free"
        raise _refused(path, f"{needed}: choose another folder, or free disk space.")


def check_not_full(path: Path) -> None:
    """Raise OSError if a file cannot be made or added to: a writer may not say so, or not say why."""
    with path.open("ab") as written:
        size = written.tell()
        written.write(bytes(_LARGEST_BLOCK))
        written.flush()
        os.fsync(written.fileno())
        written.truncate(size)


_LARGEST_BLOCK = 2**20
"""Largest block of a disk [bytes]: fewer bytes may fit into the last block of a file."""


def remove_leftovers(path: Path) -> None:
    """Remove leftovers of killed writers of `path` on this machine; nobody here may be writing it now."""
    name = re.compile(rf"\.{re.escape(path.stem)}\.{_MACHINE}-[0-9a-f]{{16}}\.partial{re.escape(path.suffix)}@?")
    for leftover in path.parent.iterdir():
        if name.fullmatch(leftover.name):
            leftover.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all (see `replacing`)."""
    with replacing(path) as partial:
        partial.write_bytes(text.encode())  # the same bytes on every system


def _partial(path: Path) -> Path:
    """The name under which a file is written until it is whole."""
    if path.exists() and not path.is_file():
        raise _refused(path, "is a folder or a device, not a file: choose another name.")
    if path.exists() and not os.access(path, os.W_OK):
        raise _refused(path, "is write-protected: choose another name, or make it writable.")
    # Containers share process ids, and some writers go by the suffix.
    return path.with_name(f".{path.stem}.{_MACHINE}-{secrets.token_hex(8)}.partial{path.suffix}")


_IN_USE = (5, 32)
"""Errors of Windows for a file that another program has open, as scanners and sync clients do with new ones."""

_PAUSES = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Pauses before a file in use is tried again [s]."""


def _rename(partial: Path, path: Path) -> None:
    """Give a file its name; where Windows says that it is in use, wait for scanners and the like."""
    for pause in _PAUSES:
        try:
            partial.replace(path)
        except PermissionError as error:
            if getattr(error, "winerror", None) not in _IN_USE:
                raise
            time.sleep(pause)
        else:
            return
    partial.replace(path)


def _sync_folder(folder: Path) -> None:
    """Bring the names of a folder's files to the disk; some systems and network disks cannot be asked to."""
    if os.name != "posix":
        return
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _not_written(path: Path, error: OSError) -> InputError:
    why = error.strerror or error
    return _refused(path, f"could not be written ({why}): choose another folder, or free disk space.")


def _refused(path: Path, why: str) -> InputError:
    name = str(path).encode(errors="backslashreplace").decode()
    return InputError(f"'{name}' {why}", "not_writable", path=path)
