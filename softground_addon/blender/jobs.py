"""Long work in small steps: a job is a generator that yields its progress and returns its result."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import closing
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Generic, TypeVar

Result = TypeVar("Result")
State = TypeVar("State")

STAGES = {"sample": 6, "simulate": 3, "write": 1}
"""Stages in their order, and the share of the whole time that each takes about, in tenths."""

PATIENCE = 0.005
"""Longest wait for a computation that runs aside before its driver gets to do something else [s]."""

SWITCH = 5e-4
"""Longest wait of Blender's own thread for Python while a computation runs aside [s]: it needs it for each panel that
it draws."""


@dataclass(frozen=True)
class Progress:
    """How far a bake is.

    Attributes
    ----------
    stage : str
        One of `STAGES`.
    fraction : float
        Of this stage, 0 to 1.
    """

    stage: str
    fraction: float

    @property
    def overall(self) -> float:
        """Of the whole bake, 0 to 1."""
        stages = list(STAGES)
        before = sum(STAGES[stage] for stage in stages[: stages.index(self.stage)])
        return (before + STAGES[self.stage] * self.fraction) / sum(STAGES.values())


Job = Generator[Progress, None, Result]

_waited_for: ContextVar[bool] = ContextVar("waited_for", default=False)
"""Whether jobs are driven by someone who has nothing else to do before their end."""


class _Watched(Generic[State, Result]):
    """A generator that a loop can go through and that tells its result afterwards."""

    result: Result

    def __init__(self, work: Generator[State, None, Result]) -> None:
        self._work = work

    def __iter__(self) -> Iterator[State]:
        self.result = yield from self._work


def run(job: Job[Result], show: Callable[[Progress], None] | None = None) -> Result:
    """Drive a job to its end, in this thread alone."""
    watched = _Watched(job)
    before = _waited_for.set(True)
    try:
        for progress in watched:
            if show:
                show(progress)
    finally:
        _waited_for.reset(before)
    return watched.result


def counted(
    work: Generator[int, None, Result], stage: str, count: int, *, part: int = 0, parts: int = 1, share: float = 1.0
) -> Job[Result]:
    """A job of work that yields how many of `count` things are done.

    Parameters
    ----------
    work : generator of int
    stage : str
        One of `STAGES`.
    count : int
    part, parts : int
        Which of several equal parts the work is.
    share : float
        What all of them together are of the stage, from its beginning.
    """
    watched = _Watched(work)
    with closing(work):
        for done in watched:
            yield Progress(stage, share * (part + done / count) / parts)
    return watched.result


def aside(stage: str, fraction: float, function: Callable[..., Result], *arguments: object) -> Job[Result]:
    """Compute something that knows nothing of Blender in a thread of its own, so that Blender goes on answering.

    Where the driver is `run`, nobody waits for an answer: it is computed in place.
    """
    return (yield from meanwhile(Progress(stage, fraction), function, *arguments))


def meanwhile(state: State, function: Callable[..., Result], *arguments: object) -> Generator[State, None, Result]:
    """What `aside` does, for generators that yield something else than their progress: the same over and over."""
    if _waited_for.get():  # memory that one thread frees is of little use to another
        yield state
        return function(*arguments)
    patience = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH)
    try:
        with ThreadPoolExecutor(1) as thread:
            outcome = thread.submit(function, *arguments)
            while not wait([outcome], timeout=PATIENCE).done:
                yield state
        return outcome.result()
    finally:
        sys.setswitchinterval(patience)
