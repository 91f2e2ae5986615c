"""Libraries that take long to load, each from its first use on: most modules need them in few of their functions."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd
    import pyvista
    import xarray as xr
else:
    import importlib

    class _Library:
        """A library whose names are looked up where they are used."""

        def __init__(self, name):
            self._name = name

        def __getattr__(self, name):
            return getattr(importlib.import_module(self._name), name)

    pd, pyvista, xr = map(_Library, ("pandas", "pyvista", "xarray"))

__all__ = ["pd", "pyvista", "xr"]
