"""What the machine must offer: system libraries that Gmsh and VTK load on Linux, and a folder for compiled functions.

Run as ``python src/fingerslip/installation.py`` before anything is installed: it needs the standard library alone.
"""

from __future__ import annotations

import ctypes
import os
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Library:
    """A shared library and the packages that bring it."""

    file: str  # name that the loader looks for
    debian: str  # package on Debian and Ubuntu
    fedora: str  # package on Fedora and its relatives


_NEEDED = (
    Library("libGL.so.1", "libgl1", "mesa-libGL"),
    Library("libGLU.so.1", "libglu1-mesa", "mesa-libGLU"),
    Library("libEGL.so.1", "libegl1", "mesa-libEGL"),
    Library("libX11.so.6", "libx11-6", "libX11"),
    Library("libXext.so.6", "libxext6", "libXext"),
    Library("libXrender.so.1", "libxrender1", "libXrender"),
    Library("libXcursor.so.1", "libxcursor1", "libXcursor"),
    Library("libXft.so.2", "libxft2", "libXft"),
    Library("libXinerama.so.1", "libxinerama1", "libXinerama"),
    Library("libXfixes.so.3", "libxfixes3", "libXfixes"),
    Library("libfontconfig.so.1", "libfontconfig1", "fontconfig"),
    Library("libgomp.so.1", "libgomp1", "libgomp"),
)


def missing_libraries() -> tuple[Library, ...]:
    """Return the libraries that this machine lacks; none on systems whose wheels bring their own."""
    return tuple(library for library in _NEEDED if not _loads(library.file)) if sys.platform == "linux" else ()


def install_line(missing: tuple[Library, ...]) -> str:
    """Return the commands that install missing libraries, one for each family of Linux."""
    debian = " ".join(library.debian for library in missing)
    fedora = " ".join(library.fedora for library in missing)
    return f"  Debian, Ubuntu:  sudo apt-get install {debian}\n  Fedora, RHEL:    sudo dnf install {fedora}"


def _loads(file: str) -> bool:
    try:
        ctypes.CDLL(file)
    except OSError:
        return False
    return True


def use_writable_cache(folders: Iterable[Path] = ()) -> None:
    """Have Numba keep compiled functions where it can: beside them, at home, in a temporary folder, or nowhere."""
    beside = Path(__file__).with_name("__pycache__")
    home = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "numba")  # noqa: PTH111  no error
    if "NUMBA_CACHE_DIR" in os.environ or any(map(_is_writable, folders or (beside, home))):
        return
    try:
        user = os.getuid() if hasattr(os, "getuid") else "user"
        os.environ["NUMBA_CACHE_DIR"] = str(Path(tempfile.gettempdir(), f"fingerslip-{user}"))
    except FileNotFoundError:
        from numba.core.dispatcher import Dispatcher

        Dispatcher.enable_caching = lambda _: None  # type: ignore[assignment, method-assign]


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def main() -> int:
    """Print what is missing to the error stream; return 2 where something is, else 0."""
    missing = missing_libraries()
    if missing:
        names = ", ".join(library.file for library in missing)
        sys.stderr.write(f"Gmsh and VTK need system libraries that are not here: {names}\n{install_line(missing)}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
