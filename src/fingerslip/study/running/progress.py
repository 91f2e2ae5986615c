"""The progress of a study: bars on a terminal, lines in a log, or nothing."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

_SECONDS_BETWEEN_LINES = 30.0


class StudyProgress:
    """Receives the progress of a study, and shows nothing of it; classes below this one do."""

    _console: Console | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Take nothing more."""

    def begin(self, names: Sequence[str]) -> None:
        """Receive the names of the runs to be computed."""

    def advance(self, name: str, fraction: float) -> None:
        """Receive the fraction of a run that is done, from 0 to 1."""

    def finish(self, name: str, outcome: str) -> None:
        """Receive the outcome of a run, `done` or `failed`."""

    def say(self, message: str) -> None:
        """Receive a message."""
        if self._console is not None:
            self._console.print(message, highlight=False, markup=False, soft_wrap=True)


class BarProgress(StudyProgress):
    """One bar for every run that has begun and one for the study, with the estimated time left."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bars = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
        )
        self._done: dict[str, float] = {}
        self._tasks: dict[str, TaskID] = {}
        self._total: TaskID | None = None

    def __enter__(self) -> Self:
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop drawing."""
        self._bars.stop()

    def begin(self, names: Sequence[str]) -> None:
        """Draw the bar of the study."""
        self._tasks = {}
        self._done = dict.fromkeys(names, 0.0)
        self._total = self._bars.add_task("all runs", total=float(len(names))) if len(names) > 1 else None

    def advance(self, name: str, fraction: float) -> None:
        """Move the bars on."""
        if name not in self._tasks:
            self._tasks[name] = self._bars.add_task(name, total=1.0)
        self._done[name] = fraction
        self._bars.update(self._tasks[name], completed=fraction)
        if self._total is not None:
            self._bars.update(self._total, completed=sum(self._done.values()))

    def finish(self, name: str, outcome: str) -> None:
        """Fill the bar of a run and write its outcome behind its name."""
        self.advance(name, 1.0)
        self._bars.update(self._tasks[name], description=f"{name}: {outcome}")


class LineProgress(StudyProgress):
    """A line when a run begins or ends and one every half minute, for logs."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._last: dict[str, float] = {}

    def advance(self, name: str, fraction: float) -> None:
        """Write a line if the last one of the run is old enough."""
        now = time.monotonic()
        if now - self._last.get(name, -_SECONDS_BETWEEN_LINES) >= _SECONDS_BETWEEN_LINES:
            self._last[name] = now
            self.say(f"{name}: {100 * fraction:.0f} %")

    def finish(self, name: str, outcome: str) -> None:
        """Write the outcome of a run."""
        self.say(f"{name}: {outcome}")


def progress_on_screen(console: Console | None = None) -> StudyProgress:
    """Return bars for a terminal and lines for anything else, on standard error."""
    console = console or Console(stderr=True)
    return BarProgress(console) if console.is_terminal else LineProgress(console)
