"""How many threads linear algebra may take."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS to one thread: runs are worked on side by side already, and two kinds of threads starve each other."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield
