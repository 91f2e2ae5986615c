"""Tracks of simulated markers."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.errors import InputError
from fingerslip.marker_tracks import marker_tracks


def history():
    rest = np.array([[0.0, 6e-3], [0.0, 0.5e-3], [3e-3, 0.3e-3]])
    moved = np.zeros((2, 3, 2))
    moved[1] = [[5.5e-3, 0.0], [0.0, 0.0], [1e-3, 0.0]]
    return xr.Dataset(
        {"displacement": (("time", "site", "component"), moved)},
        coords={
            "time": [0.0, 1.0],
            "site": ["internal-marker-0-01", "rod-foot-0-01", "external-marker-1-01"],
            "site_kind": ("site", ["internal marker", "rod foot", "external marker"]),
            "site_position": (("site", "component"), rest),
        },
    )


def test_positions_rings_and_directions():
    tracks = marker_tracks(history())
    assert tracks["position"].attrs["units"] == "m"
    assert tracks["position"].values[1, 0] == pytest.approx([5.5e-3, 6e-3])
    assert tracks["ring"].values.tolist() == [0, 1]
    assert tracks["kind"].values.tolist() == ["internal", "external"]
    assert tracks["direction"].values[:, 0] == pytest.approx(np.array([[0.0, 1.0], [np.sqrt(0.5), np.sqrt(0.5)]]))
    assert np.isnan(tracks["direction"].values[:, 1]).all()


def test_one_kind_alone():
    tracks = marker_tracks(history(), ("external",))
    assert tracks.sizes["marker"] == 1
    assert "direction" not in tracks


def test_a_history_without_markers():
    with pytest.raises(InputError, match="history: has no markers"):
        marker_tracks(history().assign_coords(site_kind=("site", ["", "", ""])))
