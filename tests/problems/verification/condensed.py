"""The condensed solver against an independent one at full size: dense matrices, and Newton's method on every unknown.

The contact law of the latter is the penalty law with return mapping in the displacements, not the complementarity
problem in the forces that the condensed solver solves; and the unbalanced force is computed from its definition at
every step. Which forces at the start of a step are dropped follows node by node from
:mod:`fingerslip.dynamics.step.release`. It takes a plate below the body, with the last axis as its normal, HHT-alpha
steps and Coulomb friction.
"""

from dataclasses import dataclass

import numpy as np

import fingerslip as fs
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.dynamics.recording.schedule import step_times
from fingerslip.dynamics.step.small_strain import advance_together
from fingerslip.dynamics.step.state import first_state
from fingerslip.dynamics.step.stepper import Stopwatch, build_steppers
from fingerslip.dynamics.system.system import build_system
from fingerslip.errors import ConvergenceError
from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import mass_matrix, stiffness_matrix
from fingerslip.fe.space import boundary_nodes, build_space, nodal_areas, vector_dofs
from fingerslip.linear.resources import allowed_threads, limited_threads, suitable_threads
from fingerslip.linear.solver import preferred_solver
from fingerslip.model.timing import TimeStepping
from fingerslip.verification.blocks import block_on_plate
from fingerslip.verification.meshes import axes_of, dimension
from fingerslip.verification.problem import Problem, absolute, largest

Array = np.ndarray

_NEWTON_LIMIT, _HALVINGS = 200, 21
_TOLERANCE = 1e-11


@dataclass(frozen=True)
class FullMotion:
    """The motion at one time."""

    displacement: Array  # (n_dofs,), [m], [m/s], [m/s^2]
    velocity: Array  # (n_dofs,), [m], [m/s], [m/s^2]
    acceleration: Array  # (n_dofs,), [m], [m/s], [m/s^2]
    forces: Array  # (n_c, dim) [N]
    pushes: Array  # (n_c, dim) [N]
    fading: Array  # (n_c, dim), part of `pushes` that is left of dropped forces [N]


