from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.solver import ContactSolution
from fingerslip.dynamics import step as step_module
from fingerslip.dynamics.simulate import step_times
from fingerslip.dynamics.step import Stopwatch, advance, build_stepper, first_state
from fingerslip.dynamics.system import build_system
from fingerslip.history import COORDINATES, VARIABLES
from problems.pushed import push_and_slide

SITES = (fs.Site("deep", "FA-II", (0.0, 2e-3)), fs.Site("low", "SA-I", (1e-3, 0.0), "bulk"))


@pytest.fixture(scope="module")
def history():
    return fs.simulate(push_and_slide(sites=SITES, record=fs.Recording(SITES, snapshots_every=0.05)))


def test_every_variable_has_its_dimensions_units_and_name(history):
    assert set(history.data_vars) == set(VARIABLES)
    assert set(history.coords) == set(COORDINATES)
    for name, known in (COORDINATES | VARIABLES).items():
        assert history[name].dims == known.dims
        assert history[name].attrs == {"units": known.units, "long_name": known.long_name}


def test_nothing_is_infinite_or_missing(history):
    for name in VARIABLES:
        assert np.isfinite(history[name].values).all(), name


def test_labels_tell_what_was_recorded(history):
    assert history.site.values.tolist() == ["deep", "low"]
    assert history.site_kind.values.tolist() == ["FA-II", "SA-I"]
    assert history.site_region.values.tolist() == ["", "bulk"]
    assert history.phase_kind.values.tolist() == ["press", "hold", "slide"]
    np.testing.assert_allclose(history.phase_end.values, [0.1, 0.12, 0.22])
    assert history.body.values.tolist() == ["bottom"]
    np.testing.assert_array_equal(history.body_normal.values, [[0.0, 1.0]])
    assert history.body_friction_coefficient.values.tolist() == [0.4]


def test_the_plate_moves_as_the_programme_says(history):
    np.testing.assert_allclose(history.body_displacement.values[-1, 0], [0.8e-3, 0.4e-3])
    sliding = (history.time.values > 0.13) & (history.time.values < 0.21)
    np.testing.assert_allclose(history.body_velocity.values[sliding, 0], [[8e-3, 0.0]] * sliding.sum(), atol=1e-9)


