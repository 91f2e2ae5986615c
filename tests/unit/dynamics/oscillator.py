"""One shear cell under a sudden traction: an oscillator of one degree of freedom, frequency 1 rad/s."""

from __future__ import annotations

import fingerslip as fs
from fingerslip.verification.meshes import box

# Shear modulus 1, so k = G A / H = 1; the consistent mass of a linear shear profile is rho V / 3 = 1.
FREQUENCY, STATIC = 1.0, 0.1


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
