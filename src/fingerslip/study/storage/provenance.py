"""Provenance: which programs made a result."""

from __future__ import annotations

import functools
import platform
import subprocess
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

__all__ = ["commit", "versions"]

_PACKAGES = (
    *("fingerslip", "scikit-fem", "gmsh", "meshio"),
    *("numpy", "scipy", "numba", "pypardiso", "mkl", "xarray", "h5netcdf"),
)


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that decide a result, those that are installed."""
    return dict(_versions())


@functools.cache
def _versions() -> Mapping[str, str]:
    """Look the packages up once in a process: their metadata are read and parsed."""
    versions = {"python": platform.python_version(), "platform": platform.platform()}
    for name in _PACKAGES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions


def commit() -> str | None:
    """Return the git commit of the source, with '-dirty' after changes; None outside a checkout."""
    source = Path(__file__).resolve().parents[4]
    if not (source / ".git").exists():
        return None
    command = ["git", "-C", str(source), "describe", "--always", "--abbrev=40", "--dirty", "--match="]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() or None
