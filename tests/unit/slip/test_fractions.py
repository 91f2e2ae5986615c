"""Area fractions that slip or have slipped, and the way of nodes off the plate's line."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.slip import (
    contact_area,
    relative_displacement,
    slide_window,
    slipped_fraction,
    slipping_fraction,
    stick_ratio,
)
from fingerslip.slip.windows import accumulated_slip, area_fraction
from unit.synthetic import HALF_WIDTH, PRESS_END, SPEED, Process, make, slip_times

HISTORY = make(Process())


def test_fractions_follow_the_annular_slip() -> None:
    fine = make(Process(nodes=401, jump=False, open_nodes=3))
    slipping = slipping_fraction(fine).sel(time=[1.2, 1.505, 1.9], method="nearest").values
    assert slipping == pytest.approx([0.0, 0.5, 1.0], abs=0.01)
    window = slide_window(fine)
    assert window is not None
    late = slipped_fraction(fine, window, 30e-6).sel(time=1.505 + 0.01, method="nearest")
    assert float(late) == pytest.approx(0.5, abs=0.01)


def test_slipping_fraction_sees_the_jump_that_slipped_fraction_ignores() -> None:
    window = slide_window(HISTORY)
    assert window is not None
    assert float(slipping_fraction(HISTORY).sel(time=PRESS_END + 5e-3, method="nearest")) == 1.0
    assert float(slipped_fraction(HISTORY, window, 50e-6).sel(time=PRESS_END + 5e-3, method="nearest")) == 0.0


def test_stick_ratio_and_area() -> None:
    both = stick_ratio(HISTORY) + slipping_fraction(HISTORY)
    assert np.allclose(both.dropna("time"), 1.0)
    assert float(contact_area(HISTORY)[-1]) == pytest.approx(41 * 2e-4 * 1e-3)
    apart = HISTORY.assign(contact_state=HISTORY["contact_state"] * 0 + OPEN)
    assert slipping_fraction(apart).isnull().all()
    assert float(contact_area(apart).max()) == 0.0


def three_nodes(states: list[list[int]], slip: list[list[float]]) -> xr.Dataset:
    """Return a slide of three nodes with areas 1, 2 and 5 mm2, recorded every 0.1 s."""
    times = 0.1 * np.arange(len(states))
    return HISTORY.isel(time=slice(len(states)), contact_node=slice(3)).assign_coords(
        time=times,
        contact_area=("contact_node", [1e-6, 2e-6, 5e-6]),
        phase_kind=("phase", ["press", "slide"]),
        phase_start=("phase", [-1.0, 0.0]),
        phase_end=("phase", [0.0, times[-1]]),
    ).assign(
        contact_state=(("time", "contact_node"), np.array(states)),
        slip_distance=(("time", "contact_node"), 1e-6 * np.array(slip)),
    )  # fmt: skip


def test_nodes_are_weighed_by_their_areas() -> None:
    states = [[STICK, STICK, STICK], [SLIP, STICK, STICK], [STICK, SLIP, SLIP], [OPEN, SLIP, STICK], [OPEN] * 3]
    history = three_nodes(states, np.zeros((5, 3)).tolist())
    assert slipping_fraction(history).values[:4] == pytest.approx([0.0, 1 / 8, 7 / 8, 2 / 7])
    assert np.isnan(slipping_fraction(history).values[4])
    assert contact_area(history).values == pytest.approx([8e-6, 8e-6, 8e-6, 7e-6, 0.0])
    assert stick_ratio(history).values[:4] == pytest.approx([1.0, 7 / 8, 1 / 8, 5 / 7])


def test_slip_counts_beyond_the_tolerance_from_the_start_of_the_slide_on() -> None:
    """The first node slipped before the slide, the second lands during it, the third slips last."""
    states = [[SLIP, OPEN, STICK], [STICK, STICK, STICK], [STICK, SLIP, SLIP], [SLIP, SLIP, SLIP], [OPEN, SLIP, SLIP]]
    slip = [[50, 0, 0], [50, 0, 0], [60, 30, 21], [75, 60, 40], [75, 90, 60]]
    history = three_nodes(states, slip)
    window = slide_window(history)
    assert window is not None
    assert accumulated_slip(history, window)[:, 0] * 1e6 == pytest.approx([0, 0, 10, 25, 25])
    fraction = slipped_fraction(history, window, 20e-6)
    # Areas 1 and 5 were there from the start; the first lifts off at the end.
    assert fraction.values == pytest.approx([0.0, 0.0, 5 / 6, 1.0, 1.0])
    assert slipped_fraction(history, window, 22e-6).values[2] == 0.0


@given(st.lists(st.tuples(st.booleans(), st.booleans(), st.floats(1e-9, 1e-3)), min_size=1, max_size=20))
def test_a_fraction_is_between_nothing_and_all(nodes: list[tuple[bool, bool, float]]) -> None:
    whole, inside, areas = (np.array(column) for column in zip(*nodes, strict=True))
    (found,) = area_fraction((whole & inside)[None], whole[None], areas)
    assert np.isnan(found) == (not whole.any())
    if whole.any():
        assert -1e-12 <= found <= 1.0 + 1e-12
        assert found == pytest.approx(areas[whole & inside].sum() / areas[whole].sum())


@pytest.mark.parametrize("normal", [(0.0, 1.0), (0.6, 0.8), (0.0, -1.0)])
def test_way_off_the_plates_line_is_along_the_plate_whatever_its_inclination(normal: tuple[float, float]) -> None:
    tangent = np.array([normal[1], -normal[0]])
    window = slide_window(HISTORY)
    assert window is not None
    count = HISTORY.sizes["contact_node"]
    plate, lift = HISTORY["counterface_displacement"].values[:, 0].T
    along = HISTORY["contact_displacement"].values[..., 0]
    squeeze = 1e-4 * np.sin(20.0 * HISTORY["time"].values)
    node = along[..., None] * tangent + squeeze[:, None, None] * np.array(normal)
    counterface = plate[:, None] * tangent + lift[:, None] * np.array(normal)
    inclined = HISTORY.assign_coords(counterface_normal=(("counterface", "component"), [normal])).assign(
        contact_displacement=(("time", "contact_node", "component"), node),
        counterface_displacement=(("time", "counterface", "component"), counterface[:, None]),
    )
    expected = np.abs((along - along[window.first]) - (plate - plate[window.first])[:, None])[window.records]
    assert relative_displacement(inclined, window).shape == (window.last - window.first + 1, count)
    np.testing.assert_allclose(relative_displacement(inclined, window), expected, atol=1e-15)


def test_way_off_the_line_is_the_slip_of_an_ideal_slide() -> None:
    history = make(Process(jump=False))
    window = slide_window(history)
    assert window is not None
    x = np.linspace(-HALF_WIDTH, HALF_WIDTH, 41)
    way = SPEED * np.clip(2.0 - slip_times(Process(), x), 0.0, None)
    np.testing.assert_allclose(relative_displacement(history, window)[-1, :41], way, atol=1e-12)
    np.testing.assert_allclose(accumulated_slip(history, window)[-1, :41], way, atol=1e-12)
