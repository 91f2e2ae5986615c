"""Check the system libraries that Gmsh and VTK load on Linux, and say what to install.

Run as ``python src/fingerslip/installation.py`` before anything is installed: it needs the standard library alone.
"""

from __future__ import annotations

import ctypes
import sys
from dataclasses import dataclass

__all__ = ["Library", "install_line", "missing_libraries"]


@dataclass(frozen=True)
class Library:
    """A shared library and the packages that bring it.

    Parameters
    ----------
    file : str
        Name that the loader looks for.
    debian, fedora : str
        Package on Debian and Ubuntu, and on Fedora and its relatives.
    """

    file: str
    debian: str
    fedora: str


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
