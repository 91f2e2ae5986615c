"""Receptors around the edges of the contact and area fractions."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import DEPTHS, HALF_WIDTH, PRESS_END, Process, make

from fingerslip.history import OPEN
from fingerslip.slip import (
    contact_area,
    contact_edges,
    receptor_signals,
    receptors_in_areas,
    slide_window,
    slipped_fraction,
    slipping_fraction,
    stick_ratio,
)

HISTORY = make(Process())


def test_edges_are_those_of_the_patch() -> None:
    assert contact_edges(HISTORY) == pytest.approx((-HALF_WIDTH, HALF_WIDTH))
    # The patch grows with the square root of time.
    assert contact_edges(HISTORY, 0.25) == pytest.approx((-HALF_WIDTH / 2, HALF_WIDTH / 2), abs=2.1e-4)


def test_without_contact_there_are_no_edges_and_no_receptors() -> None:
    apart = HISTORY.assign(contact_state=HISTORY["contact_state"] * 0)
    assert contact_edges(apart) is None
    assert receptors_in_areas(apart) == {}
    assert receptor_signals(apart)["acceleration"].isnull().all()


def test_five_receptors_of_each_type_at_each_edge() -> None:
    chosen = receptors_in_areas(HISTORY)
    assert {key: len(names) for key, names in chosen.items()} == {(k, a): 5 for k in DEPTHS for a in "AB"}
    # Sites stand every 0.5 mm, so the five nearest to -4 mm are -5 .. -3 mm.
    places = HISTORY["site_position"].sel(site=list(chosen["SA-II", "A"]), component="x").values
    assert sorted(places) == pytest.approx([-5e-3, -4.5e-3, -4e-3, -3.5e-3, -3e-3])
    assert places[0] == pytest.approx(-4e-3)


def test_a_receptor_belongs_to_the_nearer_edge_only() -> None:
    chosen = receptors_in_areas(HISTORY, per_area=25)
    left, right = (set(chosen["FA-I", area]) for area in "AB")
    assert len(left | right) == 25
    assert not left & right


def test_signals_are_means_over_the_area() -> None:
    signals = receptor_signals(HISTORY)
    assert signals["acceleration"].dims == ("kind", "area", "time")
    assert (signals["receptor_count"] == 5).all()
    names = list(receptors_in_areas(HISTORY)["FA-II", "B"])
    mean = HISTORY["strain_energy_density"].sel(site=names).mean("site").values
    assert signals["strain_energy_density"].sel(kind="FA-II", area="B").values == pytest.approx(mean)
    rows = history_rows("FA-II", "B")
    ends = HISTORY["acceleration"].values[201:203, rows, 0]
    assert float(signals["acceleration"].sel(kind="FA-II", area="B")[202]) == pytest.approx(ends.mean())


def history_rows(kind: str, area: str) -> list[int]:
    names = HISTORY["site"].values.tolist()
    return [names.index(name) for name in receptors_in_areas(HISTORY)[kind, area]]


def test_missing_types_have_count_zero() -> None:
    signals = receptor_signals(HISTORY.isel(site=HISTORY["site_kind"].values == "FA-I"))
    assert signals["receptor_count"].sel(area="A").values.tolist() == [5, 0, 0, 0]
    assert signals["acceleration"].sel(kind="SA-I").isnull().all()


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


@pytest.mark.parametrize("normal", [(0.0, 1.0), (0.6, 0.8)])
def test_tilted_plate_has_tangential_coordinates(normal: tuple[float, float]) -> None:
    turn = np.array([[normal[1], normal[0]], [-normal[0], normal[1]]])
    tilted = HISTORY.assign_coords(
        body_normal=(("body", "component"), [normal]),
        contact_position=(("contact_node", "component"), HISTORY["contact_position"].values @ turn.T),
    )
    assert contact_edges(tilted) == pytest.approx((-HALF_WIDTH, HALF_WIDTH))
