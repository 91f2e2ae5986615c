"""Histories that are written for other programs."""

import pytest

import fingerslip as fs
from problems.pushed import push_and_slide

SITES = (fs.Site("deep", "FA-II", (0.0, 2e-3)), fs.Site("low", "", (1e-3, 0.0), "bulk"))


@pytest.fixture(scope="session")
def pushed():
    return fs.simulate(push_and_slide(record=fs.Recording(SITES, snapshots_every=0.05)))
