"""Scikit-learn, skops and PyArrow, loaded when they are first needed: they are optional dependencies."""

from __future__ import annotations

import functools

from fingerslip.errors import optional_module

#: Returns a module of an optional dependency, such as ``sklearn.svm``.
optional = functools.partial(optional_module, extra="detect", where="detect", needs="slip detection needs it")
