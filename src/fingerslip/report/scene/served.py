"""Where a browser finds a result, as data, and whether that place is free: loading it loads nothing that draws."""

from __future__ import annotations

import errno
import socket
from collections.abc import Callable
from dataclasses import dataclass

from fingerslip.errors import InputError

__all__ = ["LOCAL", "Served", "require_free"]

#: The address at which only this machine can look.
LOCAL = "127.0.0.1"

_LARGEST_PORT = 65535
_HOST, _PORT = "view: --host", "view: --port"


@dataclass(frozen=True)
class Served:
    """How a result is served."""

    host: str = LOCAL  # address at which it listens
    port: int = 0  # port
    opened: bool = True  # whether a browser is opened
    announce: Callable[[str], None] = lambda _: None  # gets the address as text as soon as a browser can open it


def require_free(served: Served) -> None:
    """Refuse a place at which nothing can listen, before anything is loaded or drawn."""
    if not 0 <= served.port <= _LARGEST_PORT:
        raise InputError(_PORT, f"got {served.port}", f"needs a number from 0 to {_LARGEST_PORT}", "0 takes a free one")
    try:
        _listen(served)
    except PermissionError:
        found = f"port {served.port} is reserved for the system"
        raise InputError(_PORT, found, f"needs one from 1024 to {_LARGEST_PORT}", "0 takes a free one") from None
    except (socket.gaierror, UnicodeError):
        raise _no_host(served) from None
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            found = f"port {served.port} is in use at {served.host}"
            raise InputError(_PORT, found, "needs a port that is free", "write --port 0, which takes one") from None
        raise _no_host(served) from None


def _listen(served: Served) -> None:
    """Listen for a moment; a port that was in use a minute ago is free, as the server sees it."""
    family, kind, protocol, _, address = socket.getaddrinfo(served.host, served.port, type=socket.SOCK_STREAM)[0]
    with socket.socket(family, kind, protocol) as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        tried.bind(address)
        tried.listen(1)


def _no_host(served: Served) -> InputError:
    found = f"'{served.host}' is no address of this machine"
    return InputError(_HOST, found, f"needs one, such as {LOCAL}", "0.0.0.0 lets other machines look")
