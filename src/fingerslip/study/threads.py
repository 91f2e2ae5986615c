"""How many threads the numerical libraries use: they read it from the environment when they are loaded."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

__all__ = ["prefer_single_thread", "single_threads"]

_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def prefer_single_thread() -> None:
    """Have this process use one thread where the user has not asked for another number.

    The dense problems of a step are tiny, and threads that wait for each other make them several times slower.
    """
    for name in _VARIABLES:
        os.environ.setdefault(name, "1")


@contextlib.contextmanager
def single_threads() -> Iterator[None]:
    """Have the processes that are started in this block use one thread each."""
    before = {name: os.environ.get(name) for name in _VARIABLES}
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
