"""What stays the same from step to step: the condensed matrix, and the compliance of the contact nodes."""

from __future__ import annotations

import contextlib
import time as clock
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.contact.candidates import Candidates
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.dynamics.step.condensation import Condensed
from fingerslip.dynamics.step.sharing import first_alike, same_compliance
from fingerslip.dynamics.step.viscoelastic import Viscous, viscous_steps
from fingerslip.dynamics.system.scheme import Scheme, make_scheme
from fingerslip.dynamics.system.system import System
from fingerslip.fe.space import vector_dofs
from fingerslip.linear.solver import LinearSolver
from fingerslip.linear.symmetric import row_products
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.model.timing import Timing

# Stiffness of the springs to an anchor over that of all contact.
_SOFT = 1e-4
# Contact rows times unknowns from which factors of single precision are worth it, by the dimension of space.
_ROUGH_FROM = {2: 72_000_000, 3: 6_000_000}


@dataclass
class Stopwatch:
    """Seconds spent in each part of a simulation, by the clock and by all cores together."""

    seconds: dict[str, float] = field(default_factory=dict)
    cpu_seconds: dict[str, float] = field(default_factory=dict)

    @contextlib.contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Add the time that the block takes to `name`."""
        start, cpu_start = clock.perf_counter(), clock.process_time()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + clock.perf_counter() - start
            self.cpu_seconds[name] = self.cpu_seconds.get(name, 0.0) + clock.process_time() - cpu_start


@dataclass(frozen=True)
class Stepper:
    """All of one motion that stays the same from step to step."""

    system: System  # matrices and candidates
    scheme: Scheme  # time integration
    damping: RayleighDamping  # material damping
    solver: LinearSolver  # what has factorised
    # the effective matrix, factorised and condensed on the candidates of all motions that share it
    condensed: Condensed
    rows: Integers  # (m,), the rows among these of the system's own candidates
    compliance: Compliance  # compliance of a step on the own candidates, with their frames where these never turn
    turning: Floats  # (n, r) [1/(N m)]
    anchoring: Floats | None = None  # (n,), springs [N/m] or [N m] between what only contact holds and an anchor
    viscous: tuple[Viscous, ...] = ()  # the viscoelastic layers

    @cached_property
    def stiffness(self) -> sparse.csr_matrix:
        """Stiffness of the force at the end of a step (n, n) [N/m], that of viscoelastic layers included."""
        stiffness = self.system.stiffness
        for layer in self.viscous:
            stiffness = sparse.csr_matrix(stiffness + layer.stiffness)
        return stiffness

    def resisting_force(self, displacement: Floats, velocity: Floats) -> Floats:
        """Return what resists k motions u (k, n) [m] and v [m/s] at the end of a step, K u + C v, (k, n) [N]."""
        damping, system = self.damping, self.system
        if self.viscous or not damping.stiffness:
            force = row_products(self.stiffness, displacement)
            if damping.stiffness:
                force += damping.stiffness * row_products(system.stiffness, velocity)
        else:
            # Where nothing relaxes both stiffnesses are the same, and one product does.
            force = row_products(self.stiffness, displacement + damping.stiffness * velocity)
        if damping.mass:
            force += damping.mass * row_products(system.mass, velocity)
        return force if system.dampers is None else force + system.dampers * velocity

    @cached_property
    def gaps(self) -> Floats:
        """Gaps of the candidates' reference positions, shape (n_c,) [m]."""
        candidates = self.system.candidates
        return self.system.counterfaces.gaps(candidates.positions, candidates.counterface)

    def anchor_force(self, stretch: Floats) -> Floats:
        """Return the force of springs to an anchor that are stretched by (n,) [m], shape (n,) [N]."""
        return np.zeros_like(stretch) if self.anchoring is None else self.anchoring * stretch

    def damping_force(self, velocity: Floats) -> Floats:
        """Return the damping force C v at a velocity (n,) [m/s], shape (n,) [N]."""
        total = np.zeros_like(velocity)
        if self.damping.mass:
            total += self.damping.mass * (self.system.mass @ velocity)
        if self.damping.stiffness:
            total += self.damping.stiffness * (self.system.stiffness @ velocity)
        if self.system.dampers is not None:
            total += self.system.dampers * velocity
        return total


def is_large(systems: Sequence[System]) -> bool:
    """Tell whether systems that share a matrix are large enough for factors of single precision to be worth it."""
    rows = max(system.relative.shape[0] for system in systems)
    return bool(rows * systems[0].relative.shape[1] >= _ROUGH_FROM[systems[0].space.dim])


def build_steppers(
    systems: Sequence[System], time: Timing, damping: RayleighDamping, solver: LinearSolver, reserved_bytes: int = 0
) -> list[Stepper]:
    """Factorise and condense the matrix that systems share for a fixed step, roughly where steps correct it."""
    scheme = make_scheme(time)
    # The equation of the next step contains the forces of the displacement reached, and so corrects what rough factors
    # miss. Without inertia a single step may be all of a motion, and has to be exact.
    corrected = bool(scheme.inertia_factor) and not systems[0].held_by_contact and is_large(systems)
    steppers = factorised(systems, scheme, damping, solver.rough() if corrected else solver, reserved_bytes)
    return [replace(stepper, solver=solver) for stepper in steppers]


