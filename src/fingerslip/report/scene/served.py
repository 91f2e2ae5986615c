"""Where a browser finds a result, as data: loading it loads nothing that draws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["LOCAL", "Served"]

#: The address at which only this machine can look.
LOCAL = "127.0.0.1"


@dataclass(frozen=True)
class Served:
    """How a result is served.

    Parameters
    ----------
    host : str
        Address at which it listens.
    port : int
        Port; 0 takes one that is free.
    opened : bool
        Whether a browser is opened.
    announce : callable
        Gets the address as text as soon as a browser can open it.
    """

    host: str = LOCAL
    port: int = 0
    opened: bool = True
    announce: Callable[[str], None] = lambda _: None
