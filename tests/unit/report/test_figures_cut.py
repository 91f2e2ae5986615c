"""Cuts through the body over time."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.report.figures_cut import cut_frames_figure
from fingerslip.slip import Events, SlipEvents
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


def test_every_snapshot_is_drawn_once_and_none_after_overall_slip(history: xr.Dataset) -> None:
    assert history["snapshot_time"].values == pytest.approx([0.0, 0.05, 0.1])
    panels = [axes for axes in cut_frames_figure(history).axes if axes.get_visible()]
    assert [axes.get_title("left") for axes in panels] == ["0.050 s", "0.100 s"]
    early = cut_frames_figure(history, Events(SlipEvents(overall=0.06)))
    assert [axes.get_title("left") for axes in early.axes if axes.get_visible()] == ["0.050 s"]


def test_pictures_differ_as_the_stress_does(history: xr.Dataset) -> None:
    first, second = (axes.images[0].get_array() for axes in cut_frames_figure(history).axes if axes.get_visible())
    assert first.shape == (440, 640, 3)
    assert np.abs(first.astype(int) - second.astype(int)).max() > 50
