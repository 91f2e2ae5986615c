"""Every test of this folder is marked ``integration``; the small study of the unit tests is here, too."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest

from unit.study.conftest import reports, write_study

__all__ = ["reports", "write_study"]


def cases(values: Iterable[tuple[str, ...]], fast: Collection[tuple[str, ...]]) -> list[Any]:
    """Return the cases of a test, those that are not in the fast ones marked as slow."""
    return [pytest.param(*value, marks=[pytest.mark.slow] * (value not in fast)) for value in values]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.nodeid.startswith("tests/integration/"):
            item.add_marker(pytest.mark.integration)
