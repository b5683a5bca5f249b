"""How fast this machine is, beside the one on which the times that tests allow were measured."""

import time
from functools import cache
from statistics import median

import numpy as np

MEASURED = 0.045
"""Processor time of the work below where those times were measured [s]."""
TIMES = 5


def pace_now() -> float:
    """Time that plain Python and numpy take here, over what they took there: 2 on a machine half as fast."""
    return median(_taken() for _ in range(TIMES)) / MEASURED


pace = cache(pace_now)
"""The same, measured once in a process."""


def at_pace(seconds: float) -> float:
    """A time that a machine of the usual pace is allowed [s], as much longer as this one is slower."""
    return seconds * max(pace(), 1.0)


def _taken() -> float:
    began = time.process_time()
    sum(number * number for number in range(500_000))
    values = np.random.default_rng(1).random((400, 2000))
    np.sort(values, axis=0)
    np.cumsum(np.sqrt(values) * values, axis=1)[:, ::-1].copy()
    return time.process_time() - began
