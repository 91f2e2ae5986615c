"""Models that benchmarks share: of studies, the section of the paper, the fingertip in 3D, and a stand-in for it.

The stand-in is a half-ellipsoid of any number of nodes, pressed and slid on a plate.
"""

import contextlib
from pathlib import Path

import numpy as np
import skfem

STUDIES = Path(__file__).parents[2] / "studies"
PRESS_DEPTH, PRESS_SPEED, SLIDE_SPEED = 2e-3, 4e-3, 5e-3
_HALF_WIDTH, _HALF_LENGTH, _HEIGHT = 8e-3, 10e-3, 8e-3


def pad_mesh(nodes):
    """Return linear tetrahedra with about `nodes` nodes, finer below; boundaries `skin` and `top`.

    The block of 16 by 20 by 8 mm is bulged below to an ellipsoid, held at its flat upper side.
    """
    per_length = (nodes / (8 * _HALF_WIDTH * _HALF_LENGTH * _HEIGHT / 2)) ** (1 / 3)
    counts = [round(length * per_length) + 1 for length in (2 * _HALF_WIDTH, 2 * _HALF_LENGTH, _HEIGHT)]
    x, y = np.linspace(-_HALF_WIDTH, _HALF_WIDTH, counts[0]), np.linspace(-_HALF_LENGTH, _HALF_LENGTH, counts[1])
    height = np.linspace(0.0, 1.0, counts[2])
    block = skfem.MeshTet.init_tensor(x, y, 0.6 * height + 0.4 * height**2)
    outside = np.minimum((block.p[0] / 8.6e-3) ** 2 + (block.p[1] / 11.5e-3) ** 2, 0.96)
    points = np.vstack([block.p[:2], -_HEIGHT * np.sqrt(1.0 - outside) * (1.0 - block.p[2])])
    top = block.facets_satisfying(lambda p: p[2] > 1.0 - 1e-9, boundaries_only=True)
    skin = np.setdiff1d(block.boundary_facets(), block.facets_satisfying(lambda p: p[2] > 1e-9))
    mesh = skfem.MeshTet(points, block.t).with_boundaries({"top": top, "skin": skin})
    return mesh.with_subdomains({"pulp": np.arange(mesh.nelements)})


def finger_mesh(contact_size, bulk_size, contact_reach):
    """Return the fingertip of the preset `wang2014-3d` in linear tetrahedra, of given sizes [m]."""
    import fingerslip as fs

    finger = fs.preset("wang2014-3d")
    sizes = fs.SolidSizes("T4", contact_size, bulk_size, contact_reach)
    return sizes.build(finger)


def model(mesh, *, steps, direction=0.0, friction=0.6, integration="selective"):
    """Return the model: press by 2 mm in 100 steps of 5 ms, then slide at 5 mm/s in a direction [rad]."""
    import fingerslip as fs

    is_pad = "pulp" in mesh.subdomains
    along, across = np.cos(direction), np.sin(direction)
    duration = max(5e-3 * steps - PRESS_DEPTH / PRESS_SPEED, 5e-3)
    towards = (along, across, 0.0) if is_pad else (along, 0.0, across)
    slide = fs.Slide(duration * SLIDE_SPEED, SLIDE_SPEED, towards)
    return fs.Model(
        mesh=mesh,
        materials={"pulp": fs.Elastic(34e3, 0.48, 1000.0)} if is_pad else fs.preset("wang2014-3d").materials,
        formulation="solid",
        integration=integration,
        supports={"top" if is_pad else "phalanx_dorsal": ("x", "y", "z")},
        contacts=(fs.Contact("skin", fs.Plane((0.0, 0.0, 1.0) if is_pad else (0.0, 1.0, 0.0)), fs.Coulomb(friction)),),
        programme=(fs.Press(PRESS_DEPTH, PRESS_SPEED), slide),
        time=fs.TimeStepping(5e-3, -0.05 if is_pad else -0.41421, end=5e-3 * steps),
    )


class Memory:
    """A store of bases in memory, which costs nothing."""

    def __init__(self):
        self.stored = {}

    def load(self, key):
        return self.stored.get(key)

    def save(self, key, arrays):
        self.stored[key] = dict(arrays)

    def alone(self, _key):
        return contextlib.nullcontext()


def run_of(study, name=None):
    """Return a run of a shipped study by its name; the first without."""
    from fingerslip.study.definition.runs import read_runs

    return next(run for run in read_runs(STUDIES / f"{study}.yaml").runs if name in {None, run.name})


def model_of(study, name=None):
    """Return the model of a run, on the mesh."""
    from dataclasses import replace

    from fingerslip.study.running.build import build_mesh, build_model

    run = run_of(study, name)
    return replace(build_model(run, build_mesh(run)), basis=None)


def section(step=5e-3):
    """Return the push and slide of the paper's section on elements of 0.15 mm."""
    import fingerslip as fs

    finger = fs.preset("wang2014-2d")
    return fs.Model(
        mesh=fs.build_section(finger, contact_size=0.15e-3),
        materials=finger.materials,
        formulation=finger.formulation,
        depth=finger.depth,
        supports={"phalanx": ("x", "y")},
        contacts=(fs.Contact(boundary="skin", friction=fs.Coulomb(0.6)),),
        programme=(fs.Press(1.5e-3, 1.5e-3), fs.Slide(6e-3, 3e-3)),
        time=fs.TimeStepping(step),
        record=fs.Recording(sites=fs.receptor_sites(finger)),
    )
