"""Laws of large strain on small distorted meshes of every element: stretched, sheared, and turned round once."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import optimize
from scipy.spatial.transform import Rotation

import fingerslip as fs
from fingerslip.fe.cell_materials import finite_cell_materials
from fingerslip.fe.finite.bulk import large_strain
from fingerslip.fe.space import build_space
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.material import SHEARS
from fingerslip.verification.meshes import SIDES, axes_of, box, components, jiggle
from fingerslip.verification.problem import Problem, absolute, solve_problem
from problems.blocks import KINDS, difference, fitted_slope

#: Size of the bodies [m].
LENGTH, _MODULUS = 1e-2, 10e3
RAMP = fs.Ramp((0.0, 1.0), (0.0, 1.0))


@dataclass(frozen=True)
class Case:
    """A law, and its energy as its source prints it."""

    law: FiniteMaterial
    energy: Callable[[np.ndarray], complex]  # per reference volume [J/m^3], of the three principal stretches

    @property
    def name(self):
        return type(self.law).__name__

    def stress(self, stretches):
        """Return the nominal principal stresses [Pa] at stretches (3,): the derivative by a complex step."""
        return np.array([self.energy(stretches + 1e-30j * axis).imag / 1e-30 for axis in np.eye(3)])


def _neo_hookean(shear, lame):
    """Return G/2 (I_1 - 3) - G ln J + lambda/2 (ln J)^2 (Bonet & Wood 2008)."""
    return lambda x: 0.5 * shear * ((x**2).sum() - 3) - shear * np.log(x.prod()) + 0.5 * lame * np.log(x.prod()) ** 2


def _mooney_rivlin(first, second, bulk):
    """Return c10 (I_1 J^(-2/3) - 3) + c01 (I_2 J^(-4/3) - 3) + K/2 (ln J)^2 (Rivlin 1948)."""

    def energy(x):
        volume, squares = x.prod(), x**2
        of_pairs = squares[0] * squares[1] + squares[1] * squares[2] + squares[2] * squares[0]
        shape = first * (squares.sum() * volume ** (-2 / 3) - 3) + second * (of_pairs * volume ** (-4 / 3) - 3)
        return shape + 0.5 * bulk * np.log(volume) ** 2

    return energy


def _ogden(terms, bulk):
    """Return sum mu/alpha (sum (J^(-1/3) lambda)^alpha - 3) + K/2 (ln J)^2 (Ogden 1972)."""

    def energy(x):
        volume = x.prod()
        isochoric = x * volume ** (-1 / 3)
        shape = sum(own.modulus / own.exponent * ((isochoric**own.exponent).sum() - 3) for own in terms)
        return shape + 0.5 * bulk * np.log(volume) ** 2

    return energy


_TERMS = (fs.OgdenTerm(2.0 * _MODULUS, 1.3), fs.OgdenTerm(0.05 * _MODULUS, 5.0), fs.OgdenTerm(-0.1 * _MODULUS, -2.0))
CASES = (
    Case(fs.NeoHookean(2.96 * _MODULUS, 0.48, 1000.0), _neo_hookean(_MODULUS, 24.0 * _MODULUS)),
    Case(
        fs.MooneyRivlin(0.4 * _MODULUS, 1000.0, 0.1 * _MODULUS, bulk_modulus=50 * _MODULUS),
        _mooney_rivlin(0.4 * _MODULUS, 0.1 * _MODULUS, 50 * _MODULUS),
    ),
    Case(fs.Ogden(_TERMS, 1000.0, bulk_modulus=20 * _MODULUS), _ogden(_TERMS, 20 * _MODULUS)),
)


@dataclass(frozen=True)
class Body:
    """A distorted square or cube of 10 mm: its kind of element, how it is integrated, and the formulation."""

    element: str
    integration: str
    formulation: str

    @property
    def dim(self):
        return 3 if self.formulation == "solid" else 2

    @property
    def name(self):
        return f"{self.element} {self.integration} {self.formulation}"

    def bulk(self, law):
        """Return the body of a law, as integrators see it."""
        space = build_space(self.mesh())
        materials = finite_cell_materials(space, {"bulk": law}, self.formulation)
        return large_strain(space, materials, 1.0, self.integration)

    def mesh(self):
        return box(self.element, *[np.linspace(0.0, LENGTH, 3)] * self.dim, shift=jiggle(0.2))


BODIES = tuple(Body(*kind) for kind in KINDS)


@dataclass(frozen=True)
class Uniform:
    """What a uniform deformation gives: gradient F (3, 3), nominal stress P (3, 3) [Pa], energy density [J/m^3]."""

    gradient: np.ndarray
    nominal: np.ndarray
    density: float

    @property
    def cauchy(self):
        """Cauchy stress [Pa], shape (3, 3)."""
        return np.asarray(self.nominal @ self.gradient.T / np.linalg.det(self.gradient))


def _expected(case, gradient):
    """Return what a deformation gradient (3, 3) gives, by its singular values."""
    left, stretches, right = np.linalg.svd(gradient)
    return Uniform(
        gradient, left @ np.diag(case.stress(stretches)) @ right, float(case.energy(stretches.astype(complex)).real)
    )


def uniform(case, gradient, free):
    """Return what a gradient gives whose diagonal elements `free` are such that their nominal stress vanishes."""

    def filled(values):
        full = gradient.copy()
        full[free, free] = values
        return full

    def missed(values):
        return _expected(case, filled(values)).nominal[free, free] / _MODULUS

    start = np.ones(len(free))
    return _expected(case, filled(optimize.fsolve(missed, start, xtol=1e-12) if free else start))


def stress_row(full, dim):
    """Return a stress (3, 3) as histories have it."""
    return np.array([*np.diag(full), *(full[pair] for pair in SHEARS[dim])])


def pulled(body, law, stretch, *, axes=1, ramp=RAMP, **changes):
    """Pull a body along one or two axes, by supports that leave the other directions free."""
    low, high = zip(*SIDES[body.dim], strict=True)
    supports = {side: (axis,) for side, axis in zip(low, "xyz", strict=False)}
    supports |= {high[number]: ("xyz"[number],) for number in range(axes)}
    ways = (stretch - 1.0) * LENGTH * np.eye(body.dim)
    motions = {high[number]: fs.SupportMotion(tuple(ways[number]), ramp) for number in range(axes)}
    return solve_problem(body_model(body, law, supports=supports, support_motions=motions, **changes))


def _stretched(body, case, stretch, axes):
    gradient = np.diag([stretch, stretch if axes == 2 else 1.0, 1.0])
    free = (() if axes == 2 else (1,)) + (() if body.formulation == "plane_strain" else (2,))
    return pulled(body, case.law, stretch, axes=axes), uniform(case, gradient, free)


def sheared(body, case, amount, factors):
    """Return what moves and loads a body in simple shear: its top by supports, its other sides by dead loads."""
    gradient = np.eye(3)
    gradient[0, body.dim - 1] = amount
    state = uniform(case, gradient, (2,) if body.formulation == "plane_stress" else ())
    loads = {
        side: fs.Traction(tuple(sign * state.nominal[: body.dim, axis]), factors)
        for axis, sides in enumerate(SIDES[body.dim][:-1])
        for side, sign in zip(sides, (-1, 1), strict=True)
    }
    supports = dict.fromkeys(("bottom", "top"), axes_of(body.element))
    return {"supports": supports, "tractions": loads}, state


def moved_top(body, along, up, ramp):
    """Return the motion of the top of a body along x and upwards [m]."""
    return {"support_motions": {"top": fs.SupportMotion(components(body.element, along, 0.0, up), ramp)}}


def body_model(body, law, **changes):
    """Return the model of a body of one law, of which one corner is recorded."""
    values = {
        "mesh": body.mesh(),
        "materials": {"bulk": law},
        "formulation": body.formulation,
        "integration": body.integration,
        "kinematics": "finite",
        "time": fs.QuasiStatic(0.25, end=1.0),
        "record": fs.Recording(sites=(fs.Site("corner", "", (LENGTH,) * body.dim),)),
        "depth": 1.0 if body.dim == 3 else LENGTH,
    }
    return fs.Model(**(values | changes))


def _errors(body, history, expected):
    """Return the errors of Cauchy stress, of the forces of the supports and of the energy, over the largest of each."""
    force = np.zeros_like(history["support_force"].values[-1])
    for number, side in enumerate(history["support"].values):
        axis = {"left": 0, "right": 0, "front": 1, "back": 1}.get(side, body.dim - 1)
        sign = -1.0 if side in {"left", "front", "bottom"} else 1.0
        force[number] = sign * expected.nominal[: body.dim, axis] * LENGTH**2
    computed = history["support_force"].values[-1]
    held = np.abs(computed).max(axis=1) > 0.0
    return (
        difference(history["stress"].values[-1, 0], stress_row(expected.cauchy, body.dim)),
        difference(computed[held], force[held]),
        difference(history["strain_energy"].values[-1], expected.density * LENGTH**3),
    )


def _uniform_strain(of, case):
    """Uniform strain is in every element's space: what is left is ten times the tolerance of Newton's method."""
    worst = np.max([_errors(body, *of(body, case)) for body in BODIES], axis=0)
    for name, error in zip(("Cauchy stress", "force of a support", "strain energy"), worst, strict=True):
        yield absolute(f"{name}, largest error / largest", 0.0, float(error), 1e-5)


def _sheared(body, case):
    fields, state = sheared(body, case, 0.5, RAMP)
    return solve_problem(body_model(body, case.law, **fields, **moved_top(body, 0.5 * LENGTH, 0.0, RAMP))), state


def turned(body, law, shapes):
    """Return by how much a body that every step turns by 30 degrees differs from one that takes its shapes unturned.

    That is the largest difference of energy, forces and stiffness, each relative (3,); shapes are displacements of the
    nodes (n_steps, n_nodes, dim) [m].
    """
    bulk, errors, step = body.bulk(law), [], 0.05
    start = bulk.space.positions
    still = turning = bulk.at_rest(step)
    for number, shape in enumerate(shapes, start=1):
        turn = rotation(np.deg2rad(30.0 * number), body.dim)
        still = bulk.ended(bulk.deformed(shape.ravel(), bulk.begun(still, step)))
        displacement = ((start + shape) @ turn.T - start).ravel()
        turning = bulk.ended(bulk.deformed(displacement, bulk.begun(turning, step)))
        every = np.kron(np.eye(len(start)), turn)
        pairs = (
            (bulk.energy(turning), bulk.energy(still)),
            (every.T @ bulk.force(turning).ravel(), bulk.force(still).ravel()),
            (every.T @ bulk.tangent(turning).toarray() @ every, bulk.tangent(still).toarray()),
        )
        errors.append([difference(*pair) for pair in pairs])
    return np.max(errors, axis=0)


def rotation(angle, dim):
    """Return the rotation about z, or in 3D about (1, 1, 1)."""
    axis = np.array([0.0, 0.0, 1.0]) if dim == 2 else np.full(3, 1.0 / np.sqrt(3.0))
    return Rotation.from_rotvec(angle * axis).as_matrix()[:dim, :dim]


def _objectivity():
    """Turn a body at random strains of 16 % by 360 degrees: rounding.

    The stiffness has quotients of differences of stresses, which lose five digits where stretches are nearly alike.
    """
    worst = np.zeros(3)
    for body in BODIES:
        start = body.mesh().doflocs.T
        strained = np.random.default_rng(3).uniform(-0.08, 0.08, start.shape) * LENGTH
        for case in CASES:
            worst = np.maximum(worst, turned(body, case.law, [strained] * 12))
    allowed = {"change of energy / energy": 1e-12, "forces / largest": 1e-12, "stiffness / largest": 1e-9}
    for (name, limit), error in zip(allowed.items(), worst, strict=True):
        yield absolute(name, 0.0, float(error), limit)


def small_limit(deform, small, amounts):
    """Return the check of the order in which a body that is deformed by amounts (n,) leaves small strain.

    The next term of the series is a few per cent of it: 0.1 is allowed.
    """
    errors = [np.abs(deform(amount) - amount * small).max() for amount in amounts]
    return absolute("order of the difference", 2.0, fitted_slope(amounts, errors), 0.1)


def _each_law(of):
    """Return a case for each law."""
    return {case.name: (of, case) for case in CASES}


_UNIAXIAL = _each_law(lambda body, case: _stretched(body, case, 1.5, 1))
_BIAXIAL = _each_law(lambda body, case: _stretched(body, case, 1.3, 2))
PROBLEMS = (
    Problem("large-tension", "Tension by half of every law and element", "Ogden 1984", _uniform_strain, _UNIAXIAL),
    Problem("large-biaxial", "Equal tension along two axes", "Ogden 1984", _uniform_strain, _BIAXIAL),
    Problem("large-shear", "Simple shear by dead loads", "Rivlin 1948", _uniform_strain, _each_law(_sheared)),
    Problem("objectivity", "A strained body turned by 360 degrees", "Truesdell & Noll 1965", _objectivity),
)
