"""A cylinder pressed deep into a neo-Hookean block and dragged: a second program, written from the equations alone.

Run ``python tests/physics/independent_block.py 12 40``; problems.verification.dragged_cylinder keeps what it prints:
depth and travel [mm], and the force on the block along and across [N/m].

It takes nothing from fingerslip, and does the problem another way: quadrilaterals with nine nodes and full integration,
the stress P = G (F - F^-T) + lambda ln(J) F^-T and its linearisation in Cartesian components, contact and friction at
the quadrature points of the boundary, and Newton's method with the whole unsymmetric matrix in every iteration. It
shares with fingerslip the mesh library scikit-fem, the law, the penalties per reference area and Coulomb's return
mapping.
"""

import sys

import numpy as np
import skfem
from scipy.sparse.linalg import splu
from skfem.helpers import ddot, det, grad, inv, transpose

WIDTH, HEIGHT, RADIUS = 24e-3, 8e-3, 4e-3
SHEAR, RATIO = 10e3, 0.45
LAME = 2.0 * SHEAR * RATIO / (1.0 - 2.0 * RATIO)
PENALTY, FRICTION = 1e9, 0.3
DEPTH, TRAVEL = 2.5e-3, 3e-3


def mesh_of(cells):
    """Return the block, finer under the cylinder and towards it, `cells` along its half width and its height."""
    side = np.linspace(0.0, 1.0, cells + 1)
    half = 0.5 * WIDTH * (0.5 * side + 0.5 * side**3)
    up = HEIGHT * (1.0 - (1.0 - side) ** 1.3)
    return skfem.MeshQuad.init_tensor(np.concatenate([-half[:0:-1], half]), up)


def bulk_terms(basis, displacement):
    """Return the elastic forces and their derivative."""
    slope = basis.interpolate(displacement).grad
    gradient = slope + np.eye(2)[:, :, None, None]
    volume, turned = det(gradient), transpose(inv(gradient))
    if volume.min() <= 0.0:
        raise ValueError("a cell is turned inside out")
    stress = SHEAR * (gradient - turned) + LAME * np.log(volume) * turned
    scale = SHEAR - LAME * np.log(volume)

    def linearised(u, v, _):
        changed, tested = grad(u), grad(v)
        crossed = np.einsum("ik...,lk...,lj...->ij...", turned, changed, turned)
        return (
            SHEAR * ddot(changed, tested)
            + scale * ddot(crossed, tested)
            + LAME * ddot(turned, changed) * ddot(turned, tested)
        )

    force = skfem.LinearForm(lambda v, _: ddot(stress, grad(v))).assemble(basis)
    return force, skfem.BilinearForm(linearised).assemble(basis)


class Cylinder:
    """Contact and friction at the quadrature points of the boundary."""

    def __init__(self, basis):
        self.basis, self.places = basis, basis.global_coordinates().value
        self.before = np.zeros_like(self.places)
        self.slipped = np.zeros(self.places.shape[1:])
        self.centre_before = np.array([0.0, HEIGHT + RADIUS])

    def terms(self, displacement, centre):
        """Return the forces on the block, their derivative, and what the return mapping leaves."""
        moved = self.basis.interpolate(displacement).value
        apart = self.places + moved - centre[:, None, None]
        radius = np.sqrt((apart**2).sum(axis=0))
        normal = apart / radius
        along = np.stack([-normal[1], normal[0]])
        pressure = PENALTY * np.maximum(RADIUS - radius, 0.0)
        touching = pressure > 0.0
        travelled = moved - self.before - (centre - self.centre_before)[:, None, None]
        stretch = self.slipped + (travelled * along).sum(axis=0)
        trial = -PENALTY * stretch * touching
        slips = np.abs(trial) > FRICTION * pressure
        shear = np.where(slips, FRICTION * pressure * np.sign(trial), trial)
        turn = -(travelled * normal).sum(axis=0) / radius

        def linearised(u, v, _):
            inward, beside = (u * normal).sum(axis=0), (u * along).sum(axis=0)
            pressed = -PENALTY * inward * touching
            sticking = -PENALTY * (1.0 + turn) * beside * touching
            sheared = np.where(slips, FRICTION * np.sign(trial) * pressed, sticking)
            angle = beside / radius
            change = (pressed - shear * angle) * normal + (sheared + pressure * angle) * along
            return -(change * v).sum(axis=0)

        total = pressure * normal + shear * along
        force = skfem.LinearForm(lambda v, _: (total * v).sum(axis=0)).assemble(self.basis)
        matrix = skfem.BilinearForm(linearised).assemble(self.basis)
        return force, matrix, (moved, np.where(touching, -shear / PENALTY, 0.0), total)

    def settle(self, kept, centre):
        self.before, self.slipped, _ = kept
        self.centre_before = centre


