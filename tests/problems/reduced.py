"""A press-and-slide with enough inside it for a reduced basis, and the comparison of its histories."""

from __future__ import annotations

import numpy as np

import fingerslip as fs
from problems.pushed import pad, push_and_slide

SITES = (fs.Site("deep", "FA-II", (0.0, 2e-3)), fs.Site("low", "SA-I", (1e-3, 0.0), "bulk"))
REDUCED = fs.ReducedBasis(1e-3, 0.5)


def fine_pad(columns=24, rows=12):
    return pad("Q4", columns, rows)


def deep_push_and_slide(**changes):
    """Return a press and slide whose pad has 300 unknowns beside those of contact and sites."""
    values = {"mesh": fine_pad(), "record": fs.Recording(SITES, snapshots_every=0.05)} | changes
    return push_and_slide(**values)


def difference(found, expected, name):
    """Return the largest difference of a variable of two histories over its largest value."""
    one, other = (history[name].values.astype(float) for history in (found, expected))
    return float(np.abs(one - other).max() / np.abs(other).max())
