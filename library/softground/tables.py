"""Results as files: tables (.csv), and forces as OpenSim reads them (.mot or .sto, and .xml)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ._core.errors import InputError
from ._core.files import files, opensim
from .forces import Loads
from .prints import Prints

_AXES = "xyz"


def to_opensim(loads: Loads, path: str | os.PathLike[str]) -> list[Path]:
    """Write forces, centres of pressure and free moments at the frames; of a .mot also the external loads beside it.

    Parameters
    ----------
    loads : Loads
    path : path
        Ends in .mot or .sto.

    Returns
    -------
    list of Path
        What was written: a file that exists is replaced, whole or not at all.

    Raises
    ------
    InputError
        If the file has another ending, cannot be written, or a file with the name of its external loads is none.

    References
    ----------
    OpenSim documentation, "Storage (.sto) Files" and "External Loads"; its axes are Y up.
    """
    target = Path(path)
    if target.suffix.lower() not in (".mot", ".sto"):
        raise InputError(f"'{target}' is no OpenSim file: let its name end in .mot or .sto", "wrong_format")
    feet = [
        opensim.FootForce(sole.name, sole.side, sole.force, sole.centre_of_pressure, np.nan_to_num(sole.free_moment))
        for sole in loads.soles
    ]
    external = opensim.loads_beside(target)
    files.write_text(target, opensim.storage(loads.body.name, loads.times, feet))
    if external is None:
        return [target]
    files.write_text(external, opensim.external_loads(loads.body.name, target.name, feet))
    return [target, external]


def to_csv(result: Loads | Prints, path: str | os.PathLike[str]) -> Path:
    """Write a table: of loads a row for each frame, of prints a row for each; units are in its head.

    Parameters
    ----------
    result : Loads or Prints
    path : path

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    target = Path(path)
    head, rows = _of_loads(result) if isinstance(result, Loads) else _of_prints(result)
    text = "\n".join([",".join(head), *(",".join(row) for row in rows), ""])
    files.write_text(target, text)
    return target


def _of_loads(loads: Loads) -> tuple[list[str], list[list[str]]]:
    head, columns = ["time_s"], [loads.times]
    for sole in loads.soles:
        for what, unit, values in (("force", "n", sole.force), ("centre", "m", sole.centre_of_pressure)):
            head += [f"{sole.name}_{what}_{axis}_{unit}" for axis in _AXES]
            columns += list(values.T)
        head += [f"{sole.name}_free_moment_nm", f"{sole.name}_deviation_n"]
        columns += [sole.free_moment, sole.deviation]
    return head, [_numbers(row) for row in np.column_stack(columns).tolist()]


def _of_prints(prints: Prints) -> tuple[list[str], list[list[str]]]:
    head = ["sole", "start_s", "end_s", "x_m", "y_m", "z_m", "heading_rad", "depth_m", "area_m2", "peak_force_n"]
    rows = [
        [
            each.sole,
            *_numbers([each.start, each.end, *each.position.tolist(), each.heading, each.depth, each.area]),
            *_numbers([each.peak_force, each.compressed, each.raised]),
        ]
        for each in prints.prints
    ]
    return [*head, "compressed_m3", "raised_m3"], rows


def _numbers(values: Sequence[float]) -> list[str]:
    """Numbers that give the same float back; nothing where there is none."""
    return ["" if np.isnan(value) else repr(float(value)) for value in values]
