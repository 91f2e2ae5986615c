"""One case: a call that must succeed or be refused with an error of the package, in time, and leave nothing behind."""

import contextlib
import os
import random
import resource
import signal
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

from fingerslip.errors import FingerslipError

SEED = 20140
# Of the processor; and by the clock, which runs on where other programs take the processor, and where a case waits.
_SECONDS, _CLOCK_SECONDS = 20.0, 300.0
_MEMORY = 6_000_000_000
_LONGEST_LINE = 1500


class HangError(BaseException):
    """A case took longer than it may; no `except Exception` may swallow it."""


def faults(case: Callable[[random.Random], None], numbers: range, leftovers: Callable[[], list[str]]) -> list[str]:
    """Return what went wrong in cases that random numbers choose; `leftovers` tells files that they left behind."""
    found = []
    with _limited_memory():
        for number in numbers:
            wrong = _fault(case, random.Random(SEED + number))
            left = leftovers()
            found += [f"case {number}: {wrong}"] * bool(wrong) + [f"case {number} left {left}"] * bool(left)
    return found


def unfinished(folder: Path) -> list[str]:
    """Return the names of temporary files below a folder."""
    return sorted(
        path.name for path in folder.rglob(".*") if path.suffix in (".old", ".lock") or ".partial" in path.name
    )


def newcomers(folder: Path) -> Callable[[], list[str]]:
    """Return what tells the names in a folder that are there now and not before, but for the damaged files."""
    before = set(folder.iterdir())
    return lambda: sorted(
        path.name for path in folder.iterdir() if path not in before and not path.name.startswith("mutant.")
    )


def _fault(case: Callable[[random.Random], None], chance: random.Random) -> str:
    try:
        with _limited_time():
            case(chance)
    except FingerslipError as error:
        longest = max(map(len, str(error).splitlines()), default=0)
        return "" if 0 < longest < _LONGEST_LINE else f"an error of {longest} characters: {str(error)[:300]}"
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        places = [f"{Path(one.filename).name}:{one.lineno}" for one in traceback.extract_tb(error.__traceback__)[-6:]]
        return f"{type(error).__name__}: {str(error)[:200]} at {' > '.join(places)}"
    return ""


@contextlib.contextmanager
def _limited_time() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise HangError(f"took more than {_SECONDS:g} s of the processor, or {_CLOCK_SECONDS:g} s")

    timers = ((signal.SIGPROF, signal.ITIMER_PROF, _SECONDS), (signal.SIGALRM, signal.ITIMER_REAL, _CLOCK_SECONDS))
    before = [signal.signal(number, stop) for number, _, _ in timers]
    for _, timer, seconds in timers:
        signal.setitimer(timer, seconds)
    try:
        yield
    finally:
        for (number, timer, _), handler in zip(timers, before, strict=True):
            signal.setitimer(timer, 0.0)
            signal.signal(number, handler)


@contextlib.contextmanager
def _limited_memory() -> Iterator[None]:
    """Limit what the process may take, so that a case that takes too much does not take the machine's."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (used + _MEMORY, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
