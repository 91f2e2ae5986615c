"""Fields have closed forms for simple motions, units, and no value where nothing was seen."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.errors import InputError
from fingerslip.marker_layouts import ring_layout
from fingerslip.vision.fields import FIELDS, contact_centroid, marker_fields
from fingerslip.vision.tracks import make_tracks

LAYOUT = ring_layout(1e-3)
TIMES = np.arange(31) / 30


def moved(gradient, speed=(0.0, 0.0), units: str = "m") -> xr.Dataset:
    """Return markers whose displacement is linear in place and time."""
    shift = np.einsum("ab,mb->ma", np.asarray(gradient, dtype=float), LAYOUT.position) + speed
    position = LAYOUT.position + TIMES[:, None, None] * shift
    return make_tracks(position, TIMES, units=units, ring=LAYOUT.ring, attributes={"frame_rate": 30.0})


def test_every_field_has_its_dimensions_unit_and_meaning():
    fields = marker_fields(moved(np.zeros((2, 2)), units="px"))
    assert set(fields.data_vars) == set(FIELDS)
    for name, (dims, unit, meaning) in FIELDS.items():
        assert fields[name].dims == dims
        assert fields[name].attrs == {"units": unit.replace("length", "px"), "long_name": meaning}
    assert fields.attrs["frame_rate"] == 30.0
    assert fields.attrs["smoothing"] == 0.2
    assert "ring" in fields.coords


def test_an_affine_motion_has_its_closed_form():
    gradient = np.array([[0.05, -0.02], [0.04, 0.03]])
    fields = marker_fields(moved(gradient, (1e-3, -2e-3)))
    np.testing.assert_allclose(fields["divergence"].values[-1], 0.08, atol=1e-12)
    np.testing.assert_allclose(fields["curl"].values[-1], 0.06, atol=1e-12)
    strain = 0.5 * (gradient + gradient.T + gradient.T @ gradient)
    np.testing.assert_allclose(fields["strain"].values[-1], np.tile(strain[[0, 1, 0], [0, 1, 1]], (128, 1)), atol=1e-12)
    np.testing.assert_allclose(fields["velocity"].values[7, 0], [1e-3, -2e-3], rtol=1e-9)
    np.testing.assert_allclose(fields["displacement"].values[-1, 0], [1e-3, -2e-3])
    np.testing.assert_allclose(fields["rigid_translation"].values[-1], [1e-3, -2e-3], rtol=1e-9)


def test_a_rotation_is_rigid():
    angles = 0.5 * TIMES
    turns = np.array([[np.cos(angles), -np.sin(angles)], [np.sin(angles), np.cos(angles)]]).transpose(2, 0, 1)
    fields = marker_fields(make_tracks(np.einsum("tab,mb->tma", turns, LAYOUT.position), TIMES, units="m"))
    np.testing.assert_allclose(fields["rigid_rotation"], angles, atol=1e-12)
    assert float(fields["rigid_residual_rms"].max()) < 1e-17
    assert float(np.abs(fields["strain"]).max()) < 1e-12


def test_markers_in_space_have_fields_of_the_plane():
    tracks = moved(np.diag([0.1, 0.0]))
    position = np.concatenate([tracks["position"].values, np.zeros((31, 81, 1))], axis=2)
    position[:, :, 2] = 1e-3 * TIMES[:, None]
    fields = marker_fields(make_tracks(position, TIMES, units="m"))
    np.testing.assert_allclose(fields["divergence"].values[-1], 0.1, atol=1e-12)
    np.testing.assert_allclose(fields["rigid_translation"].values[-1, 2], 1e-3)
    np.testing.assert_allclose(fields["velocity"].values[..., 2], 1e-3, rtol=1e-9)


def test_what_was_not_seen_is_nowhere():
    tracks = moved(np.diag([0.1, 0.1]))
    tracks["position"].values[10:20, 4] = np.nan
    tracks["quality"].values[10:20, 4] = 0.0
    fields = marker_fields(tracks)
    for name in ("displacement", "velocity", "rigid_residual"):
        lost = np.isnan(fields[name].values).any(axis=2)
        assert lost.sum() == 10
        assert lost[10:20, 4].all()
    np.testing.assert_allclose(np.delete(fields["divergence"].values[15], 4), 2 * 0.1 * TIMES[15], atol=1e-12)
    np.testing.assert_allclose(
        fields["rigid_residual_rms"].values[15], fields["rigid_residual_rms"].values[14], rtol=0.1
    )


def test_the_centroid_of_a_contact_is_where_markers_are_spread():
    """A spread around a point off the middle, that falls off as a Gaussian."""
    spot, width = np.array([1.5e-3, -0.5e-3]), 1e-3
    off = LAYOUT.position - spot
    shift = 0.2 * off * np.exp(-0.5 * (off**2).sum(axis=1) / width**2)[:, None]
    position = LAYOUT.position + TIMES[:, None, None] * shift
    fields = marker_fields(make_tracks(position, TIMES, units="m"))
    assert np.linalg.norm(fields["contact_centroid"].values[-1] - spot) < 0.3e-3
    assert np.isnan(fields["contact_centroid"].values[0]).all(), "nothing is spread at rest"


def test_the_centroid_weighs_by_divergence_above_its_floor():
    position = np.array([[[0.0, 0.0], [1.0, 0.0], [4.0, 4.0], [np.nan, np.nan]]])
    divergence = np.array([[0.2, 0.4, 0.05, np.nan]])
    np.testing.assert_allclose(contact_centroid(position, divergence, 0.1), [[0.75, 0.0]])


def test_tracks_that_are_too_short_are_refused():
    with pytest.raises(InputError, match="give a shorter smoothing time"):
        marker_fields(moved(np.zeros((2, 2))).isel(time=slice(3)))
    with pytest.raises(InputError, match="rest: got 99 frames"):
        marker_fields(moved(np.zeros((2, 2))), rest=99)
