"""Cuts through the body over time."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.report.figures.deformed import crop, cut_frames_figure
from fingerslip.slip import Events, SlipEvents
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


@pytest.mark.slow
def test_every_snapshot_is_drawn_once_and_none_after_overall_slip(history: xr.Dataset) -> None:
    assert history["snapshot_time"].values == pytest.approx([0.0, 0.05, 0.1])
    panels = [axes for axes in cut_frames_figure(history).axes if axes.get_visible()]
    assert [axes.get_title("left") for axes in panels if axes.images] == ["0.050 s", "0.100 s"]
    early = cut_frames_figure(history, Events(SlipEvents(overall=0.06)))
    assert [axes.get_title("left") for axes in early.axes if axes.images] == ["0.050 s"]


def test_pictures_differ_as_the_stress_does(history: xr.Dataset) -> None:
    first, second = (axes.images[0].get_array() for axes in cut_frames_figure(history).axes if axes.images)
    assert first.shape == second.shape
    assert np.abs(first.astype(int) - second.astype(int)).max() > 50


def test_pictures_share_one_bar_with_its_unit(history: xr.Dataset) -> None:
    labels = [axes.get_ylabel() for axes in cut_frames_figure(history).axes if axes.get_ylabel()]
    assert labels == ["von Mises stress [kPa]"]


def test_white_margins_go_at_the_same_place_of_all_pictures() -> None:
    first, second = np.full((2, 6, 8, 3), 255, dtype=np.uint8)
    first[1, 2], second[3, 5] = 0, 0
    for picture, black in zip(crop([first, second]), [(0, 0), (2, 3)], strict=True):
        assert picture.shape == (3, 4, 3)
        assert np.argwhere(picture[..., 0] == 0).tolist() == [list(black)]
    blank = np.full((3, 3, 3), 255, dtype=np.uint8)
    assert crop([blank])[0].shape == blank.shape
