"""Workers do not import the main module of the process that starts them."""

from __future__ import annotations

import sys

import pytest

from fingerslip.study.running.spawning import without_main_module


def test_the_main_module_is_there_again_behind_the_block() -> None:
    main = sys.modules["__main__"]
    with without_main_module():
        assert sys.modules["__main__"] is not main
        assert not hasattr(sys.modules["__main__"], "__file__")
    assert sys.modules["__main__"] is main
    with pytest.raises(ZeroDivisionError), without_main_module():
        raise ZeroDivisionError
    assert sys.modules["__main__"] is main
