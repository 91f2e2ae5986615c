"""Gmsh opened for one mesh at a time, and closed whatever happens."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import gmsh
import pygmsh

from fingerslip.errors import MeshError

__all__ = ["MILLIMETRES", "gmsh_session", "length_unit"]

MILLIMETRES = 1e3
"""Gmsh's tolerances suit lengths near one, so it works in millimetres."""

_GMSH_IN_USE = threading.Lock()


def length_unit(largest: float) -> float:
    """Return the length [m] that Gmsh takes as one where the largest element size is `largest` [m].

    On surfaces that are given as triangles Gmsh makes no element larger than one, whatever size it is told.
    """
    return 2.0 * largest


class _QuietGeometry(pygmsh.geo.Geometry):  # type: ignore[misc]
    """Geometry that leaves Python's handling of Ctrl-C alone and reads no configuration of the user's."""

    def __enter__(self) -> _QuietGeometry:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        for option, value in (("General.Terminal", 0), ("General.NumThreads", 1), ("Mesh.RandomSeed", 1)):
            gmsh.option.setNumber(option, value)
        gmsh.model.add("fingertip")
        return self


@contextmanager
def gmsh_session() -> Iterator[pygmsh.geo.Geometry]:
    """Open Gmsh for one mesh, one at a time, and close it whatever happens."""
    with _GMSH_IN_USE, _broken_pipes_as_before():
        if gmsh.isInitialized():
            raise MeshError("gmsh", "is already initialised", "needs a Gmsh of its own", "call gmsh.finalize() first")
        with _QuietGeometry() as geometry:
            yield geometry


@contextmanager
def _broken_pipes_as_before() -> Iterator[None]:
    """Keep the handling of broken pipes: Gmsh has them end the process, also where only a worker is lost."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or not hasattr(signal, "SIGPIPE"):
        yield
        return
    before = signal.getsignal(signal.SIGPIPE)
    try:
        yield
    finally:
        signal.signal(signal.SIGPIPE, before)
