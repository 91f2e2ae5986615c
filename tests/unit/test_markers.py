"""Layouts of markers, and tracks of simulated ones."""

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.distance import pdist

from fingerslip.errors import InputError
from fingerslip.marker_layouts import grid_layout, hexagonal_layout, ring_layout
from fingerslip.marker_tracks import marker_tracks


def test_rings_have_the_markers_of_the_paper_at_their_radii_and_may_have_no_centre():
    layout = ring_layout(1e-3, (0, 6))
    assert layout.ring.tolist() == [1] * 6
    layout = ring_layout(2e-3)
    assert layout.count == 81
    assert np.bincount(layout.ring).tolist() == [1, 8, 16, 24, 32]
    np.testing.assert_allclose(np.hypot(*layout.position.T), 2e-3 * layout.ring, atol=1e-18)
    np.testing.assert_allclose(np.diff(layout.angle[layout.ring == 2]), np.pi / 8)


@pytest.mark.parametrize(("rings", "count"), [(0, 1), (1, 7), (6, 127), (10, 331)])
def test_hexagon_has_its_markers_at_the_pitch(rings, count):
    layout = hexagonal_layout(1e-3, rings)
    assert layout.count == count
    assert np.bincount(layout.ring).tolist() == [1, *(6 * n for n in range(1, rings + 1))]
    if rings:
        assert pdist(layout.position).min() == pytest.approx(1e-3)
    assert (layout.angle < 2 * np.pi).all()
    starts = [np.flatnonzero(layout.ring == n)[0] for n in range(rings + 1)]
    assert (layout.angle[starts] == 0).all()


@pytest.mark.parametrize(
    ("rows", "columns", "rings"), [(7, 9, [1, 8, 16, 24, 14]), (2, 4, [4, 4]), (1, 3, [1, 2]), (1, 1, [1])]
)
def test_grid_has_its_rows_and_columns_about_its_middle(rows, columns, rings):
    layout = grid_layout(1e-3, rows, columns)
    assert np.bincount(layout.ring).tolist() == rings
    x, y = layout.position.T
    assert [len(np.unique(axis)) for axis in (x, y)] == [columns, rows]
    assert layout.position.mean(axis=0) == pytest.approx(0.0, abs=1e-15)
    if layout.count > 1:
        assert pdist(layout.position).min() == pytest.approx(1e-3)
    assert all((np.diff(layout.angle[layout.ring == ring]) > 0.0).all() for ring in range(len(rings)))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: ring_layout(0.0), "pitch: got 0.0"),
        (lambda: ring_layout(float("nan")), "pitch: got nan"),
        (lambda: ring_layout(1e-3, (2, 8)), "counts"),
        (lambda: ring_layout(1e-3, ()), "counts"),
        (lambda: hexagonal_layout(-1e-3, 2), "pitch"),
        (lambda: hexagonal_layout(1e-3, -1), "rings: got -1"),
        (lambda: grid_layout(0.0, 7, 9), "pitch: got 0.0"),
        (lambda: grid_layout(1e-3, 7, 0), "rows, columns: got 7, 0"),
    ],
)
def test_what_cannot_be_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()


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


def test_positions_rings_and_directions_of_both_kinds_of_one_and_of_none():
    tracks = marker_tracks(history())
    assert tracks["position"].attrs["units"] == "m"
    assert tracks["position"].values[1, 0] == pytest.approx([5.5e-3, 6e-3])
    assert tracks["ring"].values.tolist() == [0, 1]
    assert tracks["kind"].values.tolist() == ["internal", "external"]
    assert tracks["direction"].values[:, 0] == pytest.approx(np.array([[0.0, 1.0], [np.sqrt(0.5), np.sqrt(0.5)]]))
    assert np.isnan(tracks["direction"].values[:, 1]).all()
    tracks = marker_tracks(history(), ("external",))
    assert tracks.sizes["marker"] == 1
    assert "direction" not in tracks
    with pytest.raises(InputError, match="history: has no markers"):
        marker_tracks(history().assign_coords(site_kind=("site", ["", "", ""])))
