"""A step at large strain ends in equilibrium, or says where it did not."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.finite import newton
from fingerslip.dynamics.finite.newton import advance_finite
from fingerslip.dynamics.step.contact_step import solve_step
from fingerslip.verification.meshes import box
from unit.dynamics.finite.blocks import block, prepared

NONE = np.zeros((0, 2))


def test_a_step_ends_in_equilibrium():
    factors, state = prepared(block(0.2, steps=1))
    after, iterations = advance_finite(factors, state, 1.0, NONE, watch=factors.watch)
    moving = factors.system.unknowns.moving
    rest = np.delete(after.body.force, moving)
    assert np.linalg.norm(rest) < 1e-5 * np.linalg.norm(after.body.force)
    np.testing.assert_allclose(after.displacement[moving], -0.2)
    assert after.body.energy == pytest.approx(factors.system.require_body().energy(after.body))
    assert 1 < iterations < 20


def test_old_factors_give_the_same_step():
    """They only guide the iteration."""
    ends = []
    for renewed in (False, True):
        factors, state = prepared(block(0.3, steps=2))
        state, _ = advance_finite(factors, state, 0.5, NONE, watch=factors.watch)
        if renewed:
            factors.renew(state.body)
        ends.append(advance_finite(factors, state, 1.0, NONE, watch=factors.watch)[0].displacement)
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)


def test_a_step_that_would_turn_cells_inside_out_at_its_start_is_not_converged():
    """The top passes the first row of cells, which nothing has moved yet, so a caller can halve the step."""
    factors, state = prepared(block(0.9, steps=1))
    with pytest.raises(fs.ConvergenceError, match=r"turned inside out.*smaller time step") as caught:
        advance_finite(factors, state, 1.0, NONE, watch=factors.watch)
    assert caught.value.time == 1.0


def test_a_slender_beam_bends_far_in_one_step():
    """Its first iterate is stretched a thousand times as much as it bends."""
    length, modulus = 60.0, 1e6
    model = fs.Model(
        mesh=box("T6", np.linspace(0.0, length, 31), np.array([0.0, 1.0])),
        materials={"bulk": fs.NeoHookean(modulus, 0.0, 1.0)},
        formulation="plane_stress",
        supports={"left": ("x", "y")},
        tractions={"right": fs.Traction((0.0, -modulus / 12 / length**2), fs.Ramp((0.0, 1.0), (0.0, 1.0)))},
        kinematics="finite",
        time=fs.QuasiStatic(1.0, end=1.0),
        record=fs.Recording(sites=(fs.Site("tip", "", (length, 0.0)),)),
    )
    history = fs.simulate(model)
    assert history.attrs["halved_steps"] == 0
    assert history["displacement"].values[-1, 0, 1] / length == pytest.approx(-0.3017, abs=2e-3)


def dragged():
    """Return the model of a block that is pressed on a plate and dragged."""
    grid = np.linspace(0.0, 1.0, 4)
    return block(
        mesh=box("Q4", grid, grid),
        supports={"top": ("x", "y")},
        support_motions={},
        contacts=(fs.Contact("bottom", fs.Plane((0.0, 1.0)), fs.Coulomb(0.4)),),
        programme=(fs.Press(0.1, 0.1), fs.Slide(0.3, 0.1)),
        time=fs.QuasiStatic(0.1),
    )


def test_contact_obeys_its_law_at_the_end_of_every_step_though_iterations_begin_roughly(monkeypatch):
    goals = []

    def solved(*given, goal, **further):
        goals.append(goal)
        return solve_step(*given, goal=goal, **further)

    monkeypatch.setattr(newton, "solve_step", solved)
    history = fs.simulate(dragged())
    assert max(goals) == 1e-5
    assert min(goals) == 1e-8
    assert history["contact_residual"].values.max() <= 1e-8


def test_frictional_contact_is_solved_with_the_step():
    """A block pressed on a plate and dragged keeps Coulomb's law in every step."""
    history = fs.simulate(dragged())
    normal, tangential = history["normal_traction"].values, history["tangential_traction"].values
    assert (normal >= 0.0).all()
    assert (np.linalg.norm(tangential, axis=-1) <= 0.4 * normal * (1 + 1e-9) + 1e-12).all()
    force = history["counterface_force"].values[-1, 0]
    assert abs(force[0]) == pytest.approx(0.4 * abs(force[1]), rel=1e-6)
    assert np.abs(history["energy_imbalance"].values).max() < 1e-5 * history["external_work"].values[-1]
