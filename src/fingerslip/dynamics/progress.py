"""The progress of a simulation on the screen, where a simulation is asked for one from Python."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

__all__ = ["Progress", "shown_progress"]

#: What receives the fraction that is done; True for a bar on standard error, False and None for nothing.
Progress = Callable[[float], None] | bool | None


@contextlib.contextmanager
def shown_progress(progress: Progress) -> Iterator[Callable[[float], None] | None]:
    """Give what receives the fraction that is done; a bar is drawn as long as the block lasts."""
    if not isinstance(progress, bool) or not progress:
        yield progress or None
        return
    # Only a bar needs it.
    from rich import progress as rich_progress
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn("simulation"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with rich_progress.Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("simulation", total=1.0)
        yield lambda fraction: bar.update(task, completed=fraction)
