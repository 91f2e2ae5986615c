"""Bodies at large strain that tests share, elastic and relaxing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fingerslip.fe.cell_materials import finite_cell_materials
from fingerslip.fe.finite.bulk import large_strain
from fingerslip.fe.space import build_space
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden, OgdenTerm
from fingerslip.materials.prony import PronyTerm
from problems.blocks import distorted

SOFT, STIFF = NeoHookean(3.0, 0.45, 1.0), MooneyRivlin(1.0, 1.0, 0.4, poisson_ratio=0.48)

POWERS = (OgdenTerm(1.0, 1.3), OgdenTerm(0.1, 5.0), OgdenTerm(-0.2, -2.0))
LAWS = (SOFT, STIFF, Ogden(POWERS, 1.0, poisson_ratio=0.4))

_IN_THE_PLANE = [("Q4", "selective"), ("Q4", "full"), ("T3", "full"), ("T3", "nodal"), ("T6", "full")]

_IN_SPACE = [("H8", "selective"), ("H8", "full"), ("T4", "full"), ("T4", "nodal"), ("T10", "full")]

KINDS = [
    *((*kind, formulation) for formulation in ("plane_strain", "plane_stress") for kind in _IN_THE_PLANE),
    *((*kind, "solid") for kind in _IN_SPACE),
]

EVERY = pytest.mark.parametrize(("element", "integration", "formulation"), KINDS)


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


TERMS = (PronyTerm(0.3, 0.1), PronyTerm(0.25, 0.4))

RELAXING = tuple(replace(law, prony=TERMS) for law in LAWS)

STEP = 0.05


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
