"""Contact that comes close to a free edge of its boundary."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.contact.states import OPEN, STICK
from fingerslip.slip import EdgeContact, edge_contact
from fingerslip.slip.front import edge_distance, edge_warning
from unit.synthetic import HALF_WIDTH, Process, make

HISTORY = make(Process())
X = HISTORY["contact_position"].values[:, 0]
SPACING = float(X[1] - X[0])


def ending_at(edge: float, history: xr.Dataset = HISTORY) -> xr.Dataset:
    """Return the history of a body whose boundary ends at a position [m]."""
    return history.assign_coords(contact_edge_distance=("contact_node", np.abs(edge - X)))


def test_contact_that_reaches_an_edge_is_found_with_its_time_and_distance() -> None:
    found = edge_contact(ending_at(HALF_WIDTH + 0.5 * SPACING))
    assert found is not None
    assert found.boundary == "skin"
    assert found.distance == pytest.approx(0.5 * SPACING)
    # The patch grows with the square root of time; nodes within two spacings of the edge touch from here on.
    reach = HALF_WIDTH - SPACING
    assert found.time == pytest.approx((reach / HALF_WIDTH) ** 2, abs=5.1e-3)


def test_contact_that_stays_three_facets_away_does_not_count() -> None:
    history = ending_at(HALF_WIDTH + 3.0 * SPACING)
    assert edge_contact(history) is None
    assert edge_distance(history) == pytest.approx(3.0 * SPACING)


def test_nodes_near_an_edge_that_never_touch_do_not_count() -> None:
    state = HISTORY["contact_state"].where(xr.DataArray(X < 0.0, dims="contact_node"), OPEN).astype(np.int8)
    assert edge_contact(ending_at(HALF_WIDTH, HISTORY.assign(contact_state=state))) is None


def test_facets_of_quadratic_elements_have_nodes_in_their_middle() -> None:
    history = ending_at(HALF_WIDTH + 3.0 * SPACING)
    history.attrs["element"] = "T6"
    assert edge_contact(history) is not None


def test_a_boundary_without_an_edge_and_a_history_that_does_not_know_it_have_no_distance() -> None:
    closed = HISTORY.assign_coords(contact_edge_distance=("contact_node", np.full(X.size, np.inf)))
    for history in (closed, HISTORY):
        assert (edge_contact(history), edge_distance(history)) == (None, None)


def test_every_counterface_is_looked_at() -> None:
    belongs = np.where(X > 0.0, 1, 0)
    two = xr.concat([HISTORY[["counterface_force"]]] * 2, "counterface")
    history = ending_at(HALF_WIDTH).drop_dims("counterface").assign(two)
    history = history.assign_coords(counterface=["left", "right"], contact_counterface=("contact_node", belongs))
    found = edge_contact(history)
    assert found is not None
    assert found.boundary == "right"


def test_a_single_candidate_at_an_edge_counts() -> None:
    one = ending_at(0.0).isel(contact_node=[20])
    touching = one.assign(contact_state=xr.full_like(one["contact_state"], STICK))
    assert edge_contact(touching) == EdgeContact("skin", 0.0, 0.0)


def test_the_warning_names_the_runs_and_what_follows() -> None:
    found = {"angle 0 deg": None, "angle 30 deg": EdgeContact("skin", 0.125, 0.0)}
    text = edge_warning(found)
    assert "angle 30 deg ('skin' from 0.125 s on, smallest distance 0 mm)" in text
    assert "angle 0 deg" not in text
    assert edge_warning({"a": None}) == ""