@dataclass(frozen=True)
class FullSystem:
    """A model at full size."""

    mass: Array  # (n_dofs, n_dofs), [kg], [N s/m], [N/m]
    damping: Array  # (n_dofs, n_dofs), [kg], [N s/m], [N/m]
    stiffness: Array  # (n_dofs, n_dofs), [kg], [N s/m], [N/m]
    free: Array  # (n_free,), degrees of freedom that are not supported
    nodes: Array  # (n_c,), nodes of the contact boundary
    dofs: Array  # (n_c, dim), their degrees of freedom, the normal one last
    gaps: Array  # (n_c,), their gaps at the start [m]
    springs: Array  # (n_c, 2), normal and tangential penalty stiffness of each [N/m]
    friction: float  # friction coefficient [-]
    time: TimeStepping  # the step [s] and alpha [-]

    @property
    def beta(self):
        """Newmark's beta [-]."""
        return (1.0 - self.time.alpha) ** 2 / 4.0

    @property
    def gamma(self):
        """Newmark's gamma [-]."""
        return 0.5 - self.time.alpha

    def contact(self, displacement, before, plates):
        """Return the contact forces (n_c, dim) [N] and their slopes by the displacements, (n_c, dim, dim) [N/m]."""
        count, dim = self.dofs.shape
        forces, slopes = np.zeros((count, dim)), np.zeros((count, dim, dim))
        for i, dofs in enumerate(self.dofs):
            gap = self.gaps[i] + displacement[dofs[-1]] - plates[1][-1]
            if gap < 0.0:
                moved = displacement[dofs] - before.displacement[dofs] - (plates[1] - plates[0])
                trial = before.forces[i, :-1] - self.springs[i, 1] * moved[:-1]
                forces[i], slopes[i] = self._returned(-self.springs[i, 0] * gap, trial, self.springs[i])
        return forces, slopes

    def _returned(self, normal, trial, springs):
        """Return force (dim,) and slope (dim, dim) of a touching node from its normal and its trial force."""
        slope, length, limit = np.diag(-springs[[1] * trial.size + [0]]), np.linalg.norm(trial), self.friction * normal
        if length <= limit:
            return np.append(trial, normal), slope
        direction = trial / length
        across = np.eye(trial.size) - np.outer(direction, direction)
        slope[:-1, :-1] = -springs[1] * limit / length * across
        slope[:-1, -1] = -self.friction * springs[0] * direction
        return np.append(limit * direction, normal), slope

    def unbalance(self, displacement, velocity, forces):
        """Return C v + K u less the contact forces on all degrees of freedom, (n_dofs,) [N]."""
        total = self.damping @ velocity + self.stiffness @ displacement
        total[self.dofs.ravel()] -= forces.ravel()
        return total

    def end(self, acceleration, before):
        """Return displacement [m] and velocity [m/s] after a step that ends with an acceleration (n_dofs,) [m/s^2]."""
        step, mean = self.time.step, (0.5 - self.beta) * before.acceleration + self.beta * acceleration
        displacement = before.displacement + step * before.velocity + step**2 * mean
        velocity = before.velocity + step * ((1.0 - self.gamma) * before.acceleration + self.gamma * acceleration)
        return displacement, velocity

    def residual(self, acceleration, before, plates, correction):
        """Return the residual of a step (n_free,) [N] and its derivative by the acceleration (n_free, n_free) [kg].

        `correction` (n_c, dim) [N] comes to the contact forces of the scheme.
        """
        step, alpha = self.time.step, self.time.alpha
        displacement, velocity = self.end(acceleration, before)
        forces, slopes = self.contact(displacement, before, plates)
        old = self.unbalance(before.displacement, before.velocity, before.forces)
        new = self.unbalance(displacement, velocity, forces)
        residual = self.mass @ acceleration + (1.0 + alpha) * new - alpha * old
        residual[self.dofs.ravel()] -= correction.ravel()
        stiffness = self.stiffness.copy()
        for dofs, slope in zip(self.dofs, slopes, strict=True):
            stiffness[np.ix_(dofs, dofs)] -= slope
        weighted = self.gamma * step * self.damping + self.beta * step**2 * stiffness
        tangent = self.mass + (1.0 + alpha) * weighted
        return residual[self.free], tangent[np.ix_(self.free, self.free)]

    def step(self, before, plates, time, scale):
        """Take one step, again without the forces at its start that must not count, as long as there are more of them.

        The plate's displacements (dim,) [m] are those at both ends of the step, which ends at a `time` [s]; `scale` is
        the largest acceleration of the motion [m/s^2].
        """
        alpha, remainder = self.time.alpha, 1.0 - 1.0 / self.gamma
        dropped = np.zeros(before.forces.shape, dtype=bool)
        while True:
            fading = remainder * np.where(dropped, before.pushes, before.fading)
            correction = fading + np.where(dropped, alpha * before.forces, 0.0)
            acceleration = self._accelerated(before, plates, correction, (time, scale))
            displacement, velocity = self.end(acceleration, before)
            forces = self.contact(displacement, before, plates)[0]
            more = self._to_drop(before, displacement, forces, plates) & ~dropped
            if not more.any():
                pushes = (1.0 + alpha) * forces - alpha * before.forces + correction
                return FullMotion(displacement, velocity, acceleration, forces, pushes, fading)
            dropped |= more

    def _to_drop(self, before, displacement, forces, plates):
        """Tell which components of the forces at the start must not count, (n_c, dim)."""
        touched = before.forces[:, -1] > 0.0
        moved = (displacement - before.displacement)[self.dofs] - (plates[1] - plates[0])
        slip = moved[:, :-1] + (forces - before.forces)[:, :-1] / self.springs[:, 1:]
        work = np.sum(slip * (forces + before.forces)[:, :-1], axis=1)
        limit = self.friction * forces[:, -1]
        slips = np.linalg.norm(forces[:, :-1], axis=1) >= limit * (1.0 - 1e-9)
        turns = touched & slips & (work > 1e-9 * limit**2 / self.springs[:, 1])
        leaves = touched & (forces[:, -1] <= 0.0)
        dropped = np.tile((turns | leaves)[:, None], (1, forces.shape[1]))
        dropped[:, -1] = leaves
        return dropped

    def _accelerated(self, before, plates, correction, at):
        """Return the acceleration at the end of a step (n_dofs,) [m/s^2]: Newton's method with a line search.

        `at` are the end of the step [s] and the largest acceleration of the motion [m/s^2].
        """
        (time, scale), acceleration = at, before.acceleration.copy()
        residual, tangent = self.residual(acceleration, before, plates, correction)
        change = np.full(self.free.size, np.inf)
        for _ in range(_NEWTON_LIMIT):
            change = np.linalg.solve(tangent, residual)
            tiny = np.abs(change).max() <= _TOLERANCE * max(scale, np.abs(acceleration).max())
            for length in 0.5 ** np.arange(_HALVINGS):
                trial = acceleration.copy()
                trial[self.free] -= length * change
                new, tangent = self.residual(trial, before, plates, correction)
                if tiny or np.linalg.norm(new) < np.linalg.norm(residual):
                    break
            acceleration, residual = trial, new
            if tiny:
                return acceleration
        raise ConvergenceError(time, -1, float(np.abs(change).max()), _TOLERANCE, "the reference has to be repaired")


