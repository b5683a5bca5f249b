"""Receipts of the files that a bake has read and written, with checksums, by which a later batch skips a finished shot.

The receipt of a bake holds the checksums of its results and takes its name after them. So wherever a bake is killed,
either there is a receipt that fits the files on disk and the shot is done, or there is none and it is baked again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..core.files.files import read_regular, regular_blocks

SCHEMA_VERSION = 1


LARGEST = 2**24
"""Size of a receipt that is read [bytes]: of a shot that links fifty thousand files."""


def checksum(path: Path) -> str:
    """SHA-256 of a regular file's content; OSError for any other."""
    digest = hashlib.sha256()
    for block in regular_blocks(path):
        digest.update(block)
    return digest.hexdigest()


def checksums(paths: Iterable[Path]) -> dict[str, str]:
    """SHA-256 of each of these files that can be read; "" for the others."""
    sums = {}
    for path in paths:
        try:
            sums[str(path)] = checksum(path)
        except OSError:
            sums[str(path)] = ""
    return sums


def dump(
    *,
    made_by: str,
    options: Sequence[str],
    read: Mapping[str, str],
    wrote: Mapping[str, str],
    totals: Mapping[str, object],
) -> str:
    """The receipt of a bake as JSON.

    Parameters
    ----------
    made_by : str
        Versions of the programs that baked.
    options : sequence of str
        The bake as options of the command line.
    read, wrote : mapping of path to SHA-256
        The shot and the files that it links; the results.
    totals : mapping
        The bake in a few numbers.
    """
    receipt = {
        "schema_version": SCHEMA_VERSION,
        "made_by": made_by,
        "options": list(options),
        "read": dict(read),
        "wrote": dict(wrote),
        "totals": dict(totals),
    }
    return json.dumps(receipt, indent=2) + "\n"


def totals_if_done(
    path: Path, *, made_by: str, options: Sequence[str], source: Path, outputs: Iterable[Path]
) -> dict[str, Any] | None:
    """The totals of a bake whose results on disk are those of this very bake, by its receipt.

    None if there is no receipt or it cannot be read, if the programs or the options are others, if the shot or a file
    that it links has changed, or if a result is missing or has changed.
    """
    try:
        receipt = json.loads(read_regular(path, LARGEST))
        if (receipt["schema_version"], receipt["made_by"]) != (SCHEMA_VERSION, made_by):
            return None
        read, wrote = dict(receipt["read"]), dict(receipt["wrote"])
        if receipt["options"] != list(options) or str(source) not in read or set(wrote) != {str(p) for p in outputs}:
            return None
        sources = {name: digest for name, digest in read.items() if name not in wrote}  # a shot baked in place changed
        expected = sources | wrote
        return dict(receipt["totals"]) if checksums(map(Path, expected)) == expected else None
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return None
