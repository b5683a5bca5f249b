"""Walks and runs whose forces are known: a point mass on springs for legs, integrated by scipy.

Running as in Blickhan (1989), "The spring-mass model for running and hopping", J. Biomechanics 22; walking as in
Geyer, Seyfarth and Blickhan (2006), "Compliant leg behaviour explains basic dynamics of walking and running",
Proc. R. Soc. B 273, whose parameters give the double hump.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from softground_addon.core.motion.motion import CharacterMotion
from tests.core.character import character, flat_sole

MASS, LEG, GRAVITY = 80.0, 1.0, 9.81
WEIGHT = MASS * GRAVITY


@dataclass(frozen=True)
class Gait:
    """Half a stride of a symmetric gait, from one touch-down to the next.

    Attributes
    ----------
    times : (K,) float array
        [s], 0 at the touch-down of the leg that is called leading.
    path : (K, 2) float array
        Place of the mass, forward from where the leading foot stands, and up [m].
    forces : (K, 2, 2) float array
        Forces of the trailing and the leading leg on the mass, forward and up [N].
    step : float
        Length of a step [m].
    contact : float
        How long each foot stands [s].
    """

    times: np.ndarray
    path: np.ndarray
    forces: np.ndarray
    step: float
    contact: float


def run(speed: float, *, flight: float = 0.11, stiffness: float = 25.0) -> Gait:
    """A run at a speed while in flight [m/s], flights of `flight` [s], legs of `stiffness` weights per leg length."""
    k = stiffness * WEIGHT / LEG
    fall = GRAVITY * flight / 2

    def stance(angle: float):
        start = [-LEG * np.cos(angle), LEG * np.sin(angle), speed, -fall]
        return _until(start, ((0.0, k),), lambda s: np.hypot(s[0], s[1]) - LEG, 1)

    # The steepest leg whose stance is symmetric: it leaves as fast as it came.
    angle = brentq(lambda a: stance(a).y[0, -1] - LEG * np.cos(a), np.radians(45), np.radians(85))
    solution = stance(angle)
    contact = solution.t[-1]
    times = np.linspace(0, contact + flight, 4001)
    air = np.maximum(times - contact, 0)
    state = solution.sol(np.minimum(times, contact))
    path = state[:2].T + air[:, None] * state[2:].T - np.stack([0 * air, GRAVITY / 2 * air**2], axis=1)
    leading = _leg_force(path, 0.0, k) * (times <= contact)[:, None]
    step = path[-1, 0] - path[0, 0]
    return Gait(times, path, np.stack([0 * leading, leading], axis=1), step, contact)


def walk(*, stiffness: float = 14e3, angle: float = np.radians(69.0), energy: float = 816.0) -> Gait:
    """The walk of Geyer et al. 2006, with their parameters as defaults: stiffness [N/m] and energy [J]."""

    def step(height):
        """From mid-stance over the foot at 0 to mid-stance over the next one."""
        kinetic = energy - MASS * GRAVITY * height - stiffness * (LEG - height) ** 2 / 2
        single = _until(
            [0.0, height, np.sqrt(2 * kinetic / MASS), 0.0],
            ((0.0, stiffness),),
            lambda s: s[1] - LEG * np.sin(angle),
            -1,
        )
        foot = single.y[0, -1] + LEG * np.cos(angle)
        legs = ((0.0, stiffness), (foot, stiffness))
        double = _until(single.y[:, -1], legs, lambda s: np.hypot(s[0], s[1]) - LEG, 1)
        last = _until(double.y[:, -1], ((foot, stiffness),), lambda s: s[0] - foot, 1)
        return single, double, last, foot

    height = brentq(lambda h: step(h)[2].y[3, -1], 0.95, 0.985)
    single, double, last, foot = step(height)
    phases = (double, last, single)
    ends = np.cumsum([phase.t[-1] for phase in phases])
    times = np.linspace(0, ends[-1], 4001)
    state = np.empty((4, len(times)))
    for phase, end, move in zip(phases, ends, (-foot, -foot, 0.0), strict=True):
        now = (times >= end - phase.t[-1] - 1e-12) & (times <= end + 1e-12)
        state[:, now] = phase.sol(np.clip(times[now] - end + phase.t[-1], 0, phase.t[-1]))
        state[0, now] += move
    path = state[:2].T
    trailing = _leg_force(path, -foot, stiffness) * (times <= ends[0])[:, None]
    return Gait(times, path, np.stack([trailing, _leg_force(path, 0.0, stiffness)], axis=1), foot, ends[-1] + ends[0])


def _until(state, legs, event, direction):
    """The motion over `legs`, (foot, stiffness) each, until a function of the state crosses 0 in a direction."""

    def crossing(_, now):
        return event(now)

    crossing.terminal, crossing.direction = True, direction
    return solve_ivp(
        lambda _, now: _acceleration(now, legs), (0, 2), state, events=crossing, dense_output=True, rtol=1e-9, atol=1e-9
    )


def _acceleration(state, legs):
    place = state[:2]
    force = sum(_leg_force(place[None], foot, k)[0] for foot, k in legs)
    return [*state[2:], force[0] / MASS, force[1] / MASS - GRAVITY]


def _leg_force(place, foot, k):
    arm = place - (foot, 0.0)
    length = np.linalg.norm(arm, axis=1, keepdims=True)
    return k * np.maximum(LEG - length, 0.0) * arm / length


def motion_and_forces(
    gait: Gait, *, rate: float, seconds: float = 4.0, lift: float = 0.15, start: float = 0.3
) -> tuple[CharacterMotion, np.ndarray]:
    """The gait on two feet at a frame rate, and the force on each foot (F, 2, 3) [N]."""
    period = gait.times[-1]
    time = start * period + np.arange(int(seconds * rate)) / rate
    count, moment = np.divmod(time, period)

    def at(values):
        return np.stack([np.interp(moment, gait.times, column) for column in values.T], axis=1)

    place = at(gait.path)
    place[:, 0] += count * gait.step
    trailing, leading = at(gait.forces[:, 0]), at(gait.forces[:, 1])
    forces, feet = np.zeros((len(time), 2, 3)), []
    for foot in (0, 1):
        leads = count % 2 == foot
        forces[:, foot, ::2] = np.where(leads[:, None], leading, trailing)
        # Its last touch-down, how long ago that was, and how far it has swung since it left.
        landed = np.where(leads, count, count - 1)
        swing = np.clip((time - landed * period - gait.contact) / (2 * period - gait.contact), 0.0, 1.0)
        x = gait.step * (landed + 2 * swing**2 * (3 - 2 * swing))
        side = np.full_like(x, 0.1 - 0.2 * foot)
        feet.append(
            flat_sole(
                np.stack([x, side, lift * np.sin(np.pi * swing)], axis=1), name="LR"[foot], landmarks=((0, 0, 0),)
            )
        )
    hips = np.stack([place[:, 0], 0 * time, place[:, 1]], axis=1)
    return character(feet, hips=hips, rate=rate, mass=MASS, leg_length=LEG), forces
