"""Receptors around the edges of the contact, and their signals."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.slip import contact_edges, receptor_signals, receptors_in_areas
from fingerslip.slip.receptors import receptor_rows, tangential_acceleration
from unit.synthetic import DEPTHS, HALF_WIDTH, Process, make

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
    positions = HISTORY["site_position"].sel(site=list(chosen["SA-II", "A"]), component="x").values
    assert sorted(positions) == pytest.approx([-5e-3, -4.5e-3, -4e-3, -3.5e-3, -3e-3])
    assert positions[0] == pytest.approx(-4e-3)


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


@pytest.mark.parametrize("normal", [(0.0, 1.0), (0.6, 0.8)])
def test_tilted_plate_has_tangential_coordinates(normal: tuple[float, float]) -> None:
    turn = np.array([[normal[1], normal[0]], [-normal[0], normal[1]]])
    tilted = HISTORY.assign_coords(
        counterface_normal=(("counterface", "component"), [normal]),
        contact_position=(("contact_node", "component"), HISTORY["contact_position"].values @ turn.T),
    )
    assert contact_edges(tilted) == pytest.approx((-HALF_WIDTH, HALF_WIDTH))


def test_area_a_is_the_edge_at_the_smaller_position_along_the_plate() -> None:
    chosen = receptors_in_areas(HISTORY)
    positions = {area: HISTORY["site_position"].sel(site=list(chosen["FA-I", area]), component="x") for area in "AB"}
    assert float(positions["A"].max()) < 0.0 < float(positions["B"].min())
    upside_down = HISTORY.assign_coords(counterface_normal=(("counterface", "component"), [[0.0, -1.0]]))
    swapped = receptors_in_areas(upside_down)
    for one, other in (("A", "B"), ("B", "A")):
        assert set(swapped["FA-I", one]) == set(chosen["FA-I", other])


def test_edges_are_those_of_one_body() -> None:
    counterfaces = np.where(HISTORY["contact_position"][:, 0] > 1e-3, 1, 0)
    two = HISTORY.assign_coords(contact_counterface=("contact_node", counterfaces))
    assert contact_edges(two, counterface=0) == pytest.approx((-HALF_WIDTH, 1e-3), abs=2.1e-4)


def test_receptors_move_with_the_contact_over_time() -> None:
    """At a quarter of the press the contact is half as wide, and so are the positions of its receptors."""
    chosen = receptors_in_areas(HISTORY, per_area=1, kinds=("SA-I",), time=0.25)
    positions = [
        float(HISTORY["site_position"].sel(site=chosen["SA-I", area][0], component="x").values) for area in "AB"
    ]
    assert positions == pytest.approx([-2e-3, 2e-3])


def test_rows_of_receptors_are_those_of_their_names() -> None:
    rows = receptor_rows(HISTORY, ("FA-I", "SA-II"), 2)
    chosen = receptors_in_areas(HISTORY, 2, ("FA-I", "SA-II"))
    assert HISTORY["site"].values[rows].tolist() == [name for names in chosen.values() for name in names]
    assert len(rows) == 8


def test_acceleration_between_uneven_records_is_the_mean_over_the_steps_between_them() -> None:
    velocity = np.zeros((4, 1, 2))
    velocity[:, 0] = [[0.0, 9.0], [1.0, 9.0], [3.0, 9.0], [2.0, 9.0]]
    history = HISTORY.isel(time=slice(4), site=slice(1)).assign(velocity=(("time", "site", "component"), velocity))
    history = history.assign_coords(time=[0.0, 0.5, 1.0, 3.0]).assign_attrs(time_step="auto")
    history["acceleration"][...] = 7.0
    assert tangential_acceleration(history, np.array([0]))[:, 0].tolist() == [7.0, 2.0, 4.0, -0.5]


def test_acceleration_is_along_the_plate_and_the_mean_over_each_step() -> None:
    values = np.zeros((4, 1, 2))
    values[:, 0] = [[1.0, 9.0], [3.0, 9.0], [-5.0, 9.0], [0.0, 9.0]]
    history = HISTORY.isel(time=slice(4), site=slice(1)).assign(acceleration=(("time", "site", "component"), values))
    assert tangential_acceleration(history, np.array([0]))[:, 0].tolist() == [1.0, 2.0, -1.0, -2.5]
