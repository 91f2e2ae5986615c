"""How many threads a simulation uses."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from threadpoolctl import threadpool_limits

from fingerslip.dynamics.factor import pardiso_available

__all__ = ["suitable_threads"]

# Below this many degrees of freedom the threads of BLAS and PARDISO wait for each other longer than they work.
_WORTH_THREADS = 60_000


@contextlib.contextmanager
def suitable_threads(n_dofs: int) -> Iterator[None]:
    """Compute the block with one thread where the system is small, and with all that are allowed where it is large."""
    # A limit reaches only libraries that are loaded.
    pardiso_available()
    with threadpool_limits(limits=1) if n_dofs < _WORTH_THREADS else contextlib.nullcontext():
        yield
