"""Steps are solved on the contact nodes alone, and give what the full system gives."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.linear.solvers.superlu import SuperLU
from problems.blocks import ELEMENTS
from problems.matrices import EXACT, needs_mkl
from problems.pushed import pad, push_and_slide
from problems.verification.reference import full_motions, full_system
from unit.dynamics.models import contact, error_of

SOLVERS = [pytest.param(EXACT, marks=needs_mkl, id="pardiso"), pytest.param(SuperLU(), id="superlu")]


@pytest.mark.parametrize(
    "element", [pytest.param(element, marks=[pytest.mark.slow] * (element == "T6")) for element in ELEMENTS]
)
@pytest.mark.parametrize("solver", SOLVERS)
def test_condensed_solution_is_the_full_solution(element, solver):
    """Tolerance 1e-9 of the largest value of each field: rounding alone, amplified by 1/(beta h^2) in accelerations."""
    stiff = contact(normal_penalty=1e8, tangential_penalty=1e8, search_distance=1.0)
    record = fs.Recording(snapshots_every=1e-9)
    model = push_and_slide(element, damping=fs.RayleighDamping(2.0, 1e-4), contacts=stiff, record=record)
    history, full = fs.simulate(model, solver=solver), full_system(model)
    motions = full_motions(full, history.counterface_displacement.values[:, 0], history.time.values)
    np.testing.assert_array_equal(history.contact_node, full.nodes)
    forces = np.stack([history.tangential_traction[..., 0], history.normal_traction], axis=-1)
    found = {
        "displacement": history.snapshot_displacement.values,
        "velocity": history.snapshot_velocity.values,
        "acceleration": history.contact_acceleration.values,
        "forces": forces * history.contact_area.values[:, None],
    }
    for name, values in found.items():
        expected = np.array([getattr(motion, name) for motion in motions])
        expected = expected[:, full.dofs] if name == "acceleration" else expected.reshape(values.shape)
        error = np.abs(values - expected).max() / np.abs(expected).max()
        assert error <= 1e-9, f"{name}: {error:.1e}"
    states = history.contact_state.values
    assert {OPEN, STICK, SLIP} <= set(states.ravel().tolist()), "the run must see open, sticking and slipping nodes"
    assert (states[-1] != STICK).all(), "and end with overall slip"


TABLE = fs.RigidBody(1e-3, free=("y", "rz"), centre=(0.0, -2e-3), inertia=(1e-8,), springs=fs.Springs(y=5.0, rz=1e-3))


def curved(**changes):
    return contact(counterface=fs.Cylinder(20e-3, centre=(0.0, -20e-3)), **changes)


@pytest.mark.parametrize(
    "changes",
    [
        {"mesh": pad("Q4", columns=16)},
        {
            "contacts": curved(drive=fs.Drive(1e-3, 2e-4)),
            "programme": (fs.Hold(0.05), fs.Slide(0.2e-3, 4e-3)),
        },
        {
            "contacts": curved(rigid_body="table"),
            "bodies": {"table": dataclasses.replace(TABLE, loads=(fs.BodyLoad(y=0.01, rz=2e-5),))},
            "programme": (),
            "time": fs.TimeStepping(1e-3, end=0.1),
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
def test_the_next_step_corrects_what_factors_of_single_precision_miss():
    rough, exact = (fs.simulate(push_and_slide(), solver=solver) for solver in (None, SuperLU()))
    assert rough.attrs["condensation"].endswith("single precision")
    assert not exact.attrs["condensation"].endswith("single precision")
    for name, share in {"contact_displacement": 1e-6, "contact_acceleration": 1e-3, "counterface_force": 1e-5}.items():
        assert error_of(rough, exact, name) <= share, name
    assert rough.contact_residual.values.max() <= 1e-12, "the law of contact holds in double precision all the same"
    largest = float(exact["external_work"].max())
    assert float(np.abs(rough["energy_imbalance"]).max()) <= 1e-6 * largest


@needs_mkl
@pytest.mark.usefixtures("as_large")
def test_steps_without_inertia_have_exact_factors():
    history = fs.simulate(push_and_slide(time=fs.QuasiStatic(5e-3)))
    assert not history.attrs["condensation"].endswith("single precision")