def full_system(model):
    """Assemble a model with one contact, whose penalties are given, at full size."""
    contact, time = model.contacts[0], model.time
    assert isinstance(time, TimeStepping)
    assert contact.normal_penalty is not None
    assert contact.tangential_penalty is not None
    space = build_space(model.mesh)
    materials = cell_materials(space, model.materials, model.formulation)
    stiffness = stiffness_matrix(space, materials, model.depth, model.integration).toarray()
    mass = mass_matrix(space, materials, model.depth).toarray()
    held = [
        vector_dofs(boundary_nodes(space, name), space.dim)[:, ["xyz".index(axis) for axis in axes]].ravel()
        for name, axes in model.supports.items()
    ]
    nodes = boundary_nodes(space, contact.boundary)
    heights = space.positions[nodes, -1]
    penalties = (contact.normal_penalty, contact.tangential_penalty)
    return FullSystem(
        mass=mass,
        damping=model.damping.mass * mass + model.damping.stiffness * stiffness,
        stiffness=stiffness,
        free=np.setdiff1d(np.arange(space.n_dofs), np.concatenate(held)),
        nodes=nodes,
        dofs=vector_dofs(nodes, space.dim),
        gaps=heights - heights.min(),
        springs=np.outer(nodal_areas(space, contact.boundary, model.depth)[nodes], penalties),
        friction=contact.friction.coefficient,
        time=time,
    )


def full_motions(system, plates, times):
    """Return the motion at every time [s] (n_times,), under the plate's displacements (n_times, dim) [m]."""
    none, unloaded = np.zeros(len(system.mass)), np.zeros(system.dofs.shape)
    motions, scale = [FullMotion(none, none, none, unloaded, unloaded, unloaded)], 0.0
    for number in range(1, times.size):
        motions.append(system.step(motions[-1], (plates[number - 1], plates[number]), float(times[number]), scale))
        scale = max(scale, float(np.abs(motions[-1].acceleration).max()))
    return motions


def make_stepper(model, solver=None):
    """Return the stepper of a model that is simulated alone."""
    return build_steppers([build_system(model)], model.time, model.damping, solver or preferred_solver())[0]


