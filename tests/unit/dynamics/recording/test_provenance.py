"""What histories say of how they were made."""

from __future__ import annotations

import logging

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.recording.provenance import labelled_history
from fingerslip.dynamics.step.stepper import Stopwatch, build_steppers
from fingerslip.dynamics.system.system import build_system
from fingerslip.verification.meshes import box


def made(  # type: ignore[no-untyped-def]
    dissipated: np.ndarray, time: object = fs.TimeStepping(0.1, end=0.2), name: str = "numerical_dissipation"
):
    """Return the history of a pulled block with some dissipation [J]."""
    model = fs.Model(
        mesh=box("Q4", np.linspace(0.0, 1.0, 2), np.linspace(0.0, 1.0, 2)),
        materials={"bulk": fs.Elastic(1.0, 0.3, 1.0)},
        formulation="plane_strain",
        supports={"top": ("x", "y")},
        tractions={"bottom": (0.0, 1.0)},
        time=time,
    )
    history = fs.simulate(model)
    complete = {name: history[name].values for name in history.variables}
    complete[name] = dissipated
    stepper = build_steppers([build_system(model)], model.time, model.damping)[0]
    return labelled_history(complete, stepper, {"basis": "full", "n_simulated_together": 1}, Stopwatch({"x": 1.0}))


def test_a_history_says_what_made_it() -> None:
    attributes = made(np.zeros(3)).attrs
    assert attributes["kinematics"] == "small"
    assert attributes["basis"] == "full"
    assert attributes["seconds_x"] == 1.0
    assert attributes["n_nodes"] == 4


@pytest.mark.parametrize("name", ["numerical_dissipation", "damping_dissipation"])
def test_steps_that_make_energy_are_warned_of(caplog: pytest.LogCaptureFixture, name: str) -> None:
    with caplog.at_level(logging.WARNING, logger="fingerslip.dynamics"):
        made(np.array([0.0, 0.01, 0.01]), name=name)
        assert not caplog.records
        made(np.array([0.0, 0.01, 0.005]), name=name)
    assert "time steps have made 0.005 J" in caplog.text
    assert caplog.messages[-1].endswith("take a smaller step"), "there is no contact, and the scheme is the best one"


@pytest.mark.parametrize("name", ["numerical_dissipation", "damping_dissipation"])
def test_steps_that_make_more_than_the_work_done_are_refused(name: str) -> None:
    with pytest.raises(
        fs.ConvergenceError, match=r"have made 1e\+03 J, more than the 0.0588 J put in.* take a smaller step"
    ):
        made(np.array([0.0, 0.01, -1000.0]), name=name)


def test_a_plate_that_never_touches_is_named(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, logger="fingerslip.dynamics"):
        fs.simulate(
            fs.Model(
                mesh=box("Q4", np.linspace(0.0, 1.0, 2), np.linspace(0.0, 1.0, 2)),
                materials={"bulk": fs.Elastic(1.0, 0.3, 1.0)},
                formulation="plane_strain",
                supports={"top": ("x", "y")},
                tractions={"bottom": (0.0, 0.1)},
                contacts=(fs.Contact("bottom", fs.Plane(normal=(0, 1), offset=-0.5)),),
                time=fs.QuasiStatic(0.1, end=0.2),
            )
        )
    assert "contacts.0: never touches 'bottom'; the smallest gap is 500 mm" in caplog.text


def test_errors_of_large_steps_without_inertia_are_no_energy_made(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, logger="fingerslip.dynamics"):
        made(np.array([0.0, 10.0, 5.0]), fs.QuasiStatic(0.1, end=0.2))
    assert not caplog.records
