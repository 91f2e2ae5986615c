"""How many threads the numerical libraries use: they read it from the environment when they are loaded."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

__all__ = ["limited_threads", "prefer_single_thread"]

_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def prefer_single_thread() -> None:
    """Have this process use one thread where the user has not asked for another number.

    The dense problems of a step are tiny, and threads that wait for each other make them several times slower.
    """
    for name in _VARIABLES:
        os.environ.setdefault(name, "1")


@contextlib.contextmanager
def limited_threads(count: int) -> Iterator[None]:
    """Have the simulations of this block, and processes that are started in it, use at most `count` threads each."""
    before = {name: os.environ.get(name) for name in _VARIABLES}
    os.environ.update({name: str(_fewer(count, value)) for name, value in before.items()})
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _fewer(count: int, given: str | None) -> int:
    return min(count, int(given)) if given is not None and given.isdecimal() and int(given) > 0 else count
