"""Finite-element toolkit for fingertip slip.

``__init__.pyi`` lists the public names. They are loaded when they are first used, so that ``import fingerslip`` is
quick.
"""

import sys

import lazy_loader

from fingerslip.installation import use_writable_cache

use_writable_cache()
_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Load a public name when it is first used."""
    if name not in __all__:
        raise AttributeError(f"module 'fingerslip' has no attribute '{name}'", name=name, obj=sys.modules[__name__])
    return _load(name)
