"""Ways of computing that the size of a model decides, so that small ones go each of them."""

import pytest

import fingerslip as fs
from fingerslip.dynamics.step import stepper
from problems.pushed import push_and_slide
from problems.reduced import SITES


@pytest.fixture(scope="session")
def history():
    """Return the history of the small press and slide, with sites and snapshots."""
    return fs.simulate(push_and_slide(record=fs.Recording(SITES, snapshots_every=0.05)))


@pytest.fixture
def as_large(monkeypatch):
    """Have factors of single precision where they serve, as large models have."""
    monkeypatch.setattr(stepper, "_ROUGH_FROM", {2: 0, 3: 0})
