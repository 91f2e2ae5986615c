"""How many threads the numerical libraries use: they read it from the environment when they are loaded."""

from __future__ import annotations

import os

__all__ = ["prefer_single_thread"]

_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def prefer_single_thread() -> None:
    """Have this process use one thread where the user has not asked for another number.

    The dense problems of a step are tiny, and threads that wait for each other make them several times slower.
    """
    for name in _VARIABLES:
        os.environ.setdefault(name, "1")
