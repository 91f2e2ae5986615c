"""Ways of computing that the size of a model decides, so that small ones go each of them."""

from __future__ import annotations

import pytest

from fingerslip.dynamics.step import condensation


@pytest.fixture
def by_schur(monkeypatch):
    """Have everything condensed by the Schur complement, as large models are."""
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 0)


@pytest.fixture(params=["columns", "schur"])
def condensed(request, monkeypatch):
    """Have everything condensed either way."""
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 0 if request.param == "schur" else 10**9)
