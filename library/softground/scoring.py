"""How near estimated forces come to the plates'."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._core.numerics.intervals import runs
from .plates import LOADED

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

EVENT_REACH = 0.15
"""An estimated event farther than this from the measured one is another event [s]."""
EDGE = 0.06
"""Heel strike and toe-off of the motion are this uncertain [s]: no disagreement within it."""


@dataclass(frozen=True)
class Score:
    """Errors of one model on one trial; see `score`.

    Forces are vertical unless named anterior-posterior or medio-lateral, in body weights; `rms_bw_foot` is of both feet
    together, and `share_rms_bw` what remains of it if the estimated shares are given the measured total. Times are of
    where the force crosses `LOADED`: mean absolute error, and the mean error as bias, late being positive.
    """

    rms_bw_foot: float
    rms_bw_left: float
    rms_bw_right: float
    rms_bw_total: float
    share_rms_bw: float
    peak_ratio: float
    heel_strike_ms: float
    heel_strike_bias_ms: float
    toe_off_ms: float
    toe_off_bias_ms: float
    rms_bw_anterior_posterior: float
    rms_bw_foot_anterior_posterior: float
    rms_bw_foot_medio_lateral: float
    mean_cycle_bw: float
    frames_scored: int


@dataclass(frozen=True)
class PointScore:
    """Errors of where the forces act and of how the feet twist; see `score_points`.

    None where the plates do not tell: root mean square of the distance on the level [mm], and of the free moment [N·m].
    """

    rms_centre_mm: float | None = None
    rms_free_moment_nm: float | None = None


def plates_saw_everything(measured: Array, touching: Mask, *, weight: float, rate: float) -> Mask:
    """Frames at which the plates show all that bears the body.

    Left out is what they do not show, as the motion tells it: whole contacts whose plate stays empty (on a walkway with
    a few plates most steps miss them); frames at which another plate than the feet's is loaded; frames at which a foot
    is on the ground but its plate empty; and, where that lasts, all those about them at which the plates do not bear
    the weight: the body sits.

    A foot counts as on the ground where the motion shows it for the whole of ±60 ms, and as off it likewise.

    Parameters
    ----------
    measured : (F, 2) float array
        Vertical plate forces [N].
    touching : (F, 2) bool array
        True if heights and speeds show the foot on the ground; no force has a part in that.
    weight : float
        Body weight [N].
    rate : float
        [Hz]
    """
    reach = max(1, round(EDGE * rate))
    loaded = measured > LOADED
    missed = np.zeros(measured.shape, dtype=bool)
    for foot in range(measured.shape[1]):
        for first, last in zip(*runs(touching[:, foot]), strict=True):
            contact = slice(max(first - reach, 0), last + reach)
            begins = last == len(touching) and last - first <= reach
            missed[contact, foot] |= not (begins or loaded[contact, foot].any())
    window = np.lib.stride_tricks.sliding_window_view
    padded = np.pad(touching, ((reach, reach), (0, 0)), mode="edge")
    surely_on = window(padded, 2 * reach + 1, axis=0).all(axis=-1)
    surely_off = window(~padded, 2 * reach + 1, axis=0).all(axis=-1)
    hidden = (surely_on & ~loaded & ~missed).any(axis=1)
    for first, last in zip(*runs(measured.sum(axis=1) < weight), strict=True):
        hidden[first:last] |= hidden[first:last].sum() > reach
    return np.asarray(~(hidden | (missed | surely_off & loaded).any(axis=1)))


def score(estimated: Array, measured: Array, scored: Mask, *, weight: float, rate: float) -> Score:
    """Compare forces on the left and the right foot.

    Parameters
    ----------
    estimated, measured : (F, 2, 3) float array
        [N]; X is the direction of progress.
    scored : (F,) bool array
        Frames that count, from `plates_saw_everything`.
    weight : float
        Body weight [N].
    rate : float
        [Hz]
    """
    error = (estimated - measured) / weight
    strikes, leaves = _timing_errors(estimated[..., 2], measured[..., 2], scored, rate)
    vertical, total = measured[scored, :, 2], estimated[..., 2].sum(axis=1)
    both = np.minimum(vertical.sum(axis=1), total[scored]) > LOADED
    share = estimated[scored][both, :, 2] / total[scored][both, None]
    return Score(
        rms_bw_foot=_rms(error[scored, :, 2]),
        rms_bw_left=_rms(error[scored, 0, 2]),
        rms_bw_right=_rms(error[scored, 1, 2]),
        rms_bw_total=_rms(error[scored, :, 2].sum(axis=1)),
        share_rms_bw=_rms((share * vertical[both].sum(axis=1, keepdims=True) - vertical[both]) / weight),
        peak_ratio=float(estimated[scored, :, 2].max() / vertical.max()),
        heel_strike_ms=_mean(np.abs(strikes)) * 1e3,
        heel_strike_bias_ms=_mean(strikes) * 1e3,
        toe_off_ms=_mean(np.abs(leaves)) * 1e3,
        toe_off_bias_ms=_mean(leaves) * 1e3,
        rms_bw_anterior_posterior=_rms(error[scored, :, 0].sum(axis=1)),
        rms_bw_foot_anterior_posterior=_rms(error[scored, :, 0]),
        rms_bw_foot_medio_lateral=_rms(error[scored, :, 1]),
        mean_cycle_bw=_mean_over_cycles(total, measured[..., 2]) / weight,
        frames_scored=int(scored.sum()),
    )


def score_points(
    centres: Array, moments: Array, measured: tuple[Array | None, Array | None], scored: Mask
) -> PointScore:
    """Compare centres of pressure (F, 2, 3) [m] and free moments (F, 2) [N·m] with those measured, where they are."""

    def rms(estimated: Array, true: Array | None) -> float | None:
        if true is None:
            return None
        square = ((estimated - true)[scored] ** 2).reshape(scored.sum(), 2, -1).sum(axis=-1)
        square = square[np.isfinite(square)]
        return float(np.sqrt(square.mean())) if len(square) else None

    centre = rms(centres[..., :2], None if measured[0] is None else measured[0][..., :2])
    return PointScore(None if centre is None else 1e3 * centre, rms(moments, measured[1]))


def crossings(force: Array) -> tuple[Array, Array]:
    """Fractional frames at which a force (F,) rises above `LOADED`, and falls below it."""
    first, last = runs(force > LOADED)
    first, last = first[first > 0], last[last < len(force)]

    def between(frame: NDArray[np.intp]) -> Array:
        return np.asarray(frame - 1 + (LOADED - force[frame - 1]) / (force[frame] - force[frame - 1]))

    return between(first), between(last)


def _timing_errors(estimated: Array, measured: Array, scored: Mask, rate: float) -> tuple[Array, Array]:
    """Errors of heel strike and toe-off [s], later ones positive; an event that is missed counts `EVENT_REACH`."""
    errors: tuple[list[float], list[float]] = ([], [])
    for foot in range(measured.shape[1]):
        events = zip(crossings(measured[:, foot]), crossings(estimated[:, foot]), errors, strict=True)
        for true, found, collected in events:
            for event in true[scored[np.round(true).astype(int)]]:
                off = (found - event) / rate
                nearest = off[np.abs(off).argmin()] if len(off) else EVENT_REACH
                collected.append(float(np.clip(nearest, -EVENT_REACH, EVENT_REACH)))
    return np.array(errors[0]), np.array(errors[1])


def _mean_over_cycles(total: Array, measured: Array) -> float:
    """Mean of the total force from the first to the last strike of the foot that strikes most often."""
    strikes = max((crossings(measured[:, foot])[0] for foot in range(measured.shape[1])), key=len)
    if len(strikes) < 2:
        return float(total.mean())
    first, last = np.round(strikes[[0, -1]]).astype(int)
    return float(total[first:last].mean())


def _rms(error: Array) -> float:
    return float(np.sqrt((error**2).mean())) if error.size else 0.0


def _mean(error: Array) -> float:
    return float(error.mean()) if len(error) else 0.0
