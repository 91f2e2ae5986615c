"""Element technology near incompressibility: the error of every kind of element over its degrees of freedom.

A quarter of a thick ring under inner pressure, in plane strain or as a slice in 3D between two planes of symmetry.
Quadratic cells are curved, so that no error of geometry hides theirs.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import skfem
from scipy import sparse
from skfem.helpers import dot

from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import stiffness_matrix
from fingerslip.fe.integration import Integration
from fingerslip.fe.space import boundary_nodes, build_space, vector_dofs
from fingerslip.linear.solver import preferred_solver
from fingerslip.materials.elastic import Elastic
from fingerslip.tables.table import Column, Table
from fingerslip.verification.meshes import box, dimension, formulation_of, ring
from fingerslip.verification.problem import Problem, absolute

RATIOS = (0.48, 0.4999)
_INNER, _OUTER, _PRESSURE, _MODULUS, _THICKNESS = 1.0, 2.0, 1e-3, 1.0, 0.5


@dataclass(frozen=True)
class Kind:
    """A kind of element and how it is integrated."""

    element: str  # as :func:`fingerslip.verification.meshes.box` takes it
    integration: Integration  # as a model takes it
    cells: tuple[int, ...]  # cells through the wall, level by level

    @property
    def name(self):
        """Name for tables and figures."""
        return self.element if self.element in {"T6", "T10"} else f"{self.element} {self.integration}"

    @property
    def dim(self):
        """Number of dimensions."""
        return dimension(self.element)

    @property
    def locks(self):
        """Whether a linear element has nothing against locking."""
        return self.integration == "full" and self.element not in {"T6", "T10"}


KINDS = (
    Kind("Q4", "selective", (4, 8, 16, 32)),
    Kind("Q4", "full", (4, 8, 16, 32)),
    Kind("T3", "full", (4, 8, 16, 32)),
    Kind("T3", "nodal", (4, 8, 16, 32)),
    Kind("T6", "full", (2, 4, 8, 16)),
    Kind("H8", "selective", (2, 4, 8, 16)),
    Kind("H8", "full", (2, 4, 8, 16)),
    Kind("T4", "full", (2, 4, 8, 16)),
    Kind("T4", "nodal", (2, 4, 8, 16)),
    Kind("T10", "full", (1, 2, 4, 8)),
)


@dataclass(frozen=True)
class Level:
    """The error on one mesh."""

    unknowns: int  # free degrees of freedom
    error: float  # error of the displacement in L2 over the displacement [-]


def _mesh(kind, cells):
    """Return the ring, whose inner side is `left`; mid-side nodes lie on it too."""
    axes = [np.linspace(_INNER, _OUTER, cells + 1), np.linspace(0.0, np.pi / 2, 2 * cells + 1)]
    thick = np.linspace(0.0, _THICKNESS, max(1, cells // 2) + 1)
    mesh = box(kind.element, *axes, *([thick] if kind.dim == 3 else []))
    return replace(mesh, doflocs=np.ascontiguousarray(ring(mesh.doflocs)))


def _held(space):
    """Return the degrees of freedom that the planes of symmetry hold."""
    sides = {"bottom": 1, "top": 0} if space.dim == 2 else {"front": 1, "back": 0, "bottom": 2, "top": 2}
    held = [vector_dofs(boundary_nodes(space, side), space.dim)[:, axis] for side, axis in sides.items()]
    return np.unique(np.concatenate(held))


def _exact(x, ratio):
    """Return Lame's displacement at points (dim, ...)."""
    radius = np.hypot(x[0], x[1])
    factor = (1 + ratio) * _PRESSURE * _INNER**2 / (_MODULUS * (_OUTER**2 - _INNER**2))
    radial = factor * ((1 - 2 * ratio) * radius + _OUTER**2 / radius)
    return np.stack([radial * x[0] / radius, radial * x[1] / radius, *([0.0 * radial] * (len(x) - 2))])


def _level(kind, ratio, cells):
    mesh = _mesh(kind, cells)
    space = build_space(mesh)
    materials = cell_materials(space, {"bulk": Elastic(_MODULUS, ratio, 1.0)}, formulation_of(kind.element))
    stiffness = stiffness_matrix(space, materials, 1.0, kind.integration)
    vector = skfem.ElementVector(space.scalar_element)
    side = skfem.FacetBasis(mesh, vector, facets=mesh.boundaries["left"], intorder=5)
    load = skfem.LinearForm(lambda v, w: -_PRESSURE * dot(w.n, v)).assemble(side)
    free = np.setdiff1d(np.arange(space.n_dofs), _held(space))
    factor = preferred_solver().factorise(sparse.csr_matrix(stiffness[free][:, free]))
    displacement = np.zeros(space.n_dofs)
    displacement[free] = factor.backward(factor.forward(load[free]))
    fine = skfem.Basis(mesh, vector, intorder=6)
    found = fine.interpolate(displacement)
    square = skfem.Functional(lambda w: dot(found - _exact(w.x, ratio), found - _exact(w.x, ratio))).assemble(fine)
    size = skfem.Functional(lambda w: dot(_exact(w.x, ratio), _exact(w.x, ratio))).assemble(fine)
    return Level(free.size, float(np.sqrt(square / size)))


@cache
def levels(kind, ratio):
    """Return the errors of a kind of element at a Poisson's ratio, coarse to fine."""
    return tuple(_level(kind, ratio, cells) for cells in kind.cells)


def order(kind, ratio):
    """Return the order of convergence over the last two meshes: the power of the cell size."""
    (_, coarse), (_, fine) = ((level.unknowns, level.error) for level in levels(kind, ratio)[-2:])
    return float(np.log2(coarse / fine))


def error_table():
    """Show all errors, a row for each kind of element and Poisson's ratio."""
    columns = tuple(map(Column, ("element", "nu", "coarsest mesh", "second", "third", "finest", "order")))
    rows = tuple(
        (
            kind.name,
            f"{ratio}",
            *(f"{level.error:.1e} ({level.unknowns})" for level in levels(kind, ratio)),
            f"{order(kind, ratio):.1f}",
        )
        for kind in KINDS
        for ratio in RATIOS
    )
    return Table("Locking", columns, rows, "Error of the displacement in L2 over the displacement (unknowns).")


def _checks(dim):
    """On the finest mesh an element that does not lock errs by less than 1 %, one that locks by more than 10 %.

    Linear elements have order 2 in L2, and quadratic ones lose one of their three near incompressibility (Babuska &
    Suri 1992); 0.2 is what is left of the way to the asymptotic order.
    """
    for kind in (kind for kind in KINDS if kind.dim == dim):
        last = {ratio: levels(kind, ratio)[-1] for ratio in RATIOS}
        at = f"{last[0.4999].unknowns} unknowns"
        if kind.locks:
            name = f"{kind.name}: locks, error at {at}, nu = 0.4999 (0.1 to 1)"
            yield absolute(name, 0.55, last[0.4999].error, 0.45)
            continue
        for ratio in RATIOS:
            yield absolute(f"{kind.name}: error at {at}, nu = {ratio}", 0.0, last[ratio].error, 0.01)
        short = max(0.0, 2.0 - order(kind, 0.4999))
        yield absolute(f"{kind.name}: what the order falls short of 2, nu = 0.4999", 0.0, short, 0.2)


_SOURCE = "Lame 1852; Babuska & Suri 1992"
PROBLEMS = (
    Problem("element-errors-2d", "Errors of a pressed ring over unknowns", _SOURCE, _checks, {"": (2,)}),
    Problem("element-errors-3d", "The same for a slice in 3D", _SOURCE, _checks, {"": (3,)}, slow=True),
)
