"""One motion at large strain: its steps, halves where they are not solved, and what it says of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.finite.course import FiniteCourse
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.system.system import build_system
from fingerslip.errors import ConvergenceError
from fingerslip.linear.solver import preferred_solver
from fingerslip.model.programme import Ramp
from fingerslip.verification.meshes import box


def pulled(stretch: float, steps: int) -> fs.Model:
    """Return a square that is pulled to a stretch."""
    side = 1e-3
    motion = fs.SupportMotion((stretch * side - side, 0.0), Ramp((0.0, 1.0), (0.0, 1.0)))
    return fs.Model(
        mesh=box("Q4", np.linspace(0.0, side, 3), np.linspace(0.0, side, 3)),
        materials={"bulk": fs.NeoHookean(1e5, 0.3, 1000.0)},
        formulation="plane_strain",
        supports={"left": ("x", "y"), "right": ("x", "y")},
        support_motions={"right": motion},
        time=fs.QuasiStatic(step=1.0 / steps, end=1.0),
        kinematics="finite",
    )


def relaxing(model: fs.Model) -> fs.Model:
    """Return a model whose material relaxes."""
    law = fs.NeoHookean(1e5, 0.3, 1000.0, prony=(fs.PronyTerm(0.5, 0.6), fs.PronyTerm(0.2, 2.0)))
    return replace(model, materials={"bulk": law})


def course(model: fs.Model) -> FiniteCourse:
    return FiniteCourse(model, build_system(model), preferred_solver(), Stopwatch(), 0)


@pytest.mark.parametrize("relaxes", [False, True], ids=["elastic", "relaxing"])
def test_a_step_that_is_not_solved_is_halved_and_ends_where_small_steps_do(
    monkeypatch: pytest.MonkeyPatch, relaxes: bool
) -> None:
    """What a body remembers goes back with the step, even where this was computed before it was given up."""
    from fingerslip.dynamics.finite import course as module

    change = relaxing if relaxes else lambda model: model
    model, advance = change(pulled(2.0, 1)), module.advance_finite

    def too_long(factors, before, time, *others, **named):  # type: ignore[no-untyped-def]
        found = advance(factors, before, time, *others, **named)
        if time - before.time > 0.3:
            raise ConvergenceError(time, 0, 1.0, 1e-6, "take less")
        return found

    monkeypatch.setattr(module, "advance_finite", too_long)
    own = course(model)
    halved = own.advance(own.start(), 1.0)
    assert own.attributes["halved_steps"] == 3
    small = course(change(pulled(2.0, 4)))
    state = small.start()
    for time in (0.25, 0.5, 0.75, 1.0):
        state = small.advance(state, time)
    assert halved.time == state.time == 1.0
    np.testing.assert_allclose(halved.displacement, state.displacement, atol=1e-7 * np.abs(state.displacement).max())
    assert halved.energies.viscous == pytest.approx(state.energies.viscous, rel=1e-5)
    if relaxes:
        one, other = (own.large_body.deformed.history for own in (halved, state))
        scale = np.abs(other.point_dashpots).max()
        np.testing.assert_allclose(one.point_dashpots, other.point_dashpots, atol=1e-6 * scale)


def test_a_step_whose_smallest_parts_are_not_solved_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    from fingerslip.dynamics.finite import course as module

    def never(_, before, time, *__, **___):  # type: ignore[no-untyped-def]
        raise ConvergenceError(time, 7, 1.0, 1e-6, f"from {before.time}")

    monkeypatch.setattr(module, "advance_finite", never)
    own = course(pulled(2.0, 1))
    with pytest.raises(ConvergenceError, match=r"t = 0.015625 s, node 7"):
        own.advance(own.start(), 1.0)


def test_factors_serve_many_steps_and_are_counted() -> None:
    history = fs.simulate(pulled(1.3, 40))
    assert history.attrs["kinematics"] == "finite"
    assert 1 <= history.attrs["factorisations"] < 10
    assert history.attrs["newton_iterations"] >= 40
    assert history.attrs["halved_steps"] == 0
    assert {"seconds_bulk", "seconds_tangent", "cpu_seconds_bulk"} <= set(history.attrs)


def test_a_body_pressed_flat_raises_with_a_place() -> None:
    through = fs.SupportMotion((-2e-3, 0.0), Ramp((0.0, 1.0), (0.0, 1.0)))
    model = replace(pulled(2.0, 1), support_motions={"right": through})
    with pytest.raises(ConvergenceError, match="inside out") as caught:
        fs.simulate(model)
    assert "mm is turned inside out" in str(caught.value)
