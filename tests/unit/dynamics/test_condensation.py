"""Steps are solved on the contact nodes alone, and give what the full system gives."""

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.linear.solvers.superlu import SuperLU
from problems.matrices import EXACT, needs_mkl
from problems.pushed import pad, push_and_slide
from problems.verification.condensed import compared
from unit.dynamics.models import contact, error_of

SOLVERS = [pytest.param(EXACT, marks=needs_mkl, id="pardiso"), pytest.param(SuperLU(), id="superlu")]


@pytest.mark.parametrize("element", ["Q4", *(pytest.param(other, marks=pytest.mark.slow) for other in ("T3", "T6"))])
@pytest.mark.parametrize("solver", SOLVERS)
def test_condensed_solution_is_the_full_solution(element, solver):
    """Which Newton's method finds on all degrees of freedom, to rounding: open, sticking and slipping nodes."""
    assert not [check for check in compared(element, "selective", solver) if not check.holds]


TABLE = fs.RigidBody(1e-3, free=("y", "rz"), centre=(0.0, -2e-3), inertia=(1e-8,), springs=fs.Springs(y=5.0, rz=1e-3))


def curved(**changes):
    return contact(counterface=fs.Cylinder(20e-3, centre=(0.0, -20e-3)), **changes)


@pytest.mark.parametrize(
    "changes",
    [
        {"mesh": pad("Q4", columns=16)},
        {"contacts": curved(drive=fs.Drive(1e-3, 2e-4)), "programme": (fs.Hold(0.05), fs.Slide(0.2e-3, 4e-3))},
        {
            "contacts": curved(rigid_body="table"),
            "bodies": {"table": dataclasses.replace(TABLE, loads=(fs.BodyLoad(y=0.01, rz=2e-5),))},
            "programme": (),
            "time": fs.TimeStepping(1e-3, end=0.05),
        },
    ],
    ids=["nodes that leave", "drive", "turning body"],
)
@needs_mkl
def test_halves_of_one_substitution_and_two_substitutions_move_in_the_same_way(changes):
    one, two = (fs.simulate(push_and_slide(**changes), solver=solver) for solver in (EXACT, SuperLU()))
    assert one.attrs["condensation"] != two.attrs["condensation"]
    assert one.contact_state.values.any()
    for name in ("contact_displacement", "contact_acceleration", "normal_traction", "tangential_traction"):
        assert error_of(two, one, name) <= 1e-8, name


@needs_mkl
@pytest.mark.usefixtures("as_large")
def test_the_next_step_corrects_what_factors_of_single_precision_miss_and_static_steps_have_exact_ones():
    rough, exact = (fs.simulate(push_and_slide(), solver=solver) for solver in (None, SuperLU()))
    assert rough.attrs["condensation"].endswith("single precision")
    static = fs.simulate(push_and_slide(time=fs.QuasiStatic(5e-3)))
    for other in (exact, static):
        assert not other.attrs["condensation"].endswith("single precision")
    for name, share in {"contact_displacement": 1e-6, "contact_acceleration": 1e-3, "counterface_force": 1e-5}.items():
        assert error_of(rough, exact, name) <= share, name
    assert rough.contact_residual.values.max() <= 1e-12, "the law of contact holds in double precision all the same"
    largest = float(exact["external_work"].max())
    assert float(np.abs(rough["energy_imbalance"]).max()) <= 1e-6 * largest
