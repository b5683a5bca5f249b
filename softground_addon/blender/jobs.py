"""Long work in small steps: a job is a generator that yields its progress and returns its result."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Generic, TypeVar

Result = TypeVar("Result")
State = TypeVar("State")

STAGES = {"sample": 2, "simulate": 5, "write": 3}
"""Stages in their order, and the share of the whole time that each takes about, in tenths."""


@dataclass(frozen=True)
class Progress:
    """Progress of a bake.

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


class _Watched(Generic[State, Result]):
    """A generator that a loop can go through and that tells its result afterwards."""

    result: Result

    def __init__(self, work: Generator[State, None, Result]) -> None:
        self._work = work

    def __iter__(self) -> Iterator[State]:
        self.result = yield from self._work


def run(job: Job[Result], show: Callable[[Progress], None] | None = None) -> Result:
    """Drive a job to its end, and show each progress that it makes."""
    watched, shown = _Watched(job), None
    for progress in watched:
        if show and progress != shown:
            show(progress)
            shown = progress
    return watched.result


def counted(
    work: Generator[int | None, None, Result],
    stage: str,
    count: int,
    *,
    part: int = 0,
    parts: int = 1,
    share: float = 1.0,
) -> Job[Result]:
    """A job of work that yields how many of `count` items are done.

    Parameters
    ----------
    work : generator of int or None
        None where as many are done as before.
    stage : str
        One of `STAGES`.
    part, parts : int
        Which of several equal parts the work is.
    share : float
        What all of them together are of the stage, from its beginning.
    """
    watched, so_far = _Watched(work), 0
    with closing(work):
        for done in watched:
            so_far = so_far if done is None else done
            yield Progress(stage, share * (part + so_far / count) / parts)
    return watched.result


def meanwhile(state: State, slices: Generator[object, None, Result]) -> Generator[State, None, Result]:
    """A computation that knows nothing of Blender, in slices; before each, the job yields the same state."""
    with closing(slices):
        while True:
            yield state
            try:
                next(slices)
            except StopIteration as end:
                result: Result = end.value
                return result
