"""How many threads a simulation uses."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController, threadpool_limits

from fingerslip.errors import InputError
from fingerslip.linear.solver import preferred_solver

__all__ = [
    "ALONE",
    "Team",
    "allowed_threads",
    "limited_threads",
    "side_by_side",
    "single_dense_thread",
    "suitable_threads",
    "usable_cores",
]

T = TypeVar("T")

# Below this many degrees of freedom, by the dimension of space, the threads of BLAS and PARDISO wait for each other
# longer than they work. In the plane rows of the factors are short: two threads make the substitution of a step with
# 12,600 unknowns at best a quarter faster (0.49 → 0.37 ms) and that of 55,500 no faster, and where anything else runs
# on the cores, they spin for ten times as long (7 ms).
_WORTH_THREADS = {2: 100_000, 3: 15_000}
# Multiplications with entries of a matrix from which a thread gains more than it takes to be woken.
_WORTH_A_THREAD = 1_000_000


@dataclass(frozen=True)
class Team:
    """Threads that work side by side.

    Parameters
    ----------
    threads : int
        How many there are.
    pool : ThreadPoolExecutor, optional
        The threads; without it there is but the caller's own.
    """

    threads: int = 1
    pool: ThreadPoolExecutor | None = None

    def each(self, function: Callable[..., T], *arguments: Sequence[Any]) -> list[T]:
        """Return the values of a function for each set of arguments, in order, as :func:`map` does."""
        alone = self.pool is None or len(arguments[0]) == 1
        return list(map(function, *arguments) if self.pool is None or alone else self.pool.map(function, *arguments))

    def parts(self, function: Callable[[int, int], T], size: int, work: int) -> list[T]:
        """Return the values of a function for one range from 0 to `size`, or for several that are worth a thread each.

        Parameters
        ----------
        function : callable
            Takes where a range begins and where the next one does.
        size : int
            The end of the last range.
        work : int
            Multiplications in all ranges.
        """
        count = min(self.threads, max(1, work // _WORTH_A_THREAD))
        bounds = [size * number // count for number in range(count + 1)]
        return self.each(function, bounds[:-1], bounds[1:])


#: The caller's own thread.
ALONE = Team()


def usable_cores() -> int:
    """Return how many cores this process may use."""
    with contextlib.suppress(AttributeError):
        # Containers and job queues leave a process fewer cores than the machine has.
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def allowed_threads(threads: int | None = None) -> int:
    """Return how many threads a simulation may use.

    Parameters
    ----------
    threads : int, optional
        Upper limit; without it the number of cores that this process may use, which is never exceeded.

    Raises
    ------
    InputError
        For a limit below one.
    """
    if threads is not None and threads < 1:
        raise InputError("threads", f"got {threads}", "needs a number >= 1")
    cores = usable_cores()
    return min(threads or cores, cores)


def suitable_threads(n_dofs: int, allowed: int, dim: int) -> int:
    """Return how many of the allowed threads the algebra of a system should use.

    Parameters
    ----------
    n_dofs : int
        Its degrees of freedom.
    allowed : int
        Threads that are allowed.
    dim : int
        Dimension of space.
    """
    return 1 if n_dofs < _WORTH_THREADS[dim] else allowed


@contextlib.contextmanager
def limited_threads(count: int) -> Iterator[None]:
    """Compute the block with `count` threads in BLAS, MKL and OpenMP."""
    # A limit reaches only libraries that are loaded. Some others, such as Gmsh, set their own number for all.
    preferred_solver()
    with threadpool_limits(limits=count):
        yield


@contextlib.contextmanager
def single_dense_thread() -> Iterator[None]:
    """Compute the block with one thread in OpenBLAS, and as many as before in MKL's substitutions.

    NumPy's and SciPy's dense products of a step are bound by memory, and their threads, waiting, would take the
    cores from MKL's: together they are several times slower.
    """
    with ThreadpoolController().select(internal_api="openblas").limit(limits=1):
        yield


@contextlib.contextmanager
def side_by_side(threads: int) -> Iterator[Team]:
    """Give the block a :class:`Team` of threads, which end with it; one thread is the caller's own."""
    if threads == 1:
        yield ALONE
        return
    with ThreadPoolExecutor(threads) as pool:
        yield Team(threads, pool)
