"""Bodies at large strain that tests share, elastic and relaxing."""

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.fe.cell_materials import finite_cell_materials
from fingerslip.fe.finite.bulk import large_strain
from fingerslip.fe.space import build_space
from problems.blocks import KINDS, distorted

SOFT, STIFF = fs.NeoHookean(3.0, 0.45, 1.0), fs.MooneyRivlin(1.0, 1.0, 0.4, poisson_ratio=0.48)

POWERS = (fs.OgdenTerm(1.0, 1.3), fs.OgdenTerm(0.1, 5.0), fs.OgdenTerm(-0.2, -2.0))
LAWS = (SOFT, STIFF, fs.Ogden(POWERS, 1.0, poisson_ratio=0.4))

EVERY = pytest.mark.parametrize(("element", "integration", "formulation"), KINDS)
# Every kind with one of the laws: every law meets every formulation.
EVERY_PAIR = pytest.mark.parametrize(
    ("element", "integration", "formulation", "law"),
    [(*kind, LAWS[number % 3]) for number, kind in enumerate(KINDS)],
    ids=["-".join(kind) for kind in KINDS],
)
EVERY_LAW = pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
STEP = 0.05
TERMS = (fs.PronyTerm(0.3, 0.1), fs.PronyTerm(0.25, 0.4))
RELAXING = tuple(replace(law, prony=TERMS) for law in LAWS)
# A displacement gradient, of which 2D takes a part.
GRADIENT = np.array([[0.3, 0.2, 0.1], [-0.1, -0.2, 0.0], [0.1, 0.1, 0.1]])


def body(element, integration="selective", formulation="plane_strain", *, law=SOFT, beside=None, depth=1.0):
    """Return a body; with a law `beside`, this is that of the half at large x."""
    mesh = distorted(element, 2)
    middle = mesh.p[:, mesh.t].mean(axis=1)[0]
    far = middle > np.median(middle)
    mesh = mesh.with_subdomains({"near": np.flatnonzero(~far), "far": np.flatnonzero(far)})
    space = build_space(mesh)
    materials = finite_cell_materials(space, {"near": law, "far": beside or law}, formulation)
    return large_strain(space, materials, depth, integration)


def moved(bulk, amount, seed=0):
    """Return a random displacement (n_dofs,) of up to `amount` in the unit of the mesh."""
    return np.random.default_rng(seed).uniform(-amount, amount, bulk.space.n_dofs)


def stretched(bulk):
    """Return the gradient (dim, dim) of a uniform deformation, and its displacement (n_dofs,)."""
    gradient = GRADIENT[: bulk.space.dim, : bulk.space.dim]
    return gradient, (bulk.space.positions @ gradient.T).ravel()


def slopes(of, at, change):
    """Return the central difference of a function of the displacement along a small change."""
    return (of(at + change) - of(at - change)) / 2


def relaxing_body(kind, law=RELAXING[0], **others):
    """Return a body whose near half relaxes and whose far half is elastic."""
    return body(*kind, law=law, **({"beside": SOFT} | others))


def stepped(bulk, steps=3, amount=0.03, step=STEP):
    """Return a body after some random steps."""
    state = bulk.at_rest(step)
    for number in range(steps):
        begun = bulk.begun(state, step)
        state = bulk.ended(bulk.deformed(moved(bulk, amount, 10 + number), begun))
    return state
