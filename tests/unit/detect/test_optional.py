from __future__ import annotations

import pytest

from fingerslip.detect.optional import optional
from fingerslip.errors import InputError


def test_a_module_that_is_there_is_loaded() -> None:
    assert optional("sklearn.svm").LinearSVC


def test_a_module_that_is_missing_names_the_command_that_installs_it() -> None:
    with pytest.raises(InputError, match=r'detect: no_such_module is missing .*pip install "fingerslip\[detect\]"'):
        optional("no_such_module")
