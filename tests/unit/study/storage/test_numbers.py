"""Key numbers of a run, from histories in which they are known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.study.storage.numbers import key_numbers
from unit.synthetic import Process, make

HISTORY = make(Process())
PHASES = (("press", 0.0, 1.0), ("slide", 1.0, 1.5), ("lift", 1.5, 2.0))


def with_forces(history: xr.Dataset, normal: np.ndarray, tangential: np.ndarray) -> xr.Dataset:
    force = np.stack([tangential, normal], axis=-1)[:, None]
    return history.assign(counterface_force=(("time", "counterface", "component"), force))


def test_forces_are_the_largest_the_last_and_their_ratio_at_the_end_of_the_slide() -> None:
    history = make(Process(phases=PHASES))
    times = history["time"].values
    normal = np.where(times <= 1.5 + 1e-9, 0.4, 0.1) + 0.2 * (np.abs(times - 0.5) < 1e-9)
    tangential = np.where(np.abs(times - 1.5) < 1e-9, -0.1, 0.3)
    numbers = key_numbers(with_forces(history, normal, tangential))
    assert numbers["normal_force_max_N"] == pytest.approx(0.6)
    assert numbers["normal_force_end_N"] == pytest.approx(0.1)
    assert numbers["friction_force_ratio_end_of_slide"] == pytest.approx(0.25)


def test_forces_are_along_the_plates_own_axes() -> None:
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    turned = HISTORY.assign_coords(counterface_normal=(("counterface", "component"), [turn @ [0.0, 1.0]]))
    turned = turned.assign(
        counterface_force=HISTORY["counterface_force"].copy(data=HISTORY["counterface_force"].values @ turn.T)
    )
    straight, inclined = key_numbers(HISTORY), key_numbers(turned)
    assert straight["friction_force_ratio_end_of_slide"] == pytest.approx(0.6)
    for name in ("normal_force_max_N", "normal_force_end_N", "friction_force_ratio_end_of_slide"):
        assert inclined[name] == pytest.approx(straight[name])


def test_there_is_no_ratio_without_a_slide_or_without_pressure() -> None:
    pressed = make(Process(phases=(("press", 0.0, 1.0), ("hold", 1.0, 2.0))))
    assert key_numbers(pressed)["friction_force_ratio_end_of_slide"] is None
    none = np.zeros(HISTORY.sizes["time"])
    assert key_numbers(with_forces(HISTORY, none, none))["friction_force_ratio_end_of_slide"] is None


def test_the_last_slide_counts() -> None:
    phases = (("press", 0.0, 1.0), ("slide", 1.0, 1.2), ("hold", 1.2, 1.5), ("slide", 1.5, 2.0))
    history = make(Process(phases=phases))
    times = history["time"].values
    ratio = key_numbers(with_forces(history, np.ones_like(times), times / 10))["friction_force_ratio_end_of_slide"]
    assert ratio == pytest.approx(0.2)


def test_contact_numbers_are_the_extreme_ones_with_their_signs() -> None:
    gap, traction = HISTORY["gap"].copy(), HISTORY["tangential_traction"].copy()
    gap[7, 3], gap[9, 4] = -5e-6, 8e-4
    traction[11, 2] = np.array([-4e3, 0.0])
    history = HISTORY.assign(gap=gap, tangential_traction=traction)
    history.attrs["tangential_penalty"] = 2e9
    numbers = key_numbers(history)
    assert numbers["penetration_max_m"] == pytest.approx(5e-6)
    assert numbers["elastic_slip_max_m"] == pytest.approx(4e3 / 2e9)
    assert numbers["normal_traction_max_Pa"] == pytest.approx(3e3)
    assert numbers["slip_distance_max_m"] == pytest.approx(float(HISTORY["slip_distance"].max()))


def test_a_gap_that_never_closes_is_no_penetration() -> None:
    apart = HISTORY.assign(gap=HISTORY["gap"] * 0 + 1e-4)
    assert key_numbers(apart)["penetration_max_m"] == 0.0


def test_without_body_and_contact_their_numbers_are_none() -> None:
    bare = HISTORY.drop_dims(["counterface", "contact_node"])
    numbers = key_numbers(bare)
    assert numbers["records"] == 401
    of_contact = [name for name in numbers if name.endswith(("_N", "_m", "_m2", "_Pa", "slide"))]
    assert len(of_contact) == 9
    assert all(numbers[name] is None for name in of_contact)


def test_numbers_of_the_solution() -> None:
    iterations = np.zeros(HISTORY.sizes["time"], dtype=int)
    iterations[:3] = [4, 1, 5]
    imbalance = HISTORY["energy_imbalance"] * 0
    imbalance[5] = -3e-8
    history = HISTORY.assign(contact_iterations=("time", iterations), energy_imbalance=imbalance)
    numbers = key_numbers(history)
    assert (numbers["contact_iterations_max"], numbers["contact_iterations_mean"]) == (5, round(10 / 401, 2))
    assert numbers["energy_imbalance_over_work"] == pytest.approx(3e-8 / float(HISTORY["external_work"].max()))
    at_rest = history.assign(external_work=HISTORY["external_work"] * 0)
    assert key_numbers(at_rest)["energy_imbalance_over_work"] is None
