"""Ways of computing that the size of a model decides, so that small ones go each of them."""

import pytest

from fingerslip.dynamics.step import stepper


@pytest.fixture
def as_large(monkeypatch):
    """Have factors of single precision where they serve, as large models have."""
    monkeypatch.setattr(stepper, "_ROUGH_FROM", {2: 0, 3: 0})
