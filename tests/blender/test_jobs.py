"""Jobs compute aside where Blender has to answer meanwhile, and in place where it does not."""

import threading

import pytest

from softground_addon.blender.jobs import Progress, aside, run


def job():
    return (yield from aside("write", 0.5, threading.get_ident))


def stepped(work):
    """The result of a job that is driven step by step, between other things."""
    try:
        while True:
            next(work)
    except StopIteration as end:
        return end.value


def test_a_job_that_is_waited_for_computes_in_place():
    shown = []
    assert run(job(), shown.append) == threading.get_ident()
    assert shown == [Progress("write", 0.5)]


def test_a_job_that_is_driven_between_other_things_computes_in_a_thread_of_its_own():
    assert stepped(job()) != threading.get_ident()


def test_a_job_that_is_waited_for_within_another_leaves_that_as_it_is():
    def outer():
        within = run(job())
        return within, (yield from job())

    within, after = stepped(outer())
    assert within == threading.get_ident() != after


def failing():
    yield from aside("write", 0.5, lambda: 1 / 0)


@pytest.mark.parametrize("drive", [run, stepped])
def test_what_goes_wrong_in_a_computation_is_told(drive):
    with pytest.raises(ZeroDivisionError):
        drive(failing())
    assert stepped(job()) != threading.get_ident()
