"""A block at large strain whose top moves as prescribed, and what computes its steps."""

from __future__ import annotations

import numpy as np

import fingerslip as fs
from fingerslip.dynamics.finite.factors import Factors
from fingerslip.dynamics.step.state import first_state
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.system.scheme import make_scheme
from fingerslip.dynamics.system.system import build_system
from fingerslip.linear.solver import preferred_solver
from fingerslip.verification.meshes import box


def block(down=0.1, *, steps=4, element="Q4", time=None, **changes):
    """Return the model of a unit square whose top is pressed down, clamped, within a second."""
    grid = np.linspace(0.0, 1.0, 4)
    given = {
        "mesh": box(element, grid, grid),
        "materials": {"bulk": fs.NeoHookean(1e4, 0.4, 1000.0)},
        "formulation": "plane_strain",
        "supports": {"bottom": ("x", "y"), "top": ("x", "y")},
        "support_motions": {"top": fs.SupportMotion((0.0, -down), fs.Ramp((0.0, 1.0), (0.0, 1.0)))},
        "kinematics": "finite",
        "time": time or fs.QuasiStatic(1.0 / steps, end=1.0),
    }
    return fs.Model(**(given | changes))


def prepared(model, solver=None):
    """Return the factors of a model and its first state."""
    system = build_system(model)
    factors = Factors(system, make_scheme(model.time), model.damping, solver or preferred_solver(), Stopwatch())
    stepper = factors.renew(system.require_body().at(np.zeros(system.mass.shape[0])))
    return factors, first_state(stepper)
