"""Starting worker processes without importing the user's script in them."""

from __future__ import annotations

import contextlib
import sys
import types
from collections.abc import Iterator

__all__ = ["without_main_module"]


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
