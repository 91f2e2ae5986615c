"""What a scene shows, and where a browser finds it, as data: loading it loads nothing that draws."""

from __future__ import annotations

import errno
import socket
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from fingerslip.errors import InputError
from fingerslip.parameters import parameters
from fingerslip.report.scene.names import COMPONENTS, Camera, Cut, Scalar

#: Fields that can be shown: their title, and the factor from SI to its unit.
SCALARS: Mapping[str, tuple[str, float]] = {
    "von_mises": ("von Mises stress [kPa]", 1e-3),
    "strain_energy_density": ("strain energy density [J/m³]", 1.0),
    "displacement": ("displacement [mm]", 1e3),
    "velocity": ("velocity [mm/s]", 1e3),
    "region": ("region", 1.0),
    **{name: (f"Cauchy {name.replace('_', ' ')} [kPa]", 1e-3) for name in COMPONENTS[:6]},
    **{name: (f"{name.replace('_', ' ')} [-]", 1.0) for name in COMPONENTS[6:]},
}


@parameters
class SceneOptions:
    """What a scene shows."""

    scalar: Scalar = "von_mises"  # the field that colours the layers
    hidden: tuple[str, ...] = ()  # regions that are left out
    cut: Cut = "none"  # normal of a plane through the middle of the body, in front of which everything is left out
    # from below the contact is seen through the plate; two-dimensional results are seen from the side
    camera: Camera = "oblique"
    plate: bool = True  # whether the outline of the plate is drawn
    receptors: bool = True  # whether recorded sites are
    edges: bool = False  # whether the edges of the cells are
    contact: bool = False  # whether the nodes that touch are, in the colours of stick and slip
    written: bool = True  # whether the time and the colour bar are written into the picture


#: The address at which only this machine can look.
LOCAL = "127.0.0.1"
_LARGEST_PORT = 65535


@dataclass(frozen=True)
class Served:
    """How a result is served."""

    host: str = LOCAL  # address at which it listens
    port: int = 0  # 0 takes a free one
    opened: bool = True  # whether a browser is opened
    announce: Callable[[str], None] = lambda _: None  # gets the address as text as soon as a browser can open it


def require_free(served: Served) -> None:
    """Refuse a place at which nothing can listen, before anything is loaded or drawn."""
    port, needs = "view: --port", f"needs a number from 0 to {_LARGEST_PORT}"
    if not 0 <= served.port <= _LARGEST_PORT:
        raise InputError(port, f"got {served.port}", needs, "0 takes a free one")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(served.host, served.port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as listener:
            # A port that was in use a minute ago is free, as the server sees it.
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen(1)
    except PermissionError:
        fault = f"port {served.port} is reserved for the system"
        raise InputError(port, fault, f"needs one from 1024 to {_LARGEST_PORT}", "0 takes a free one") from None
    except (OSError, UnicodeError) as error:
        if getattr(error, "errno", None) == errno.EADDRINUSE:
            fault = f"port {served.port} is in use at {served.host}"
            raise InputError(port, fault, "needs a port that is free", "write --port 0, which takes one") from None
        fault, mend = f"'{served.host}' is no address of this machine", "0.0.0.0 lets other machines look"
        raise InputError("view: --host", fault, f"needs one, such as {LOCAL}", mend) from None
