"""Square pads of 10 mm that hold an object, for the tests of the loop."""

from __future__ import annotations

import numpy as np

from fingerslip.materials.elastic import Elastic
from fingerslip.react.scenario import Holder
from fingerslip.verification.meshes import box


def pad(modulus: float = 200e3, cells: int = 10) -> Holder:
    return Holder(
        mesh=box("Q4", np.linspace(-5e-3, 5e-3, cells + 1), np.linspace(0.0, 4e-3, 5)),
        materials={"bulk": Elastic(modulus, 0.45, 1000.0)},
        supports={"top": ("x", "y")},
        boundary="bottom",
        depth=10e-3,
    )
