"""What a simulation may use: memory and threads."""

from __future__ import annotations

import contextlib
import functools
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from numbers import Integral
from pathlib import Path
from typing import Any

from threadpoolctl import ThreadpoolController

from fingerslip.errors import InputError

_GROUP_LIMIT, _GROUP_USE = Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory.current")
_SYSTEM, _PROCESS = Path("/proc/meminfo"), Path("/proc/self/statm")


def available_memory() -> int | None:
    """Return the memory that this process may still use [bytes]; None where the system does not report it."""
    limits = [value for value in (_in_system(), _in_group(), _in_process()) if value is not None]
    return min(limits, default=None)


def require_memory(sizes: Mapping[str, int]) -> None:
    """Refuse a computation whose parts need more memory than is available [bytes]."""
    available, needed = available_memory(), sum(sizes.values())
    if available is None or needed <= available:
        return
    shares = ", ".join(f"{name} {size / 1e9:.2g} GB" for name, size in sizes.items())
    raise InputError(
        "memory",
        f"the simulation needs about {needed / 1e9:.2g} GB ({shares})",
        f"{available / 1e9:.2g} GB are available",
        "take larger elements, a smaller search_distance, fewer snapshots or fewer runs at once",
    )


def _in_system() -> int | None:
    with contextlib.suppress(OSError, StopIteration):
        lines = _SYSTEM.read_text(encoding="utf-8").splitlines()
        return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    with contextlib.suppress(AttributeError, OSError, ValueError):
        # Elsewhere the whole memory of the machine is the best bound.
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None


def _in_group() -> int | None:
    """Return what is left below the limit of a container."""
    with contextlib.suppress(OSError, ValueError):
        return int(_GROUP_LIMIT.read_text(encoding="utf-8")) - int(_GROUP_USE.read_text(encoding="utf-8"))
    return None


def _in_process() -> int | None:
    """Return what is left below the limit of address space that was set for the process (ulimit -v)."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource  # not on Windows

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            pages = int(_PROCESS.read_text(encoding="utf-8").split()[0])
            return max(limit - pages * os.sysconf("SC_PAGE_SIZE"), 0)
    return None


# Below this many degrees of freedom, by the dimension of space, the threads of BLAS and PARDISO wait for each other
# longer than they work. In 2D rows of the factors are short: two threads make the substitution of a step with
# 12,600 unknowns at best a quarter faster (0.49 → 0.37 ms) and that of 55,500 no faster, and where anything else runs
# on the cores, they spin for ten times as long (7 ms).
_WORTH_THREADS = {2: 100_000, 3: 15_000}


#: What :class:`map` does, perhaps in several threads.
Mapper = Callable[..., Iterable[Any]]


def usable_cores() -> int:
    """Return how many cores this process may use."""
    with contextlib.suppress(AttributeError):
        # Containers and job queues leave a process fewer cores than the machine has.
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def allowed_threads(threads: int | None = None) -> int:
    """Return how many threads a simulation may use."""
    if threads is not None and not (isinstance(threads, Integral) and threads >= 1):
        raise InputError("threads", f"got {threads!r}", "needs a whole number >= 1")
    cores = usable_cores()
    return min(threads or cores, cores)


def suitable_threads(n_dofs: int, allowed: int, dim: int) -> int:
    """Return how many of the allowed threads the algebra of a system should use."""
    return 1 if n_dofs < _WORTH_THREADS[dim] else allowed


@functools.cache
def _libraries() -> ThreadpoolController:
    """Return the libraries with threads that our algebra uses; looking for them takes 10 ms, so once."""
    # Costs of runs are told without loading what computes.
    from fingerslip.linear.solver import preferred_solver

    # Only libraries that are loaded are found.
    preferred_solver()
    return ThreadpoolController()


@contextlib.contextmanager
def limited_threads(count: int) -> Iterator[None]:
    """Compute the block with `count` threads in BLAS, MKL and OpenMP, whatever others, such as Gmsh, have set."""
    with _libraries().limit(limits=count):
        yield


@contextlib.contextmanager
def single_dense_thread() -> Iterator[None]:
    """Compute the block with one thread in OpenBLAS, and as many as before in MKL's substitutions.

    NumPy's and SciPy's dense products of a step are bound by memory, and their threads, waiting, would take the
    cores from MKL's: together they are several times slower.
    """
    with _libraries().select(internal_api="openblas").limit(limits=1):
        yield


@contextlib.contextmanager
def side_by_side(threads: int) -> Iterator[Mapper]:
    """Give the block a mapper on `threads` threads, which end with it; one thread is the caller's own."""
    if threads == 1:
        yield map
        return
    with ThreadPoolExecutor(threads) as pool:
        yield pool.map
