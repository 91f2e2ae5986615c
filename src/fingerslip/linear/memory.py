"""Whether the memory suffices: estimated and compared before large matrices are made."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from pathlib import Path

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
