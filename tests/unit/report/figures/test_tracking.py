"""Figures of the quality of tracks."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.report.figures.markers import count_figure, jump_figure, noise_figure
from fingerslip.vision.tracks import make_tracks


@pytest.fixture
def tracks() -> xr.Dataset:
    rest = np.array([[10.0, 10.0], [30.0, 10.0], [10.0, 30.0], [30.0, 30.0]])
    position = rest + np.random.default_rng(0).normal(0, 0.1, (12, 4, 2))
    position[4:6, 2] = np.nan
    made = make_tracks(position, np.arange(12) / 10.0, units="px", attributes={"rest_frames": 3, "frame_rate": 10.0})
    state = np.zeros(12, dtype=np.int8)
    state[5] = 1
    dims = ("marker", "axis")
    return made.assign(frame_state=("time", state), reference=(dims, rest), rest_noise=(dims, np.full((4, 2), 0.1)))


def test_count_and_lost_intervals(tracks: xr.Dataset) -> None:
    count, lost = count_figure(tracks).axes
    assert count.get_lines()[0].get_ydata().tolist() == [4, 4, 4, 4, 3, 3, 4, 4, 4, 4, 4, 4]
    (bar,) = lost.patches
    assert (bar.get_x(), bar.get_width()) == pytest.approx((0.35, 0.2))


def test_noise_is_drawn_where_markers_rest(tracks: xr.Dataset) -> None:
    axes, _ = noise_figure(tracks, np.zeros((40, 40), dtype=np.uint8)).axes
    assert np.asarray(axes.collections[0].get_offsets()) == pytest.approx(tracks["reference"].values, abs=0.3)
    assert [text.get_text() for text in axes.texts] == ["0", "1", "2", "3"]


def test_jumps_count_all_pairs_of_frames(tracks: xr.Dataset) -> None:
    (axes,) = jump_figure(tracks).axes
    # A marker without three neighbours that were seen is not judged.
    assert sum(patch.get_height() for patch in axes.patches) == 8 * 4
    (empty,) = jump_figure(tracks.isel(time=slice(0, 1))).axes
    assert "no two frames" in empty.texts[0].get_text()