def factorised(
    systems: Sequence[System], scheme: Scheme, damping: RayleighDamping, solver: LinearSolver, reserved_bytes: int
) -> list[Stepper]:
    """Factorise and condense the matrix that systems share for the steps of a scheme."""
    system, moving = systems[0], systems[0].coordinates.moving
    local, rows = _joint_rows(systems)
    anchoring, viscous = _anchoring(system), viscous_steps(system.viscoelastic, scheme.step)
    matrix = with_empty(_effective_matrix(system, scheme, damping, viscous, anchoring), moving)
    if moving.size:
        local = sparse.csr_matrix(local @ _selector(local.shape[1], moving))
        local.eliminate_zeros()
    condensed, compliance = system.coordinates.condense(matrix, local, solver, reserved_bytes)
    # What unit moments on rotations of bodies do without contact.
    at = np.zeros(0, dtype=np.int64) if system.rotations is None else system.rotations.at
    turning = np.zeros((system.mass.shape[0], at.size), order="F")
    turning[at, np.arange(at.size)] = 1.0
    if at.size:
        turning = condensed.backward(condensed.forward(turning), np.zeros((len(compliance), at.size)))
    # A force at the end of the step has the end weight, a unit of the unknown the displacement factor.
    factor = scheme.end_weight * scheme.displacement_factor
    first = first_alike(systems, same_compliance)
    compliances = {}
    for kind in set(first):
        shared, candidates = rows[kind], systems[kind].candidates
        block = compliance if shared.size == len(compliance) else compliance[np.ix_(shared, shared)]
        frames = systems[kind].constant_frames()
        compliances[kind] = Compliance(block, penalty_compliance(candidates), frames, factor)
    alike = scheme, damping, solver, condensed
    return [
        Stepper(each, *alike, rows[number], compliances[first[number]], turning, anchoring, viscous)
        for number, each in enumerate(systems)
    ]


def _effective_matrix(
    system: System, scheme: Scheme, damping: RayleighDamping, viscous: Sequence[Viscous], anchoring: Floats | None
) -> sparse.csr_matrix:
    """Return the matrix A of a step, which the unknown is solved for, shape (n, n)."""
    stiffness_part = scheme.displacement_factor + scheme.velocity_factor * damping.stiffness
    mass_part = scheme.inertia_factor + scheme.end_weight * scheme.velocity_factor * damping.mass
    effective = mass_part * system.mass + scheme.end_weight * stiffness_part * system.stiffness
    if system.dampers is not None:
        effective += sparse.diags(scheme.end_weight * scheme.velocity_factor * system.dampers)
    for layer in viscous:
        effective = effective + scheme.end_weight * scheme.displacement_factor * layer.stiffness
    return sparse.csr_matrix(effective if anchoring is None else effective + sparse.diags(anchoring))


def with_empty(matrix: sparse.csr_matrix, rows: Integers) -> sparse.csr_matrix:
    """Return a matrix (n, n) in whose equations some unknowns (k,) are zero."""
    if not rows.size:
        return matrix
    selector = _selector(matrix.shape[0], rows)
    left_out = sparse.diags((1.0 - selector.diagonal()) * matrix.diagonal().mean())
    return sparse.csr_matrix(selector @ matrix @ selector + left_out)


def _selector(size: int, rows: Integers) -> sparse.dia_matrix:
    """Return the identity (n, n) without some rows (k,)."""
    is_free = np.ones(size)
    is_free[rows] = 0.0
    return sparse.diags(is_free)


def _anchoring(system: System) -> Floats | None:
    """Return springs, (n,) [N/m] or [N m], that hold what nothing else does until contact does; None where all is held.

    They are soft beside the contact, so that few passes of a step carry the anchor to where they pull no more, and have
    nothing to do with masses, which do not matter without inertia.
    """
    if not system.held_by_contact:
        return None
    candidates, springs = system.candidates, np.zeros(system.mass.shape[0])
    stiffness = _SOFT * candidates.normal_stiffness
    for at, freedom in zip(system.unknowns.rigid, system.unknowns.freedoms, strict=True):
        if not (freedom.stiffness or freedom.damping):
            touches = np.isin(candidates.counterface, freedom.faces)[:, None]
            springs[at] = stiffness @ ((touches * freedom.displacements(candidates.positions)) ** 2).sum(axis=1)
    if "body" in system.held_by_contact:
        springs[: system.free.size] = stiffness.sum() * system.space.dim / system.free.size
    return springs


def _joint_rows(systems: Sequence[System]) -> tuple[sparse.csr_matrix, list[Integers]]:
    """Return the local displacements of all candidates of all systems, and the rows of each system's own."""
    dim = systems[0].space.dim
    marks = [
        system.candidates.counterface * len(system.space.positions) + system.candidates.nodes for system in systems
    ]
    joint, first = np.unique(np.concatenate(marks), return_index=True)
    rows = [vector_dofs(np.searchsorted(joint, mark), dim).ravel() for mark in marks]
    if all(row.size == dim * joint.size for row in rows):
        return systems[0].relative, rows
    stacked = sparse.vstack([system.relative for system in systems], format="csr")
    return stacked[vector_dofs(first, dim).ravel()], rows


def penalty_compliance(candidates: Candidates) -> Floats:
    """Return by how much a force moves candidates into their counterfaces, (n_c, dim) [m/N]."""
    tangential = [candidates.tangential_stiffness] * (candidates.dim - 1)
    return np.asarray(1.0 / np.column_stack([candidates.normal_stiffness, *tangential]))
