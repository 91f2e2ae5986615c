"""Whether three-dimensional pictures can be drawn on this machine, with or without a display."""

from __future__ import annotations

import functools
import os
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


def has_display() -> bool:
    """Tell whether there is a screen to open windows on."""
    return sys.platform != "linux" or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def prepare_rendering() -> None:
    """Make VTK draw without a display where there is none.

    VTK ends the whole process where it cannot draw, so each kind of window is tried once in a process of its own.

    Raises
    ------
    ResultError
        Where nothing can be drawn on this machine.
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
