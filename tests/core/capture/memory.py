"""How much memory a reader takes."""

import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def taking_no_more_than(size: float) -> Iterator[None]:
    """Fails if more memory is taken at once than some bytes, beside what was taken before."""
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] <= size
    finally:
        tracemalloc.stop()
