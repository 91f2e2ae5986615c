"""Steps of a reduced body in compiled code: those of the mesh, steered, saved, and handed over where they fail."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.dynamics.compact import integrator
from fingerslip.verification.reduced import ABILITIES, block
from unit.dynamics.models import Memory, assert_same_history, contact, solved_by_steps

# What is compared with the mesh, over the largest value of each.
COMPARED = (
    *("contact_displacement", "normal_traction", "tangential_traction", "slip_distance", "counterface_force"),
    *("counterface_displacement", "support_force", "strain_energy", "friction_dissipation", "external_work"),
)


def a_model(law: Any | None = None, **changes: object) -> fs.Model:
    """Return the block of `fingerslip verify`, in 48 steps."""
    coarse = {"contacts": contact(counterface=fs.Plane((0.0, 1.0)), friction=law or fs.Coulomb(0.4))}
    return block({**coarse, "time": fs.TimeStepping(5e-3), **changes})


def assert_same(history: xr.Dataset, expected: xr.Dataset, share: float) -> None:
    assert_same_history(history[[*COMPARED]], expected[[*COMPARED]], share)


STEPPED = {
    "coulomb": {},
    "static and kinetic": {"law": fs.StaticKinetic(0.5, 0.3, decay_speed=2e-3)},
    "weakening": {"law": fs.SlipWeakening(0.6, 0.3, distance=50e-6)},
    "moving supports": ABILITIES["moving supports"],
}


@pytest.mark.parametrize("changes", ABILITIES.values(), ids=ABILITIES)
def test_compiled_code_takes_the_steps_that_verify_holds_beside_the_mesh(
    changes: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []
    advance = integrator.Compact.advance
    monkeypatch.setattr(integrator.Compact, "advance", lambda *step: calls.append(1) or advance(*step))
    with fs.Simulation(block(changes)) as sim:
        sim.step()
    assert calls


def test_the_log_says_why_compiled_code_takes_no_steps(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    rod = contact(counterface=fs.Cylinder(20e-3, (0.0, 1.0)))
    history = fs.simulate(a_model(contacts=rod, programme=(fs.Press(0.05e-3, 5e-3),)))
    assert history.attrs["basis"] == "reduced"
    assert "no compiled steps in a basis: a counterface is curved or turns" in caplog.text


@pytest.mark.parametrize("changes", STEPPED.values(), ids=STEPPED)
def test_steps_from_outside_are_those_of_a_simulation_and_of_a_restored_one(changes: Any, tmp_path: Path) -> None:
    model, bases = a_model(**changes), Memory()
    expected = fs.simulate(model, bases=bases)
    with fs.Simulation(model, bases=bases) as sim:
        for _ in range(30):
            observed = sim.step()["contact_state"]
        sim.save(tmp_path / "saved")
        while not sim.is_finished:
            sim.step()
        history = sim.history()
    with fs.Simulation.restore(tmp_path / "saved", model, bases=bases) as sim:
        np.testing.assert_array_equal(sim.observation["contact_state"], observed)
        while not sim.is_finished:
            sim.step()
        restored = sim.history()
    assert_same(restored, history, 0.0)
    assert_same(history, expected, 1e-11)
    assert restored.attrs["basis_error"] == history.attrs["basis_error"]


def test_commands_steer_a_basis_as_they_steer_the_mesh() -> None:
    """The plate is pressed by a force, which a command doubles, and stopped on the way; then the support moves on."""
    driven = contact(counterface=fs.Plane((0.0, 1.0)), drive=fs.Drive(force=0.1, mass=0.05))
    programme = fs.Hold(20e-3), fs.Slide(0.4e-3, 5e-3, (1.0, 0.0))
    still = {"top": fs.SupportMotion((1e-3, 0.0), fs.Ramp((0.0, 1.0), (0.0, 0.0)))}
    model = a_model(contacts=driven, programme=programme, support_motions=still)
    forces = []
    for basis in (model.basis, None):
        with fs.Simulation(replace(model, basis=basis)) as sim:
            for _ in range(8):
                sim.step()
            sim.step([fs.Command("bottom", force=(0.2,)), fs.Command("bottom", velocity=(2e-3, 0.0))])
            sim.step(fs.Command("top", velocity=(-1e-3, 0.0)))
            while not sim.is_finished:
                sim.step()
            forces.append(sim.history()["counterface_force"].values)
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-9 * np.abs(forces[1]).max())
    assert np.abs(forces[0]).max() > 0.0


def test_contact_that_is_not_solved_in_partitions_is_solved_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no solver does, the error names a node."""
    expected, take_steps, tried = fs.simulate(a_model()), integrator.take_steps, []

    def stumbling(body: Any, *others: Any) -> int:
        """Solve the first problem of some steps only where its solution is known already."""
        if len(tried) < 20:
            tried.append(len(others[-2]))
            body = body._replace(tolerance=1e-10 if tried[-1] else -1.0)
        return take_steps(body, *others)

    monkeypatch.setattr(integrator, "take_steps", stumbling)
    assert_same(fs.simulate(a_model()), expected, 1e-9)
    assert {0, 1} <= set(tried)

    def stuck(body: Any, *others: Any) -> int:
        """Solve no problem, whatever is known of it, and leave half of the forces."""
        take_steps(body._replace(tolerance=-1.0), *others)
        others[-1].residuals[0] = 0.5
        return 0

    with monkeypatch.context() as patch, fs.Simulation(a_model()) as sim:
        patch.setattr(integrator, "take_steps", stuck)
        with pytest.raises(fs.ConvergenceError, match=r"residual 5.00e-01"):
            sim.step()
    monkeypatch.setattr(integrator, "TOLERANCE", -1.0)
    with fs.Simulation(a_model()) as sim, pytest.raises(fs.ConvergenceError, match=r"contact at t = 0.005 s, node"):
        sim.step()


DISC = {"contacts": contact(counterface=fs.Cylinder(20e-3, (0.0, 1.0)), rigid_body="table")}
WALL = fs.Contact("left", fs.Plane((1.0, 0.0)), fs.Coulomb(0.2), programme=(fs.Hold(0.2),))
UNTAKEN = {
    "curved": {"contacts": contact(counterface=fs.Cylinder(20e-3))},
    "curved, with both": {**ABILITIES["moving supports"], **ABILITIES["rigid body with a damper"], **DISC},
    "touching with a moving support": {**ABILITIES["moving supports"], "contacts": (*contact(), WALL)},
}


@pytest.mark.parametrize("changes", UNTAKEN.values(), ids=UNTAKEN)
def test_what_compiled_code_does_not_take_is_stepped_in_the_basis_all_the_same(changes: Any) -> None:
    model = a_model(**changes)
    history = solved_by_steps(model)
    assert history.attrs["basis"] == "reduced"
    assert_same(history, fs.simulate(replace(model, basis=None)), 2e-5)
