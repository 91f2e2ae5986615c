"""Elements: patch test, rigid-body modes, convergence, and no locking near incompressibility."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import skfem
from scipy import sparse
from scipy.sparse import linalg
from skfem.helpers import ddot, dot, grad

from fingerslip.arrays import Floats
from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import stiffness_matrix
from fingerslip.fe.integration import Integration
from fingerslip.fe.space import boundary_nodes, build_space, vector_dofs
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.material import Formulation
from fingerslip.model.model import Component, Model, Recording
from fingerslip.model.timing import QuasiStatic
from fingerslip.verification.meshes import SIDES, axes_of, box, dimension, formulation_of, jiggle, ring, split_boundary
from fingerslip.verification.problem import Check, Problem, absolute, each, solve_problem

# Rounding of a small linear solution: condition number 1e3 to 1e4 times 1e-16, with a thousandfold reserve.
_ROUNDING = 1e-9
_MODULUS, _RATIO = 1.0e3, 0.3


def _kind(case: str) -> tuple[str, Any]:
    """Return the kind of cell of a case, and its integration where the case names another than the selective one."""
    element, _, integration = case.partition(" ")
    return element, integration or "selective"


def _distort(element: str) -> Any:
    return box(element, *[np.linspace(0.0, 1.0, 4)] * dimension(element), shift=jiggle(0.25))


def _static(
    mesh: Any, integration: Integration, supports: Mapping[str, tuple[Component, ...]], tractions: Mapping[str, Any]
) -> tuple[Floats, Floats]:
    """Return nodes' positions and displacements (n, dim) under loads, through a quasi-static step."""
    model = Model(
        mesh=mesh,
        materials={"bulk": Elastic(_MODULUS, _RATIO, 1.0)},
        formulation="plane_strain" if mesh.dim() == 2 else "solid",
        supports=supports,
        tractions=tractions,
        time=QuasiStatic(1.0, end=1.0),
        integration=integration,
        record=Recording(snapshots_every=1.0),
    )
    history = solve_problem(model)
    return history["node_position"].values, history["snapshot_displacement"].values[-1]


def _patch(case: str) -> Iterator[Check]:
    """Take the largest nodal error of uniform stress and of simple shear: both are in every element's space."""
    element, integration = _kind(case)
    mesh, dim, axes = _distort(element), dimension(element), axes_of(element)
    shear_modulus = _MODULUS / (2 * (1 + _RATIO))
    stress = np.array([3.0, -1.0, 2.0])[:dim]
    out_of_plane = _RATIO * stress.sum() if dim == 2 else 0.0
    strain = ((1 + _RATIO) * stress - _RATIO * (stress.sum() + out_of_plane)) / _MODULUS
    held = {low: (axis,) for (low, _), axis in zip(SIDES[dim], axes, strict=True)}
    pulled = {high: tuple(row) for (_, high), row in zip(SIDES[dim], np.diag(stress), strict=True)}
    positions, displacement = _static(mesh, integration, held, pulled)
    normal = np.abs(displacement - positions * strain).max() / np.abs(positions * strain).max()
    sheared = {"top": tuple(np.eye(dim)[0])}
    positions, displacement = _static(mesh, integration, {"bulk": axes[1:], "bottom": ("x",)}, sheared)
    shear = np.abs(displacement[:, 0] - positions[:, -1] / shear_modulus).max() * shear_modulus
    yield absolute("error / displacement", 0.0, float(max(normal, shear)), _ROUNDING)


def _rigid_modes(positions: Floats) -> Floats:
    """Return translations and infinitesimal rotations, (modes, n, dim)."""
    dim = positions.shape[1]
    turns = []
    for first in range(dim):
        for second in range(first + 1, dim):
            turn = np.zeros_like(positions)
            turn[:, first], turn[:, second] = -positions[:, second], positions[:, first]
            turns.append(turn)
    return np.stack([*(np.broadcast_to(axis, positions.shape) for axis in np.eye(dim)), *turns])


def _stiffness(
    mesh: Any, material: Elastic, integration: Integration, formulation: Formulation | None = None
) -> tuple[Any, Any, sparse.csr_matrix]:
    space = build_space(mesh)
    materials = cell_materials(space, {"bulk": material}, formulation or formulation_of(space.element))
    return space, materials, stiffness_matrix(space, materials, 1.0, integration)