def condensed_states(stepper, model):
    """Yield the condensed solver's state at every time, the start included."""
    system, times, watch = stepper.system, step_times(model), Stopwatch()
    plates = [motion.displacement(times) for motion in system.motions]
    state = first_state(stepper)
    yield state
    for number in range(1, times.size):
        shifts = np.array([plate[number] for plate in plates]).reshape(-1, system.space.dim)
        (state,) = advance_together([stepper], [state], float(times[number]), [shifts], watch=watch)
        yield state


_STEP, _ALPHA, _PENALTY, _MU = 2e-3, -0.05, 1e8, 0.4
# 7 % of critical damping in the block's first shear mode, at about 1300 rad/s.
_DAMPING = fs.RayleighDamping(mass=2.0, stiffness=1e-4)
_FIELDS = ("displacement", "velocity", "acceleration", "forces")
_SIDES = {2: (10e-3, 4e-3), 3: (10e-3, 6e-3, 4e-3)}
# Nodes along each side, of linear and of quadratic elements.
_COUNTS = {2: ((9, 4), (5, 3)), 3: ((5, 3, 3), (4, 2, 2))}


def _model(element, integration):
    """Return a soft block whose edges lift and slip first, pressed and dragged into overall slip."""
    dim = dimension(element)
    grids = map(np.linspace, (0.0,) * dim, _SIDES[dim], _COUNTS[dim][element in {"T6", "T10"}])
    return block_on_plate(
        element,
        *grids,
        material=fs.Elastic(34e3, 0.45, 1000.0),
        plate={"friction": fs.Coulomb(_MU), "search_distance": 1.0}
        | dict.fromkeys(("normal_penalty", "tangential_penalty"), _PENALTY),
        supports={"top": axes_of(element)},
        programme=(fs.Press(0.3e-3, 3e-3), fs.Slide(4e-3, 20e-3)),
        time=fs.TimeStepping(_STEP, _ALPHA),
        damping=_DAMPING,
        integration=integration,
    )


def _everywhere(states, name, system):
    """Return a field on all degrees of freedom at every time, zero where they are held, shape (n_times, n_dofs)."""
    field = np.zeros((len(states), system.space.n_dofs))
    field[:, system.free] = [getattr(state, name) for state in states]
    return field


def compared(element, integration, solver=None):
    """Compare one element over a whole press and slide, at every node and every step."""
    model = _model(element, integration)
    stepper, times, full = make_stepper(model, solver), step_times(model), full_system(model)
    system = stepper.system
    with limited_threads(suitable_threads(len(full.mass), allowed_threads(), system.space.dim)):
        states = list(condensed_states(stepper, model))
        motions = full_motions(full, system.motions[0].displacement(times), times)
    fields = {name: _everywhere(states, name, system) for name in _FIELDS[:3]}
    fields["forces"] = np.stack([state.contact_forces for state in states])
    expected = {name: np.stack([getattr(motion, name) for motion in motions]) for name in _FIELDS}
    expected["forces"] = expected["forces"][:, np.searchsorted(full.nodes, system.candidates.nodes)]
    for name in _FIELDS:
        yield largest(f"{name}, largest difference / largest", expected[name], fields[name], 1e-9)
    seen = {number for state in states for number in state.interface.state.tolist()}
    yield absolute("states that never occur", 0.0, len({OPEN, STICK, SLIP} - seen), 0.0)


def _cases(linear, *elements):
    """Return cases of some elements, and of nodal integration of linear ones."""
    return {element: (element, "selective") for element in elements} | {f"{linear} nodal": (linear, "nodal")}


_TITLE, _SOURCE = "Condensed solver against the full system", "Newton's method"
PROBLEMS = (
    Problem("condensed-2d", f"{_TITLE}, in 2D", _SOURCE, compared, _cases("T3", "Q4", "T3", "T6")),
    Problem("condensed-3d", f"{_TITLE}, in 3D", _SOURCE, compared, _cases("T4", "H8", "T4", "T10"), slow=True),
)
