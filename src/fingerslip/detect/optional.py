"""Scikit-learn, skops and PyArrow, loaded when they are first needed: they are optional dependencies."""

from __future__ import annotations

import importlib
from typing import Any

from fingerslip.errors import InputError


def optional(module: str) -> Any:
    """Return a module of an optional dependency, such as ``sklearn.svm``."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        repair = 'pip install "fingerslip[detect]"'
        raise InputError("detect", f"{module} is missing ({error})", "slip detection needs it", repair) from error
