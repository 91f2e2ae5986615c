"""Small models that several tests of this folder compute."""

from __future__ import annotations

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import box

# Of the oscillator: shear modulus 1, so k = G A / H = 1; the consistent mass of linear shear is rho V / 3 = 1.
FREQUENCY, STATIC = 1.0, 0.1
# What depends on how a solution was found.
ROUNDING = {"contact_iterations", "contact_residual", "energy_imbalance"}


def oscillator(step, alpha, end):
    """One shear cell under a sudden traction: its two upper nodes move along x as one degree of freedom."""
    return fs.Model(
        mesh=box("Q4", [0.0, 1.0], [0.0, 1.0]),
        materials={"bulk": fs.Elastic(2.0, 0.0, 3.0)},
        formulation="plane_stress",
        supports={"bulk": ("y",), "bottom": ("x",)},
        tractions={"top": (0.1, 0.0)},
        time=fs.TimeStepping(step, alpha, end),
        record=fs.Recording(sites=(fs.Site("top", "", (0.0, 1.0)),)),
    )


def block(down=0.1, *, steps=4, element="Q4", time=None, **changes):
    """Return a unit square at large strain whose top is pressed down, clamped, within a second."""
    grid = np.linspace(0.0, 1.0, 4)
    values = {
        "mesh": box(element, grid, grid),
        "materials": {"bulk": fs.NeoHookean(1e4, 0.4, 1000.0)},
        "formulation": "plane_strain",
        "supports": {"bottom": ("x", "y"), "top": ("x", "y")},
        "support_motions": {"top": fs.SupportMotion((0.0, -down), fs.Ramp((0.0, 1.0), (0.0, 1.0)))},
        "kinematics": "finite",
        "time": time or fs.QuasiStatic(1.0 / steps, end=1.0),
    }
    return fs.Model(**(values | changes))


def assert_same_history(found, expected, share=1e-8, names=None):
    """Compare what two histories record, each variable to a share of its largest value."""
    assert found.sizes == expected.sizes
    for name in names or sorted(set(expected.data_vars) - ROUNDING):
        values = expected[name].values
        scale = np.abs(values).max(initial=0.0)
        np.testing.assert_allclose(found[name].values, values, atol=share * scale + 1e-300, err_msg=name)


def error_of(found, expected, name):
    """Return the largest difference of a variable over its largest value."""
    values = expected[name].values
    return float(np.abs(found[name].values - values).max() / np.abs(values).max())
