"""Readings that belong to a point of the skin or to the whole contact converge with the mesh; single nodes do not.

The fingertip section of the preset without ridges, on contact elements of 0.6, 0.3 and 0.15 mm; receptors at the same
points on all of them. A front is where slip passes the tolerance, interpolated between nodes, so it changes at least
as fast as the size of the elements. From one size to half of it the change has to halve, and to stay within a step of
5 ms, the resolution of the records.
"""

from itertools import pairwise

import numpy as np
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.slip import force_ratio_times, front_arrivals
from problems.pushed import section
from unit.fingers import change

SIZES = (0.6e-3, 0.3e-3, 0.15e-3)
STEP = 5e-3


def slide(size: float) -> xr.Dataset:
    finger = change(ridges={"enabled": False})
    return fs.simulate(section(finger, sizes=(size, 0.6e-3), record=fs.Recording(sites=fs.receptor_sites(finger))))


@pytest.mark.slow
def test_arrival_of_the_slip_front_at_every_receptor_and_of_shares_of_the_friction_limit_converge() -> None:
    histories = [slide(size) for size in SIZES]
    sites = fs.receptor_sites(change(ridges={"enabled": False}))
    arrivals = [front_arrivals(history, sites=sites).to_series() for history in histories]
    shared = sorted(set.intersection(*(set(series.index) for series in arrivals)))
    # The outermost ones lie in the outermost elements of the coarse mesh, where slip begins with the slide.
    inner = [name for name in arrivals[0].index if name in shared][1:-1]
    assert len(inner) > 20
    of_shares = np.array([force_ratio_times(history, (0.5, 0.9)) for history in histories], dtype=float)
    for times in (np.array([series[inner] for series in arrivals]), of_shares):
        coarse, fine = (np.abs(b - a).max() for a, b in pairwise(times))
        assert fine < 0.5 * coarse
        assert fine < STEP
