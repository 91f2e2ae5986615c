"""Whether three-dimensional pictures can be drawn on this machine, with or without a display."""

from __future__ import annotations

import functools
import os
import re
import socket
import subprocess
import sys

from fingerslip.errors import ResultError

__all__ = ["has_display", "prepare_rendering"]

_PROBE = (
    "import pyvista; plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32)); "
    "plotter.add_mesh(pyvista.Sphere()); assert plotter.screenshot(None).std() > 0"
)
_WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
# With a graphics driver's EGL, and with Mesa's software renderer.
_WINDOWS = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
_SECONDS = 60
_SECONDS_TO_ANSWER = 3.0
_DISPLAY = re.compile(r"(?P<host>[^:]*):(?P<number>\d{1,4})(\.\d+)?")
_X_PORT = 6000


def has_display() -> bool:
    """Tell whether there is a screen to open windows on: on Linux an X server that answers."""
    return sys.platform != "linux" or _answers(os.environ.get("DISPLAY", ""))


def _answers(display: str) -> bool:
    """Tell whether there is an X server at a display; one is named long after a remote session has ended."""
    known = _DISPLAY.fullmatch(display)
    if known is None:
        return False
    host, number = known["host"], int(known["number"])
    path = f"/tmp/.X11-unix/X{number}"
    if host not in {"", "unix"}:
        return _connects(socket.AF_INET, (host, _X_PORT + number))
    return _connects(socket.AF_UNIX, path) or _connects(socket.AF_UNIX, f"\0{path}")


def _connects(family: socket.AddressFamily, address: str | tuple[str, int]) -> bool:
    with socket.socket(family) as tried:
        tried.settimeout(_SECONDS_TO_ANSWER)
        try:
            tried.connect(address)
        except OSError:
            return False
    return True


def prepare_rendering() -> None:
    """Make VTK draw without a display where there is none.

    VTK ends the whole process where it cannot draw, so each kind of window is tried once in a process of its own.
    """
    if has_display() or _WINDOW in os.environ:
        return
    window = _working_window()
    if window is None:
        raise ResultError(
            "pictures in space cannot be drawn here: there is no display, and neither EGL nor OSMesa works; "
            "install Mesa (Debian, Ubuntu: sudo apt-get install libegl1 libgl1-mesa-dri; Fedora: sudo dnf install "
            "mesa-libEGL mesa-dri-drivers) or open the run's snapshots.pvd with ParaView on another machine"
        )
    os.environ[_WINDOW] = window


@functools.cache
def _working_window() -> str | None:
    """Return the first kind of window that draws."""
    return next((window for window in _WINDOWS if _draws(window)), None)


def _draws(window: str) -> bool:
    try:
        tried = subprocess.run(
            [sys.executable, "-c", _PROBE],
            env={**os.environ, _WINDOW: window},
            capture_output=True,
            timeout=_SECONDS,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return tried.returncode == 0
