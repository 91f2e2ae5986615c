"""The figure of spikes."""

from __future__ import annotations

import numpy as np

from fingerslip.afferents.model import Spikes
from fingerslip.report.figures.receptors import spike_figure
from unit.report.scenes import block_history

TIMES = (np.array([0.1, 0.2]), np.array([0.3]), np.array([0.15, 0.35]))
SPIKES = Spikes(("a", "b", "c"), ("SA-I", "SA-I", "FA-I"), TIMES, 0.0, 0.5)


def test_every_type_has_its_raster_with_a_row_for_each_afferent_and_rates_come_last() -> None:
    slow, fast, rates = spike_figure(SPIKES, block_history()).axes
    assert [len(axes.collections) for axes in (slow, fast)] == [2, 1]
    assert slow.get_ylabel() == "SA-I\n2 afferents"
    drawn = [collection.get_positions() for collection in slow.collections]
    np.testing.assert_allclose(np.concatenate(drawn), [0.1, 0.2, 0.3])
    assert rates.get_ylabel() == "mean rate [1/s]"
