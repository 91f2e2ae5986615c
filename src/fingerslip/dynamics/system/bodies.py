"""What moves bodies and acts on them: loads, supports, prescribed motion of counterfaces, free rigid bodies.

A support's force follows from the equations of motion of what it holds. The scheme weights it like all other forces, so
that the body with its supports obeys the scheme's balance of momentum. With F = C v + K u - f - B^T r and M a in these
rows, summed up, it is ::

    R = F - U,    w_1 U_1 = w_0 U_0 - M a_1

A free direction of a rigid body is an unknown of the system. A driven counterface is one, too: a body that is free
along its normal. With the velocity q_k' of its centre in the direction e_k, or the rate q_k' of a turn about it, a
point of the body that is at x now moves by ::

    sum over k of q_k' d_k(x),    d_k = e_k, or e_k x (x - present centre) for a turn
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.contact.counterfaces import Counterface, sliding_direction
from fingerslip.dynamics.system.scheme import has_inertia
from fingerslip.errors import InputError
from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.forms import ViscoelasticLayers, mass_matrix, traction_load
from fingerslip.fe.space import Space
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.materials.material import Material
from fingerslip.model.model import Contact, Model, SupportMotion, Traction
from fingerslip.model.programme import CONSTANT, Hold, Lift, Phase, Press, Ramp, Slide, phase_duration
from fingerslip.model.rigid_bodies import DIRECTIONS, Direction, RigidBody, directions_in


def require_components(where: str, values: Sequence[float], dim: int) -> None:
    """Refuse a vector of another dimension than the mesh."""
    if len(values) != dim:
        raise InputError(where, f"got {len(values)} components", f"needs {dim}")


@dataclass(frozen=True)
class Load:
    """Nodal forces with a factor over time."""

    forces: Floats  # (n,), nodal forces at factor one [N]
    ramp: Ramp  # factor over time

    def at(self, time: float) -> Floats:
        """Return the forces at a time [s], shape (n,) [N]."""
        return self.ramp.at(time) * self.forces


def model_loads(model: Model, space: Space, materials: CellMaterials[Material]) -> tuple[Load, ...]:
    """Return the tractions and the gravity of a model on all degrees of freedom of its mesh."""
    loads = []
    for name, traction in model.tractions.items():
        value, ramp = (traction.value, traction.ramp) if isinstance(traction, Traction) else (traction, CONSTANT)
        loads.append(Load(traction_load(space, {name: value}, model.depth), ramp))
    if model.gravity is not None:
        require_components("gravity", model.gravity, space.dim)
        acceleration = np.tile(model.gravity, len(space.positions))
        loads.append(Load(mass_matrix(space, materials, model.depth) @ acceleration, CONSTANT))
    return tuple(loads)


@dataclass(frozen=True)
class Supports:
    """What acts on the degrees of freedom that m supports hold, summed up over each support and component."""

    rows: sparse.csr_matrix  # map that sums up forces on the mesh over each support and component [-]
    stiffness: sparse.csr_matrix | Floats  # (m * dim, n) [N/m]
    mass: sparse.csr_matrix | Floats  # (m * dim, n) [kg]
    contact: sparse.csr_matrix  # map from the contact forces to those that act on what is held at once
    loads: tuple[Load, ...]  # loads on what is held, (m * dim,) each [N]
    viscoelastic: tuple[ViscoelasticLayers, ...] = ()  # maps (m * dim, n) of the viscoelastic layers

    @property
    def columns(self) -> Integers:
        """The unknowns that stiffness and mass read, shape (k,): those of the cells next to what is held."""
        return np.union1d(*(np.flatnonzero(abs(matrix).sum(axis=0)) for matrix in (self.stiffness, self.mass)))

    def load(self, time: float) -> Floats:
        """Return the loads on what is held at a time [s], shape (m * dim,) [N]."""
        return sum((load.at(time) for load in self.loads), np.zeros(self.contact.shape[0]))


@dataclass(frozen=True)
class MovingComponent:
    """One component of a moving support."""

    support: str  # its boundary or region
    axis: int  # its component
    dofs: Integers  # (k,), the mesh's degrees of freedom that move with it
    displacement: float  # displacement at factor one [m]
    ramp: Ramp  # factor over time

    def at(self, time: float) -> float:
        """Return the displacement at a time [s], in m."""
        return self.displacement * self.ramp.at(time)


def moving_components(
    motions: Mapping[str, SupportMotion], rows: sparse.csr_matrix, names: Sequence[str]
) -> list[MovingComponent]:
    """Return the components of moving supports."""
    components = []
    for name, motion in motions.items():
        dim = len(motion.displacement)
        for axis, displacement in enumerate(motion.displacement):
            dofs = rows[names.index(name) * dim + axis].indices.astype(np.int64)
            if displacement and dofs.size:
                components.append(MovingComponent(name, axis, np.sort(dofs), displacement, motion.ramp))
    return components


def held_rows(held: Mapping[str, Integers], space: Space) -> sparse.csr_matrix:
    """Return the map [-] that sums up forces (n_dofs,) over supports and components, shape (m * dim, n_dofs).

    Arrays: held (k,).

    Examples
    --------
    A square with node 0 held by the first of two supports:

    >>> import skfem
    >>> from fingerslip.fe.space import build_space
    >>> mesh = skfem.MeshQuad().with_subdomains({"bulk": lambda x: x[0] > -1.0})
    >>> rows = held_rows({"corner": np.array([0, 1]), "side": np.array([0, 1, 2, 3])}, build_space(mesh))
    >>> rows.toarray().astype(int)[:, :4].tolist()
    [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    """
    holder = np.full(space.n_dofs, -1)
    for number, dofs in reversed(list(enumerate(held.values()))):
        holder[dofs] = number
    columns = np.flatnonzero(holder >= 0)
    shape = (len(held) * space.dim, space.n_dofs)
    return sparse.csr_matrix(
        (np.ones(columns.size), (holder[columns] * space.dim + columns % space.dim, columns)), shape
    )


@dataclass(frozen=True)
class Motion:
    """Piecewise linear motion of a counterface."""

    knots: Floats  # (n_phases + 1,), times at which the velocity changes [s]
    positions: Floats  # (n_phases + 1, dim), displacement at the knots [m]

    def displacement(self, times: Floats) -> Floats:
        """Return the displacement [m] at `times` (n,) [s], shape (n, dim); constant after the last knot."""
        return np.column_stack([np.interp(times, self.knots, part) for part in self.positions.T])

    def velocity(self, times: Floats) -> Floats:
        """Return the velocity [m/s] at `times` (n,) [s], shape (n, dim); at a knot that of the phase before."""
        if self.knots.size < 2:
            return np.zeros((len(times), self.positions.shape[1]))
        durations = np.diff(self.knots)
        slopes = np.diff(self.positions, axis=0) / durations[:, None]
        # Multiples of the step meet the knots up to rounding only.
        phase = np.searchsorted(self.knots + 1e-9 * durations.min(), times, side="left") - 1
        rates = np.vstack([slopes, np.zeros(self.positions.shape[1])])
        return rates[np.clip(phase, 0, len(slopes))]


def phase_table(programme: Sequence[Phase]) -> tuple[list[str], Floats]:
    """Return the kinds of the phases and the times between them, shape (n_phases + 1,) [s]."""
    kinds = [type(phase).__name__.lower() for phase in programme]
    return kinds, np.concatenate([[0.0], np.cumsum([phase_duration(phase) for phase in programme])])


def counterface_motion(programme: Sequence[Phase], counterface: Counterface, where: str = "programme") -> Motion:
    """Return the motion of one counterface."""
    dim, normal = counterface.dim, counterface.unit_normal
    travels = [_travel(phase, normal, f"{where}.{number}") for number, phase in enumerate(programme)]
    positions = np.concatenate([np.zeros((1, dim)), np.cumsum(np.reshape(travels, (-1, dim)), axis=0)])
    return Motion(phase_table(programme)[1], positions)


def _travel(phase: Phase, normal: Floats, where: str) -> Floats:
    """Return how far a phase moves a counterface (dim,) [m]."""
    match phase:
        case Press():
            return phase.depth * normal
        case Lift():
            return -phase.distance * normal
        case Hold():
            return np.zeros_like(normal)
        case Slide(direction=None):
            along = sliding_direction(normal)
        case Slide():
            along = _along(phase.direction or (), normal, f"{where}.slide.direction")
    return phase.distance * along + phase.press * normal


def _along(given_direction: Sequence[float], normal: Floats, where: str) -> Floats:
    """Return the unit vector along a counterface (dim,) that is nearest to a direction."""
    require_components(where, given_direction, normal.size)
    # Only where it points to counts: components of any size must not overflow.
    direction = np.asarray(given_direction, dtype=float) / (np.abs(given_direction).max() or 1.0)
    along: Floats = direction - (direction @ normal) * normal
    if np.linalg.norm(along) <= 1e-6 * np.linalg.norm(direction) or not direction.any():
        raise InputError(where, f"got {list(given_direction)}", "needs a direction along the counterface")
    return along / np.linalg.norm(along)


def largest_approach(motion: Motion, counterface: Counterface) -> float:
    """Return the largest travel of a counterface along its unit normal [m]."""
    return float(np.max(motion.positions @ counterface.unit_normal, initial=0.0))


_ZERO = 1e-9


@dataclass(frozen=True)
class RigidFreedom:
    """One free direction of a rigid body."""

    body: str | None  # name of the body
    direction: Direction | None  # its name
    faces: tuple[int, ...]  # indices of the counterfaces that move with it
    shift: Floats  # (dim,), displacement of the body's centre per unknown [-]
    turn: Floats  # (dim, dim), map from the arm of a point to its displacement per radian [-]
    centre: Floats  # (dim,), centre of the body at the start [m]
    mass: float  # inertia [kg] or [kg m^2]
    stiffness: float = 0.0  # stiffness of the spring [N/m] or [N m]
    damping: float = 0.0  # coefficient of the damper [N s/m] or [N m s]
    velocity: float = 0.0  # at the start [m/s] or [rad/s]
    loads: tuple[tuple[float, Ramp], ...] = ()  # forces [N] or moments [N m] with their factors

    @property
    def axis(self) -> int:
        """Index of its axis among x, y and z."""
        return 0 if self.direction is None else "xyz".index(self.direction[-1])

    @property
    def turns(self) -> bool:
        """Whether it is a rotation."""
        return bool(self.turn.any())

    def displacements(self, points: Floats) -> Floats:
        """Return the displacement of points (k, dim) [m] of the body per unknown, same shape."""
        return np.asarray(self.shift + (points - self.centre) @ self.turn.T)

    def viscous(self, damping: RayleighDamping) -> float:
        """Return the damping beside what material damping makes of mass and stiffness [N s/m] or [N m s]."""
        return self.damping - damping.mass * self.mass - damping.stiffness * self.stiffness


def rigid_freedoms(model: Model) -> tuple[RigidFreedom, ...]:
    """Return the free directions of all rigid bodies of a checked model, those of drives first."""
    dim = model.mesh.dim()
    drives = [
        RigidFreedom(
            body=None,
            direction=None,
            faces=(number,),
            shift=contact.counterface.unit_normal,
            turn=np.zeros((dim, dim)),
            centre=np.zeros(dim),
            mass=contact.drive.mass,
            loads=((contact.drive.force, contact.drive.ramp),),
        )
        for number, contact in enumerate(model.contacts)
        if contact.drive
    ]
    bodies = [
        _freedom(model, name, direction)
        for name, body in model.bodies.items()
        for direction in directions_in(dim)
        if direction in body.free
    ]
    return (*drives, *bodies)


def _freedom(model: Model, name: str, direction: Direction) -> RigidFreedom:
    body = model.bodies[name]
    dim, axis = model.mesh.dim(), DIRECTIONS.index(direction)
    turns = axis >= 3
    shift, turn = np.eye(dim)[axis] if not turns else np.zeros(dim), np.zeros((dim, dim))
    if turns:
        # The matrix of the cross product with a unit vector; in 2D that about z.
        turn = np.cross(np.eye(3)[axis - 3], np.eye(3)).T[:dim, :dim]
    loads = [(getattr(load, direction), load.ramp) for load in body.loads]
    if model.gravity is not None and not turns:
        loads.append((body.mass * model.gravity[axis], body.filling))
    return RigidFreedom(
        body=name,
        direction=direction,
        faces=faces_of(model, name),
        shift=shift,
        turn=turn,
        centre=np.zeros(dim) if body.centre is None else np.asarray(body.centre, dtype=float),
        mass=body.inertia[-1 if dim == 2 else axis - 3] if turns else body.mass,
        stiffness=body.stiffness(direction),
        damping=body.damping(direction),
        velocity=body.velocity(direction),
        loads=tuple((value, ramp) for value, ramp in loads if value),
    )


def faces_of(model: Model, name: str) -> tuple[int, ...]:
    """Return the indices of the counterfaces on a rigid body."""
    return tuple(number for number, contact in enumerate(model.contacts) if contact.rigid_body == name)


def body_centres(model: Model) -> tuple[Floats, Floats]:
    """Return the centres of the rigid bodies, (n_bodies, dim) [m], and of the body of each contact, else the origin."""
    dim = model.mesh.dim()
    centres = {name: body.centre or (0.0,) * dim for name, body in model.bodies.items()}
    bodies = (contact.rigid_body for contact in model.contacts)
    of_contacts = [(0.0,) * dim if name is None else centres[name] for name in bodies]
    of_bodies = np.reshape(list(centres.values()), (-1, dim))
    return of_bodies.astype(float), np.reshape(of_contacts, (-1, dim)).astype(float)


def programme_place(model: Model, number: int) -> str:
    """Return where the programme of a contact stands: that of the rigid body that it is on, its own or the model's."""
    contact = model.contacts[number]
    if contact.rigid_body is not None:
        return f"bodies.{contact.rigid_body}.programme"
    return "programme" if contact.programme is None else f"contacts.{number}.programme"


def contact_motion(model: Model, number: int) -> Motion:
    """Return the prescribed motion of a contact's counterface: that of the rigid body that it is on, or its own."""
    contact, programme, where = model.contacts[number], model.programmes[number], programme_place(model, number)
    if contact.rigid_body is None:
        return counterface_motion(programme, contact.counterface, where)
    first = model.contacts[faces_of(model, contact.rigid_body)[0]]
    motion = counterface_motion(programme, first.counterface, where)
    for direction in model.bodies[contact.rigid_body].free:
        axis = DIRECTIONS.index(direction)
        if axis < 3 and np.abs(motion.positions[:, axis]).max() > _ZERO * np.abs(motion.positions).max():
            raise InputError(where, f"moves the body along {direction}", f"the body is free along {direction}")
    return motion


def check_bodies(model: Model) -> None:
    """Refuse rigid bodies that cannot be computed."""
    dim, directions = model.mesh.dim(), directions_in(model.mesh.dim())
    for name, body in model.bodies.items():
        where = f"bodies.{name}"
        beyond = [direction for direction in body.free if direction not in directions]
        if beyond:
            fault = f"got '{beyond[0]}' in {dim} dimensions"
            raise InputError(f"{where}.free", fault, f"needs {', '.join(directions)}")
        if body.centre is not None:
            require_components(f"{where}.centre", body.centre, dim)
        needed = 1 if dim == 2 else 3
        if body.inertia and len(body.inertia) != needed:
            raise InputError(f"{where}.inertia", f"got {len(body.inertia)} values", f"needs {needed}")
        if body.programme and not faces_of(model, name):
            fault = "is given for a body that no counterface is on"
            raise InputError(
                f"{where}.programme", fault, "needs the normal of one", f"write 'rigid_body: {name}' in a contact"
            )
        if not has_inertia(model):
            _check_held(where, body, [model.contacts[number] for number in faces_of(model, name)])


def _check_held(where: str, body: RigidBody, contacts: Sequence[Contact]) -> None:
    """Refuse a body without inertia that nothing can hold, and one with a velocity."""
    if any(map(body.velocity, body.free)):
        fault = "is given for a model without inertia"
        raise InputError(f"{where}.initial_velocity", fault, "needs steps with inertia", "take TimeStepping")
    loose = [direction for direction in _unheld(body) if not any(_resists(contact, direction) for contact in contacts)]
    if loose:
        fault = f"nothing holds the body in {', '.join(loose)}"
        allowed = "a spring, a damper or a contact has to hold it in steps without inertia"
        raise InputError(f"{where}.free", fault, allowed, "hold it, or take TimeStepping")


def _resists(contact: Contact, direction: Direction) -> bool:
    """Tell whether a contact can resist motion of its counterface in a direction."""
    axis, shape = DIRECTIONS.index(direction), contact.counterface
    facing = axis >= 3 or not shape.is_flat or abs(shape.unit_normal[axis]) > _ZERO
    return bool(facing or contact.friction.coefficient > 0.0)


def _unheld(body: RigidBody) -> list[Direction]:
    """Return the free directions in which neither spring nor damper holds a body."""
    return [direction for direction in body.free if not (body.stiffness(direction) or body.damping(direction))]


def unheld_bodies(bodies: Mapping[str, RigidBody]) -> tuple[str, ...]:
    """Return the bodies that nothing but contact holds, each with its directions, as errors name them."""
    loose = {name: _unheld(body) for name, body in bodies.items()}
    return tuple(f"rigid body '{name}' ({', '.join(directions)})" for name, directions in loose.items() if directions)