def _rigid(case: str) -> Iterator[Check]:
    """Rigid motion strains nothing; the eigenvalue after the last rigid one is far above rounding."""
    element, integration = _kind(case)
    space, _, stiffness = _stiffness(_distort(element), Elastic(_MODULUS, _RATIO, 1.0), integration)
    modes = _rigid_modes(space.positions).reshape(-1, space.n_dofs)
    forces = np.abs(stiffness @ modes.T).max() / (np.abs(stiffness).max() * np.abs(modes).max())
    values = np.linalg.eigvalsh(stiffness.toarray())
    yield absolute("force of rigid motion", 0.0, float(forces), 1e-12)
    yield absolute("number of modes without energy", len(modes), int(np.sum(values < 1e-9 * values[-1])), 0.0)


def _exact(x: Floats) -> Floats:
    """Return the manufactured displacement: a bubble in the first, minus half of it in the second component."""
    wave = np.prod(np.sin(np.pi * x), axis=0)
    return np.stack([wave, -0.5 * wave, *([0.0 * wave] * (len(x) - 2))])


def _exact_gradient(x: Floats) -> Floats:
    sines, cosines = np.sin(np.pi * x), np.cos(np.pi * x)
    rows = [np.pi * np.prod([cosines[j] if j == i else sines[j] for j in range(len(x))], axis=0) for i in range(len(x))]
    slopes = np.stack(rows)
    return np.stack([slopes, -0.5 * slopes, *([0.0 * slopes] * (len(x) - 2))])


def _body_force(x: Floats, first_lame: float, shear_modulus: float) -> Floats:
    """Return -(G laplace u + (lambda + G) grad div u) of the manufactured displacement."""
    dim, sines, cosines = len(x), np.sin(np.pi * x), np.cos(np.pi * x)

    def second(i: int, j: int) -> Floats:
        """Return the second derivative of the bubble."""
        if i == j:
            return -(np.pi**2) * np.prod(sines, axis=0)  # type: ignore[no-any-return]
        factors = [cosines[k] if k in (i, j) else sines[k] for k in range(dim)]
        return np.pi**2 * np.prod(factors, axis=0)  # type: ignore[no-any-return]

    amplitudes = (1.0, -0.5, 0.0)[:dim]
    laplace = sum(second(i, i) for i in range(dim))
    rows = []
    for i in range(dim):
        mixed = sum(amplitudes[j] * second(i, j) for j in range(dim))
        rows.append(-(shear_modulus * amplitudes[i] * laplace + (first_lame + shear_modulus) * mixed))
    return np.stack(rows)


def _bent(points: Floats) -> Floats:
    """Bend the inside smoothly, so that no cell is regular."""
    bump = 0.08 * np.prod(np.sin(np.pi * points), axis=0)
    return np.asarray(points + bump * np.array([1.0, -0.7, 0.5])[: len(points), None])


def manufactured_errors(
    element: str, count: int, ratio: float = _RATIO, formulation: Formulation | None = None
) -> tuple[float, float]:
    """Return the errors of the manufactured solution in L2 and in the H1 seminorm, on `count` cells a side."""
    dim = dimension(element)
    mesh = box(element, *[np.linspace(0.0, 1.0, count + 1)] * dim, shift=_bent)
    material = Elastic(1.0, ratio, 1.0)
    space, materials, stiffness = _stiffness(mesh, material, "selective", formulation)
    lame, shear = material.dilatational_modulus(materials.formulation), material.shear_modulus
    fine = skfem.Basis(mesh, skfem.ElementVector(space.scalar_element), intorder=6)
    load = skfem.LinearForm(lambda v, w: dot(_body_force(w.x, lame, shear), v)).assemble(fine)
    edge = np.unique(np.concatenate([boundary_nodes(space, side) for side in mesh.boundaries]))
    free = np.setdiff1d(np.arange(space.n_dofs), vector_dofs(edge, dim).ravel())
    displacement = np.zeros(space.n_dofs)
    displacement[free] = linalg.spsolve(sparse.csc_matrix(stiffness[free][:, free]), load[free])
    field = fine.interpolate(displacement)

    def norm(of: Any) -> float:
        return float(np.sqrt(skfem.Functional(of).assemble(fine)))

    l2 = norm(lambda w: dot(field - _exact(w.x), field - _exact(w.x)))
    h1 = norm(lambda w: ddot(grad(field) - _exact_gradient(w.x), grad(field) - _exact_gradient(w.x)))
    return l2, h1


