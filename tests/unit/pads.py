"""Square pads of 10 mm that hold an object, for the tests of the loop."""

from __future__ import annotations

import numpy as np

from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.model.model import Contact, Model, ReducedBasis
from fingerslip.model.timing import TimeStepping
from fingerslip.verification.meshes import box


def pad(modulus: float = 200e3, cells: int = 10, dim: int = 2) -> Model:
    """Return a pad; in 3D it is as wide as it is long."""
    along, up = np.linspace(-5e-3, 5e-3, cells + 1), np.linspace(0.0, 4e-3, 5)
    mesh = box("Q4", along, up) if dim == 2 else box("H8", along, up, along)
    lower, upper = ("bottom", "top") if dim == 2 else ("front", "back")
    return Model(
        mesh=mesh,
        materials={"bulk": Elastic(modulus, 0.45, 1000.0)},
        supports={upper: ("x", "y") if dim == 2 else ("x", "y", "z")},
        formulation="plane_strain" if dim == 2 else "solid",
        contacts=(Contact(lower, search_distance=4e-3),),
        depth=10e-3 if dim == 2 else 1.0,
        damping=RayleighDamping(stiffness=2e-3),
        basis=ReducedBasis(acceleration_tolerance=0.1),
        time=TimeStepping(step=1e-3, end=1.0),
    )
