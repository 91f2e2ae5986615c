"""Worker processes: they do not import the user's script, and none outlives the process that started it."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import sys
import threading
import types
from collections.abc import Iterator

__all__ = ["end_with_parent", "without_main_module"]


def end_with_parent() -> None:
    """End this process as soon as the one that started it has ended, however that was, and whatever it computes."""
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextlib.contextmanager
def without_main_module() -> Iterator[None]:
    """Start processes in the block that do not import the main module of this one.

    A process that multiprocessing spawns imports the main module of its parent first. A script without
    ``if __name__ == "__main__":`` would so run its study once more in every worker, and a script that is read from
    standard input has no file to import. Jobs need nothing of the main module: all they hold is the package's.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
