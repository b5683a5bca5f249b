"""Curves of forces, where matplotlib is there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core.errors import InputError
from ._core.files import files
from .body import GRAVITY
from .forces import Loads

Array = NDArray[np.float64]


def plot_loads(loads: Loads, path: Path, measured: Array | None = None) -> None:
    """Write the vertical force on each sole as a picture, with one standard deviation, and what plates measured.

    Parameters
    ----------
    loads : Loads
    path : Path
        Ends as pictures of matplotlib do: .png, .svg, .pdf.
    measured : (F, S, 3) float array, optional
        Plate forces on the soles [N].

    Raises
    ------
    InputError
        If matplotlib is not installed, does not write such files, or the file cannot be written.
    """
    figures = _matplotlib()
    weight = loads.body.mass * GRAVITY
    figure = figures.Figure(figsize=(8, 2.4 * len(loads.soles)), layout="constrained")
    axes = np.atleast_1d(figure.subplots(len(loads.soles), 1, sharex=True))
    for number, (axis, sole) in enumerate(zip(axes, loads.soles, strict=True)):
        vertical = sole.force[:, 2] / weight
        band = np.nan_to_num(sole.deviation) / weight
        axis.fill_between(loads.times, np.maximum(vertical - band, 0.0), vertical + band, alpha=0.2, color="tab:red")
        axis.plot(loads.times, vertical, color="tab:red", label="estimated")
        if measured is not None:
            axis.plot(loads.times, measured[:, number, 2] / weight, color="black", label="plates")
        axis.set_ylabel(f"{sole.name}\nvertical force [body weights]")
    axes[0].legend()
    axes[-1].set_xlabel("time [s]")
    with files.replacing(path) as partial:
        try:
            figure.savefig(partial, dpi=110)
        except ValueError as error:
            raise InputError(f"'{path}' cannot be drawn ({error}): call it .png", "not_writable", path=path) from error


def _matplotlib() -> Any:
    try:
        import matplotlib.figure  # noqa: PLC0415  # it is not needed for anything else, and slow to load
    except ImportError:
        raise InputError("plots need matplotlib: pip install matplotlib", "no_matplotlib") from None
    return matplotlib.figure
