"""Meshes and static solutions that tests of elements, contact and dynamics share."""

from __future__ import annotations

import numpy as np
import skfem
from scipy import sparse
from scipy.sparse import linalg

from fingerslip.fe.forms import cell_constants, stiffness_matrix
from fingerslip.fe.space import build_space
from fingerslip.materials.elastic import Elastic

ELEMENTS = ("Q4", "T3", "T6")


def rectangle(element, xs, ys, *, shift=None, regions=None):
    """Return a meshed rectangle with the boundaries bottom, top, left and right.

    `shift` maps the vertices (2, n) to moved ones after the sides have been named; `regions` maps a name to
    a condition on the cells' centres, and without it all cells are the region `bulk`.
    """
    kind = skfem.MeshQuad1 if element == "Q4" else skfem.MeshTri1
    mesh = kind.init_tensor(np.asarray(xs, dtype=float), np.asarray(ys, dtype=float))
    x, y = mesh.p[:, mesh.facets].mean(axis=1)
    ends = {"left": (x, xs[0]), "right": (x, xs[-1]), "bottom": (y, ys[0]), "top": (y, ys[-1])}
    size = max(np.ptp(xs), np.ptp(ys))
    boundaries = {name: np.flatnonzero(np.abs(at - end) < 1e-9 * size) for name, (at, end) in ends.items()}
    centres = mesh.p[:, mesh.t].mean(axis=1)
    conditions = regions or {"bulk": lambda centre: np.full(centre.shape[1], True)}
    subdomains = {name: np.flatnonzero(inside(centres)) for name, inside in conditions.items()}
    points = mesh.p if shift is None else np.ascontiguousarray(shift(mesh.p))
    moved = kind(points, mesh.t)
    moved = skfem.MeshTri2.from_mesh(moved) if element == "T6" else moved
    return moved.with_subdomains(subdomains).with_boundaries(boundaries)


def jiggle(amount, seed=1):
    """Return a shift that moves the inner vertices of a rectangle by up to `amount` times the mean cell size."""

    def shift(points):
        low, high = points.min(axis=1, keepdims=True), points.max(axis=1, keepdims=True)
        inner = ((points > low + 1e-9) & (points < high - 1e-9)).all(axis=0)
        size = float(np.sqrt(np.prod(high - low) / points.shape[1]))
        noise = np.random.default_rng(seed).uniform(-amount * size, amount * size, points.shape)
        return points + noise * inner

    return shift


def distorted(element, count=4):
    """Return the unit square with randomly moved inner vertices."""
    grid = np.linspace(0.0, 1.0, count + 1)
    return rectangle(element, grid, grid, shift=jiggle(0.25))


def graded(fine_half_width, fine_size, outer, ratio):
    """Return coordinates that are uniform within the fine zone and grow geometrically from there to `outer`."""
    inner = np.linspace(0.0, fine_half_width, round(fine_half_width / fine_size) + 1)
    steps = fine_size * ratio ** np.arange(1, 200)
    reach = np.cumsum(steps)
    count = int(np.searchsorted(reach, outer - fine_half_width)) + 1
    tail = reach[:count] * (outer - fine_half_width) / reach[count - 1]
    return np.concatenate([inner, fine_half_width + tail])


def mirrored(coordinates):
    """Return coordinates from 0 on, mirrored to both sides."""
    return np.concatenate([-coordinates[:0:-1], coordinates])


def elastic(youngs_modulus=1e5, poisson_ratio=0.3, density=1000.0):
    return Elastic(youngs_modulus=youngs_modulus, poisson_ratio=poisson_ratio, density=density)


def stiffness_of(mesh, material, formulation="plane_strain", integration="selective", depth=1.0):
    """Return space, constants and stiffness of a mesh of one material in the region `bulk`."""
    space = build_space(mesh)
    constants = cell_constants(space, {"bulk": material}, formulation)
    return space, constants, stiffness_matrix(space, constants, depth, integration)


def solve_static(stiffness, load, fixed, prescribed=None):
    """Solve K u = f with u = `prescribed` (zero without it) at the degrees of freedom `fixed`."""
    count = stiffness.shape[0]
    displacement = np.zeros(count)
    if prescribed is not None:
        displacement[fixed] = prescribed[fixed]
    free = np.setdiff1d(np.arange(count), fixed)
    right = (load - stiffness @ displacement)[free]
    displacement[free] = linalg.spsolve(sparse.csc_matrix(stiffness[free][:, free]), right)
    return displacement


def fitted_slope(sizes, errors):
    """Return the slope of log(error) over log(size)."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])