def test_body_force_is_the_sum_of_the_tractions(history):
    area = history.contact_area
    normal = (history.normal_traction * area).sum("contact_node")
    friction = (history.tangential_traction * area).sum("contact_node")
    np.testing.assert_allclose(history.body_force.values[:, 0, 1], normal, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(history.body_force.values[:, 0, 0], friction, rtol=1e-12, atol=1e-18)
    assert normal[-1] > 0.0
    assert friction[-1] > 0.0, "a plate that moves along +x pulls the skin along +x"


def test_gap_follows_from_positions_and_is_penetration_over_penalty(history):
    height = history.contact_position[:, 1] + history.contact_displacement[:, :, 1]
    lowest = float(history.contact_position[:, 1].min())
    gap = (height - lowest - history.body_displacement[:, 0, 1]).transpose("time", "contact_node").values
    np.testing.assert_allclose(history.gap.values, gap, atol=1e-15)
    expected = np.maximum(-gap, 0.0) * history.attrs["normal_penalty"]
    np.testing.assert_allclose(history.normal_traction.values, expected, atol=1e-9 * expected.max())


def test_states_follow_from_tractions(history):
    pressure, friction = history.normal_traction.values, np.abs(history.tangential_traction.values)
    state = history.contact_state.values
    assert ((state == 0) == (pressure == 0.0)).all()
    np.testing.assert_allclose(friction[state == 2], 0.4 * pressure[state == 2], rtol=1e-8)
    assert (friction[state == 1] < 0.4 * pressure[state == 1]).all()


def test_snapshots_are_the_motion_at_their_times(history):
    np.testing.assert_allclose(history.snapshot_time.values, [0.0, 0.05, 0.1, 0.15, 0.2, 0.22])
    nodes = history.contact_node.values
    at = history.sel(time=0.15, method="nearest")
    np.testing.assert_array_equal(history.snapshot_displacement.values[3][nodes], at.contact_displacement.values)
    np.testing.assert_array_equal(history.snapshot_velocity.values[3][nodes], at.contact_velocity.values)
    depth, areas = 1e-3, 1e-6
    energy = float((history.snapshot_strain_energy_density.values[3]).mean()) * 32 * areas * depth
    assert energy == pytest.approx(float(at.strain_energy), rel=0.2), "cells' centres against the full integral"


def test_without_snapshots_there_are_no_such_variables():
    plain = fs.simulate(push_and_slide(programme=(fs.Press(0.1e-3, 4e-3),)))
    assert not [name for name in plain.data_vars if name.startswith("snapshot")]


def test_provenance_says_solver_sizes_and_seconds(history):
    attrs = history.attrs
    assert attrs["linear_solver"] in {"MKL PARDISO", "SuperLU"}
    assert attrs["n_nodes"] == 45
    assert attrs["n_degrees_of_freedom"] == 2 * 45 - 18
    assert attrs["n_contact_candidates"] == history.sizes["contact_node"]
    parts = [attrs[f"seconds_{name}"] for name in ("substitution", "contact", "recording")]
    assert min(parts) > 0.0
    assert sum(parts) <= attrs["seconds_stepping"]


def test_progress_is_told_after_every_step():
    told = []
    fs.simulate(push_and_slide(programme=(fs.Press(0.02e-3, 1e-3),)), progress=told.append)
    np.testing.assert_allclose(told, [0.25, 0.5, 0.75, 1.0])


def test_the_same_model_gives_the_same_history_bit_by_bit(history):
    again = fs.simulate(push_and_slide(record=fs.Recording(SITES, snapshots_every=0.05)))
    for name in VARIABLES:
        np.testing.assert_array_equal(history[name].values, again[name].values, err_msg=name)


def test_steps_are_whole_and_end_where_the_programme_ends():
    times = step_times(push_and_slide())
    np.testing.assert_allclose(times, 5e-3 * np.arange(45))
    assert step_times(push_and_slide(time=fs.TimeStepping(5e-3, end=0.05)))[-1] == pytest.approx(0.05)


def test_a_programme_that_ends_between_two_steps_is_run_to_its_end():
    assert step_times(push_and_slide(step=0.03))[-1] == pytest.approx(0.24)


def test_a_step_longer_than_the_run_is_refused():
    with pytest.raises(fs.InputError, match=r"time.step: got 1 s for a run of 0.22 s, needs at least one step"):
        fs.simulate(push_and_slide(step=1.0))


def test_unsolved_contact_is_an_error_that_says_when_where_and_how_badly(monkeypatch):
    calls = []

    def broken(compliance, free, friction, start, tolerance):
        calls.append(None)
        bad = 0.25 if len(calls) == 3 else 0.0
        return ContactSolution(np.zeros_like(free), bad, 7, 2)

    monkeypatch.setattr(step_module, "solve_friction", broken)
    model = push_and_slide()
    with pytest.raises(fs.ConvergenceError) as caught:
        fs.simulate(model)
    error = caught.value
    assert error.time == pytest.approx(3 * 5e-3)
    assert error.node == build_system(model).candidates.nodes[2]
    assert error.residual == 0.25
    assert f"t = 0.015 s, node {error.node}: residual 2.50e-01, needs <= 1e-10; try a smaller time step" in str(error)


def test_a_residual_that_is_no_number_is_an_error_too(monkeypatch):
    def broken(compliance, free, friction, start, tolerance):
        return ContactSolution(np.full_like(free, np.nan), np.nan, 7, 0)

    monkeypatch.setattr(step_module, "solve_friction", broken)
    with pytest.raises(fs.ConvergenceError):
        fs.simulate(push_and_slide())


def test_contact_outside_the_candidates_is_refused():
    contacts = (fs.Contact(boundary="bottom", friction=fs.Coulomb(0.4), reach=1e-6),)
    with pytest.raises(fs.SlipOutsideContactError, match=r"reached the plate .* write a larger contact reach"):
        fs.simulate(push_and_slide(contacts=contacts))


def test_a_step_leaves_the_state_before_as_it_was():
    model = push_and_slide(damping=fs.RayleighDamping(1.0, 1e-4))
    system = build_system(model)
    stepper = build_stepper(system, model.time, model.damping)
    state = first_state(stepper)
    for number in range(1, 4):
        arrays = {name: value.copy() for name, value in vars(state).items() if isinstance(value, np.ndarray)}
        forces = state.interface.forces.copy()
        bodies = system.motions[0].displacement(np.array([number * 5e-3]))
        after = advance(stepper, state, number * 5e-3, bodies, Stopwatch())
        for name, value in arrays.items():
            np.testing.assert_array_equal(getattr(state, name), value, err_msg=name)
        np.testing.assert_array_equal(state.interface.forces, forces)
        state = after


def test_the_first_acceleration_is_that_of_the_loads():
    """A free block under traction falls as a rigid body: a = t A / m everywhere at the start."""
    model = push_and_slide(
        supports={}, contacts=(), programme=(), tractions={"left": (7.0, 0.0), "right": (7.0, 0.0)},
        time=fs.TimeStepping(1e-4, end=1e-3),
    )  # fmt: skip
    system = build_system(model)
    state = first_state(build_stepper(system, model.time, model.damping))
    total = system.mass @ state.acceleration
    np.testing.assert_allclose(total.reshape(-1, 2).sum(axis=0), system.load.reshape(-1, 2).sum(axis=0), atol=1e-15)
    assert state.acceleration.any()
