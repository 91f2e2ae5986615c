"""Every test of this folder is marked ``integration``; the small study of the unit tests is here, too."""

from __future__ import annotations

from pathlib import Path

import pytest

from unit.study.conftest import reports, write_study

__all__ = ["reports", "write_study"]

FOLDER = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if FOLDER in item.path.parents:
            item.add_marker(pytest.mark.integration)
