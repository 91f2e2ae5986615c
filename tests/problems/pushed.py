"""A small press-and-slide, and a slow but plain reference solution of it at full size."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import fingerslip as fs
from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import mass_matrix, stiffness_matrix
from fingerslip.fe.space import boundary_nodes, build_space, nodal_areas, vector_dofs
from fingerslip.verification.meshes import box


def curved(radius):
    """Return a shift that turns the bottom y = 0 of a block into the parabola x^2 / (2 radius)."""

    def shift(points):
        x, y = points
        return np.array([x, y + (1.0 - y / y.max()) * x**2 / (2.0 * radius)])

    return shift


def pad(element, columns=8, rows=4):
    """Return a block of 8 mm by 4 mm with a bulged lower side, the boundary `bottom`."""
    xs, ys = np.linspace(-4e-3, 4e-3, columns + 1), np.linspace(0.0, 4e-3, rows + 1)
    return box(element, xs, ys, shift=curved(8e-3))


def push_and_slide(element="Q4", *, friction=0.4, damping=None, alpha=-0.05, sites=(), step=5e-3, **changes):
    """Return the model: press by 0.4 mm, hold, slide by 0.8 mm, so that the contact sticks, slips and slides."""
    values = {
        "mesh": pad(element),
        "materials": {"bulk": fs.Elastic(34e3, 0.4, 1000.0)},
        "formulation": "plane_strain",
        "depth": 1e-3,
        "supports": {"top": ("x", "y")},
        "contacts": (fs.Contact(boundary="bottom", friction=fs.Coulomb(friction)),),
        "programme": (fs.Press(0.4e-3, 4e-3), fs.Hold(0.02), fs.Slide(0.8e-3, 8e-3)),
        "time": fs.TimeStepping(step, alpha),
        "damping": damping or fs.RayleighDamping(),
        "record": fs.Recording(sites=sites),
    }
    return fs.Model(**(values | changes))


@dataclass
class Motion:
    """Displacement, velocity and acceleration of all degrees of freedom, and contact forces, at one time."""

    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    forces: np.ndarray


def reference(model, bodies, penalty):
    """Yield the motion step by step, with dense matrices, every degree of freedom an unknown of Newton's method.

    The contact law is the penalty law with return mapping in the displacements, not the complementarity
    problem in the forces, and the unbalanced force is computed from its definition at every step; with HHT's
    own difference equations. `bodies` (n_times, 2) is the plate's displacement, below along y, sliding along x.
    """
    space = build_space(model.mesh)
    materials = cell_materials(space, model.materials, model.formulation)
    stiffness = stiffness_matrix(space, materials, model.depth, model.integration).toarray()
    mass = mass_matrix(space, materials, model.depth).toarray()
    damping = model.damping.mass * mass + model.damping.stiffness * stiffness
    fixed = vector_dofs(boundary_nodes(space, "top"), 2).ravel()
    free = np.setdiff1d(np.arange(space.n_dofs), fixed)
    nodes = boundary_nodes(space, "bottom")
    springs = penalty * nodal_areas(space, "bottom", model.depth)[nodes]
    law = _Law(nodes, space.positions[nodes, 1] - space.positions[nodes, 1].min(), springs, model.contacts[0].friction)
    h, alpha = model.time.step, model.time.alpha
    beta, gamma = (1 - alpha) ** 2 / 4, 0.5 - alpha
    state = Motion(*np.zeros((3, space.n_dofs)), np.zeros((len(nodes), 2)))
    yield state
    for before, after in pairwise(bodies):
        u0, v0, a0 = state.displacement, state.velocity, state.acceleration
        old = damping @ v0 + stiffness @ u0 - law.spread(state.forces, space.n_dofs)
        start = u0 + h * v0 + h**2 * (0.5 - beta) * a0, v0 + h * (1 - gamma) * a0
        known = (state, start, old, after - before, after)

        def residual(a1, known=known):
            state, start, old, plate_change, plate = known
            u1, v1 = start[0] + beta * h**2 * a1, start[1] + gamma * h * a1
            forces, slopes = law(u1 - state.displacement, u1, state.forces, plate_change, plate)
            unbalance = damping @ v1 + stiffness @ u1 - law.spread(forces, space.n_dofs)
            tangent = mass + (1 + alpha) * (gamma * h * damping + beta * h**2 * (stiffness - slopes))
            return (mass @ a1 + (1 + alpha) * unbalance - alpha * old)[free], tangent[np.ix_(free, free)], forces

        a1 = _newton(residual, a0.copy(), free)
        u1, v1 = start[0] + beta * h**2 * a1, start[1] + gamma * h * a1
        state = Motion(u1, v1, a1, residual(a1)[2])
        yield state


class _Law:
    """Penalty contact with Coulomb return mapping on a plate below: forces (normal, tangential) and slopes."""

    def __init__(self, nodes, gap, springs, friction):
        self.nodes, self.gap, self.springs, self.mu = nodes, gap, springs, friction.coefficient

    def __call__(self, change, displacement, old_forces, plate_change, plate):
        forces, slopes = np.zeros((len(self.nodes), 2)), np.zeros((displacement.size, displacement.size))
        for i, (node, spring) in enumerate(zip(self.nodes, self.springs, strict=True)):
            x, y = 2 * node, 2 * node + 1
            gap = self.gap[i] + displacement[y] - plate[1]
            if gap >= 0.0:
                continue
            normal = -spring * gap
            trial = old_forces[i, 1] - spring * (change[x] - plate_change[0])
            slopes[y, y] = -spring
            if abs(trial) <= self.mu * normal:
                forces[i], slopes[x, x] = (normal, trial), -spring
            else:
                limit = self.mu * np.sign(trial)
                forces[i], slopes[x, y] = (normal, limit * normal), -spring * limit
        return forces, slopes

    def spread(self, forces, size):
        """Nodal forces on the body: the plate's normal is y and its tangent x."""
        out = np.zeros((size // 2, 2))
        out[self.nodes] = forces[:, ::-1]
        return out.ravel()


def _newton(residual, guess, free):
    """Newton with halving of steps that do not help; the law is piecewise linear, so it ends exactly."""
    now, tangent, _ = residual(guess)
    for _ in range(200):
        step = np.linalg.solve(tangent, now)
        length = 1.0
        while length > 1e-6:
            trial = guess.copy()
            trial[free] -= length * step
            new, new_tangent, _ = residual(trial)
            if np.linalg.norm(new) < np.linalg.norm(now) or np.abs(step).max() <= 1e-13 * np.abs(trial).max():
                break
            length *= 0.5
        settled = length == 1.0 and np.abs(step).max() <= 1e-11 * max(np.abs(trial).max(), 1e-300)
        guess, now, tangent = trial, new, new_tangent
        if settled:
            return guess
    raise AssertionError(f"the reference did not converge: {np.linalg.norm(now):.2e}")