def equilibrium(basis, cylinder, displacement, free, centre):
    """Return the displacement in equilibrium with a place of the cylinder, and what the contact keeps."""
    elastic, stiffness = bulk_terms(basis, displacement)
    pushed, contact, kept = cylinder.terms(displacement, centre)
    for _ in range(40):
        left = np.linalg.norm((pushed - elastic)[free])
        if left < 1e-9 * max(np.linalg.norm(elastic), 1e-6):
            return displacement, kept
        change = np.zeros_like(displacement)
        change[free] = splu((stiffness + contact)[free][:, free].tocsc()).solve((pushed - elastic)[free])
        # Half the change where the residual grows: else points that slip to and fro do so for ever.
        for length in (1.0, 0.5, 0.25, 0.12, 0.06, 0.03):
            trial = displacement + length * change
            try:
                elastic, stiffness = bulk_terms(basis, trial)
            except ValueError:
                continue
            pushed, contact, kept = cylinder.terms(trial, centre)
            if np.linalg.norm((pushed - elastic)[free]) < left:
                break
        displacement = trial
    raise RuntimeError(f"no equilibrium with the centre at {centre}")


def advance(basis, cylinder, displacement, free, centre, *, depth=0):
    """Move the cylinder on, in halves where there is no equilibrium; return displacement and what the contact keeps."""
    start = cylinder.centre_before
    try:
        displacement, kept = equilibrium(basis, cylinder, displacement, free, centre)
    except RuntimeError:
        if depth == 6:
            raise
        displacement, _ = advance(basis, cylinder, displacement, free, 0.5 * (start + centre), depth=depth + 1)
        return advance(basis, cylinder, displacement, free, centre, depth=depth + 1)
    cylinder.settle(kept, centre)
    return displacement, kept


def solve(cells, steps):
    """Yield the depth, the travel and the force on the block (2,) [N/m] of every step, pressed and then dragged."""
    mesh = mesh_of(cells)
    element = skfem.ElementVector(skfem.ElementQuad2())
    basis = skfem.Basis(mesh, element, intorder=4)
    top = skfem.FacetBasis(mesh, element, facets=mesh.facets_satisfying(lambda x: x[1] > HEIGHT - 1e-9), intorder=6)
    held = basis.get_dofs(lambda x: x[1] < 1e-9).all()
    free = basis.complement_dofs(held)
    cylinder, displacement = Cylinder(top), np.zeros(basis.N)
    path = [(DEPTH * part, 0.0) for part in np.linspace(0.0, 1.0, steps + 1)[1:]]
    path += [(DEPTH, TRAVEL * part) for part in np.linspace(0.0, 1.0, steps + 1)[1:]]
    for depth, travel in path:
        centre = np.array([travel, HEIGHT + RADIUS - depth])
        displacement, kept = advance(basis, cylinder, displacement, free, centre)
        force = np.array([(kept[2][axis] * top.dx).sum() for axis in range(2)])
        yield depth, travel, force


if __name__ == "__main__":
    for depth, travel, force in solve(*map(int, sys.argv[1:3])):
        sys.stdout.write(f"{1e3 * depth:.4f} {1e3 * travel:.4f} {force[0]:.6f} {force[1]:.6f}\n")
        sys.stdout.flush()
