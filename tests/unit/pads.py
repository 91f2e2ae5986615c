"""Square pads of 10 mm that hold an object, for the tests of the loop."""

from __future__ import annotations

import numpy as np

from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.model.model import Contact, Model, ReducedBasis
from fingerslip.model.timing import TimeStepping
from fingerslip.verification.meshes import box


def pad(modulus: float = 200e3, cells: int = 10) -> Model:
    return Model(
        mesh=box("Q4", np.linspace(-5e-3, 5e-3, cells + 1), np.linspace(0.0, 4e-3, 5)),
        materials={"bulk": Elastic(modulus, 0.45, 1000.0)},
        supports={"top": ("x", "y")},
        formulation="plane_strain",
        contacts=(Contact("bottom", search_distance=4e-3),),
        depth=10e-3,
        damping=RayleighDamping(stiffness=2e-3),
        basis=ReducedBasis(acceleration_tolerance=0.1),
        time=TimeStepping(step=1e-3, end=1.0),
    )
