"""How many threads a simulation uses."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

from threadpoolctl import ThreadpoolController, threadpool_limits

from fingerslip.linear.factorisation import pardiso_available

__all__ = ["allowed_threads", "single_dense_thread", "suitable_threads"]

# Below this many degrees of freedom the threads of BLAS and PARDISO wait for each other longer than they work.
_WORTH_THREADS = 15_000


def allowed_threads() -> int:
    """Return how many threads large systems use: as many as the environment says, else as there are cores."""
    for name in ("MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        with contextlib.suppress(KeyError, ValueError):
            return max(int(os.environ[name]), 1)
    with contextlib.suppress(AttributeError):
        # Containers and job queues leave a process fewer cores than the machine has.
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextlib.contextmanager
def suitable_threads(n_dofs: int) -> Iterator[None]:
    """Compute the block with one thread where the system is small, and with all that are allowed where it is large."""
    # A limit reaches only libraries that are loaded. Others, as Gmsh, change the number behind our back.
    pardiso_available()
    with threadpool_limits(limits=1 if n_dofs < _WORTH_THREADS else allowed_threads()):
        yield


@contextlib.contextmanager
def single_dense_thread() -> Iterator[None]:
    """Compute the block with one thread in OpenBLAS, and as many as before in MKL's substitutions.

    NumPy's and SciPy's dense products of a step are bound by memory, and their threads, waiting, would take the
    cores from MKL's: together they are several times slower.
    """
    with ThreadpoolController().select(internal_api="openblas").limit(limits=1):
        yield
