"""How many threads a simulation uses."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from threadpoolctl import ThreadpoolController, threadpool_limits

from fingerslip.dynamics.factor import pardiso_available

__all__ = ["single_dense_thread", "suitable_threads"]

# Below this many degrees of freedom the threads of BLAS and PARDISO wait for each other longer than they work.
_WORTH_THREADS = 60_000


@contextlib.contextmanager
def suitable_threads(n_dofs: int) -> Iterator[None]:
    """Compute the block with one thread where the system is small, and with all that are allowed where it is large."""
    # A limit reaches only libraries that are loaded.
    pardiso_available()
    with threadpool_limits(limits=1) if n_dofs < _WORTH_THREADS else contextlib.nullcontext():
        yield


@contextlib.contextmanager
def single_dense_thread() -> Iterator[None]:
    """Compute the block with one thread in OpenBLAS, and as many as before in MKL's substitutions.

    NumPy's and SciPy's dense products of a step are bound by memory, and their threads, waiting, would take the
    cores from MKL's: together they are several times slower.
    """
    with ThreadpoolController().select(internal_api="openblas").limit(limits=1):
        yield
