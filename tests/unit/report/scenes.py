"""A history in 3D whose fields are known: a block of two layers pressed flat, pushed sideways."""

import functools

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import box


def block_history(element="T4"):
    """Return the history of a 10 mm block on a plate, skin below 3 mm and tissue above, which a test may change."""
    return _block_history(element).copy(deep=True)


@functools.cache
def _block_history(element):
    axes = (np.linspace(0.0, 10e-3, 5),) * (3 if element in {"T4", "T10", "H8"} else 2)
    layers = {"skin": lambda centre: centre[-1] < 3e-3, "tissue": lambda centre: centre[-1] >= 3e-3}
    mesh = box(element, *axes, regions=layers)
    dim = mesh.dim()
    up = (0.0,) * (dim - 1) + (1.0,)
    solid = dim == 3
    return fs.simulate(
        fs.Model(
            mesh=mesh,
            materials={name: fs.Elastic(youngs_modulus=50e3, poisson_ratio=0.3, density=1000.0) for name in layers},
            formulation="solid" if solid else "plane_strain",
            supports={"top": ("x", "y", "z")[:dim]},
            contacts=(fs.Contact("bottom", fs.Plane(normal=up), fs.Coulomb(0.5)),),
            programme=(
                fs.Press(0.5e-3, 10e-3),
                fs.Slide(distance=1e-3, speed=20e-3, direction=(1.0,) + (0.0,) * (dim - 1) if solid else None),
            ),
            time=fs.TimeStepping(10e-3),
            record=fs.Recording((fs.Site("deep", "FA-II", (5e-3,) * dim),), snapshots_every=50e-3),
        )
    )
