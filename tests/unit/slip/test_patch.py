"""The contact patch of blocks whose motion is known."""

import numpy as np
import pytest

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import InputError
from fingerslip.slip.patch import contact_patch, patch_series, surface_strain_rates, surface_strains, triangle_states
from unit.report.scenes import block_history

ROTATION = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])


@pytest.fixture(scope="module")
def history():
    return block_history()


def moved(history, gradient):
    """Return the history with the displacement (F - I) X, growing from nothing to all of it over time."""
    share = np.linspace(0.0, 1.0, history.sizes["time"])
    full = history["contact_position"].values @ (gradient - np.eye(3)).T
    return history.assign(contact_displacement=history["contact_displacement"].copy(data=share[:, None, None] * full))


def test_triangles_cover_the_patch_once(history):
    patch = contact_patch(history)
    a, b, c = np.swapaxes(patch.points[patch.triangles], 0, 1)
    first, second = b - a, c - a
    areas = 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    assert areas.sum() == pytest.approx(100e-6)
    assert patch.axes @ patch.axes.T == pytest.approx(np.eye(2))
    assert patch.axes[0] == pytest.approx([1.0, 0.0, 0.0])  # along the slide


def test_stretch_and_shear_give_their_green_lagrange_strains_and_a_turn_none(history):
    strains = surface_strains(moved(history, np.diag([1.2, 0.9, 1.0]))).isel(time=-1)
    assert strains.sel(strain_component="along").values == pytest.approx((1.2**2 - 1.0) / 2.0)
    assert strains.sel(strain_component="across").values == pytest.approx((0.9**2 - 1.0) / 2.0)
    assert strains.sel(strain_component="shear").values == pytest.approx(0.0, abs=1e-12)
    shear = np.eye(3)
    shear[0, 1] = 0.1
    sheared = surface_strains(moved(history, shear)).isel(time=-1)
    # Its sign is that of the side on which the axis across lies; the normal part is quadratic.
    assert np.abs(sheared.sel(strain_component="shear").values) == pytest.approx(0.05)
    assert sheared.sel(strain_component="across").values == pytest.approx(0.005)
    assert surface_strains(moved(history, ROTATION)).isel(time=-1).values == pytest.approx(0.0, abs=1e-12)
    rates = surface_strain_rates(surface_strains(moved(history, np.diag([1.0 + 1e-6, 1.0, 1.0]))))
    duration = float(history["time"][-1] - history["time"][0])
    assert rates.sel(strain_component="along").values == pytest.approx(1e-6 / duration, rel=1e-5)
    assert rates.attrs["units"] == "1/s"


def with_states(history, state):
    return history.assign(contact_state=history["contact_state"].copy(data=state))


def test_series_of_a_patch_that_half_slips(history):
    state = np.full(history["contact_state"].shape, STICK, dtype=np.int8)
    areas, slipping = history["contact_area"].values, history["contact_position"].values[:, 0] > 5e-3
    state[:, slipping], state[0] = SLIP, OPEN
    series = patch_series(with_states(history, state))
    assert series["contact_area"].values[1:] == pytest.approx(areas.sum())
    assert series["stick_area"].values[1:] == pytest.approx(areas[~slipping].sum())
    assert np.isnan(series["stick_ratio"].values[0])
    width = np.sqrt(areas.sum() / np.pi) - np.sqrt(areas[~slipping].sum() / np.pi)
    assert series["annulus_width"].values[1:] == pytest.approx(width)
    assert series["annulus_width"].values[0] == 0.0
    series = patch_series(history).isel(time=slice(1, None))
    assert 0.4 < float(series["force_ratio"][-1]) <= float(series["force_ratio"].max()) <= 0.5 * (1.0 + 1e-9)
    assert float(series["stick_ratio"][-1]) < 0.5 < float(series["stick_ratio"].max()), "less and less sticks"


def test_a_triangle_slips_where_a_corner_does_and_a_section_has_no_patch(history):
    patch, state = contact_patch(history), np.full(history["contact_state"].shape, STICK, dtype=np.int8)
    first, last = patch.triangles[[0, -1], 0]
    state[:, patch.nodes[first]], state[:, patch.nodes[last]] = SLIP, OPEN
    states = triangle_states(with_states(history, state), patch, 0)
    around, open_ = ((patch.triangles == node).any(axis=1) for node in (first, last))
    assert (states[open_] == OPEN).all()
    assert (states[around & ~open_] == SLIP).all()
    assert (states[~around & ~open_] == STICK).all()
    with pytest.raises(InputError, match="two-dimensional"):
        contact_patch(block_history("Q4"))
    edge = history["contact_position"] * np.array([1.0, 0.0, 0.0])
    with pytest.raises(InputError, match="has all contact candidates of counterface 0 on a line"):
        contact_patch(history.assign_coords(contact_position=edge))
