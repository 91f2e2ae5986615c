"""Arrival of the slip front at receptors, and when friction reaches a share of its limit."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.sites import Site
from fingerslip.slip import EventSettings, force_ratio_times, front_arrivals
from unit import synthetic
from unit.synthetic import HALF_WIDTH, PRESS_END, SPEED, Process, make, slip_times

PROCESS = Process(jump=False)
TOLERANCE = EventSettings().slip_tolerance


@pytest.mark.parametrize("nodes", [21, 81])
def test_front_arrives_at_a_receptor_when_it_passes_there_on_any_mesh(nodes: int) -> None:
    history = make(Process(jump=False, nodes=nodes))
    arrivals = front_arrivals(history)
    sites = [str(name) for name in arrivals["site"].values]
    rows = [history["site"].values.tolist().index(name) for name in sites]
    x = history["site_position"].values[rows, 0]
    assert np.all(np.diff(x) > 0.0)
    assert np.all(np.abs(x) <= HALF_WIDTH + 1e-9)
    expected = slip_times(PROCESS, x) + TOLERANCE / SPEED
    # Between nodes the front is straight but for the centre, where it turns between two nodes of the coarse mesh.
    assert arrivals.values == pytest.approx(expected, abs=2e-3)


def test_front_that_does_not_arrive_is_missing() -> None:
    arrivals = front_arrivals(make(Process(jump=False, centre=2.5)))
    assert np.isnan(arrivals.values[arrivals.size // 2])
    assert np.isfinite(arrivals.values[[0, -1]]).all()


def test_receptors_may_be_taken_where_they_were_meant_to_be() -> None:
    sites = [
        Site("here", "FA-I", (1.1e-3, -6e-3)),
        Site("out", "FA-I", (9e-3, -6e-3)),
        Site("deep", "SA-II", (0.0, 0.0)),
    ]
    arrivals = front_arrivals(make(PROCESS), sites=sites)
    assert arrivals["site"].values.tolist() == ["here"]
    assert arrivals.values[0] == pytest.approx(slip_times(PROCESS, np.array([1.1e-3]))[0] + TOLERANCE / SPEED, abs=1e-3)


def test_nothing_arrives_without_slide_or_receptors() -> None:
    still = make(Process(phases=(("press", 0.0, 1.0), ("hold", 1.0, 2.0))))
    assert front_arrivals(still).size == 0
    assert front_arrivals(make(PROCESS), kinds=("unknown",)).size == 0
    assert force_ratio_times(still) == (None, None)


def test_friction_reaches_its_shares_in_order() -> None:
    half, most, beyond = force_ratio_times(make(PROCESS), (0.5, 0.9, 1.1))
    # The synthetic friction force rises evenly from the start of the slide to overall slip.
    rise = synthetic.Process().centre - PRESS_END
    assert half == pytest.approx(PRESS_END + 0.5 * rise, abs=1e-3)
    assert most == pytest.approx(PRESS_END + 0.9 * rise, abs=1e-3)
    assert beyond is None


def test_without_friction_there_is_no_limit() -> None:
    assert force_ratio_times(make(Process(friction=0.0)), (0.5,)) == (None,)