def _convergence(element: str, *counts: int) -> Iterator[Check]:
    """Fit the rates; 0.15 is what is left of the way to the asymptotic rate on meshes of this size."""
    degree = 2 if element in {"T6", "T10"} else 1
    errors = np.array([manufactured_errors(element, count) for count in counts])
    l2, h1 = np.log(errors[0] / errors[1]) / np.log(counts[1] / counts[0])
    yield absolute("rate in L2", degree + 1, float(l2), 0.15)
    yield absolute("rate in H1", degree, float(h1), 0.15)


_INNER, _OUTER, _PRESSURE = 1.0, 2.0, 1e-3


def ring_ratio(element: str, integration: Integration, ratio: float) -> float:
    """Return the mean radial displacement of a pressed quarter ring's inner side over Lame's."""
    axes = [np.linspace(_INNER, _OUTER, 9), np.linspace(0.0, np.pi / 2, 17), np.linspace(0.0, 0.25, 3)]
    dim = dimension(element)
    mesh, names, normals = split_boundary(box(element, *axes[:dim], shift=ring), "left")
    ends: dict[str, tuple[Component, ...]]
    ends = {"bottom": ("y",), "top": ("x",)} if dim == 2 else {"front": ("y",), "back": ("x",), "bulk": ("z",)}
    model = Model(
        mesh=mesh,
        materials={"bulk": Elastic(1.0, ratio, 1.0)},
        formulation=formulation_of(element),
        supports=ends,
        tractions={name: tuple(-_PRESSURE * normal) for name, normal in zip(names, normals, strict=True)},
        time=QuasiStatic(1.0, end=1.0),
        integration=integration,
        record=Recording(snapshots_every=1.0),
    )
    history = solve_problem(model)
    positions, displacement = history["node_position"].values[:, :2], history["snapshot_displacement"].values[-1, :, :2]
    radius = np.linalg.norm(positions, axis=1)
    inner = np.abs(radius - _INNER) < 1e-3
    radial = np.sum(displacement[inner] * positions[inner], axis=1) / radius[inner]
    factor = (1 + ratio) * _PRESSURE * _INNER**2 / (_OUTER**2 - _INNER**2)
    return float(np.mean(radial) / (factor * ((1 - 2 * ratio) * _INNER + _OUTER**2 / _INNER)))


def _locking(case: str) -> Iterator[Check]:
    """Two per cent is twice the error of interpolation on 8 cells through the wall, seen at nu = 0.3.

    A linear element that locks loses a quarter of the displacement or more at 0.4999: 0.4 with all of 0.4 allowed
    means anything up to 0.8.
    """
    if case.endswith("full"):
        yield absolute("locks, nu = 0.4999 (0 to 0.8)", 0.4, ring_ratio(*_kind(case), 0.4999), 0.4)
        return
    for ratio in (0.48, 0.4999):
        yield absolute(f"displacement / Lame, nu = {ratio}", 1.0, ring_ratio(*_kind(case), ratio), 0.02)


_EVERY = each("Q4", "T3", "T3 nodal", "T6", "H8", "T4", "T4 nodal", "T10")
_COUNTS_2D = {element: (element, 16, 32) for element in ("Q4", "T3", "T6")}
_COUNTS_3D = {"H8": ("H8", 8, 12), "T4": ("T4", 8, 12), "T10": ("T10", 4, 6)}
_RINGS_2D, _RINGS_3D = (
    each("Q4", "T6", "T3 nodal", "Q4 full", "T3 full"),
    each("H8", "T10", "T4 nodal", "H8 full", "T4 full"),
)
_LAME = "Lame 1852; Timoshenko & Goodier"
PROBLEMS = (
    Problem("patch", "Uniform stress on a distorted mesh", "Irons & Razzaque 1972", _patch, _EVERY),
    Problem("rigid-modes", "Rigid motion without force", "Kinematics", _rigid, _EVERY),
    Problem("convergence-2d", "Manufactured solution in 2D", "Ciarlet 1978", _convergence, _COUNTS_2D),
    Problem("convergence-3d", "Manufactured solution in 3D", "Ciarlet 1978", _convergence, _COUNTS_3D),
    Problem("locking-2d", "Pressed thick ring", _LAME, _locking, _RINGS_2D),
    Problem("locking-3d", "Slice of a pressed thick ring", _LAME, _locking, _RINGS_3D),
)
