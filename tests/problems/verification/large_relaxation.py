"""Laws of large strain that relax: held shear and tension, both limits, small loads, and a turn of 360 degrees.

A body that is strained within one step and held has, in quasi-linear viscoelasticity, the elastic stress of its shape
times the response R(t) of the Prony series to a ramp of one step, and the elastic pressure of its volume. In simple
shear by dead loads the volume stays, so that all of the stress is R(t) of the elastic; in tension of a material that
is hardly compressible likewise.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.dynamics.simulation import simulate
from fingerslip.fe.cell_materials import finite_cell_materials
from fingerslip.fe.finite.bulk import large_strain
from fingerslip.fe.space import build_space
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden
from fingerslip.materials.prony import Prony, PronyTerm
from fingerslip.model.model import Component, Kinematics, Model, Recording, SupportMotion, Traction
from fingerslip.model.programme import Ramp
from fingerslip.model.timing import QuasiStatic, TimeStepping
from fingerslip.sites import Site
from fingerslip.verification.problem import Check, Problem, absolute, relative, solve_problem
from fingerslip.verification.viscoelastic import ramp_response
from problems.verification.large_laws import BODIES, CASES, LENGTH, Body, Case, components, rotation, uniform

__all__ = ["PROBLEMS", "relaxed_law", "relaxing"]

Array = NDArray[np.float64]

_TERMS: Prony = (PronyTerm(0.3, 0.1), PronyTerm(0.25, 0.4))
_STEP, _END = 0.05, 1.0
_AXES: tuple[Component, ...] = ("x", "y", "z")


def relaxing(law: Any, terms: Prony = _TERMS) -> Any:
    """Return a law with Prony terms."""
    return replace(law, prony=terms)


def relaxed_law(law: FiniteMaterial, share: float) -> FiniteMaterial:
    """Return the elastic law that is left when a share of the energy of the shape has relaxed."""
    left = 1.0 - share
    match law:
        case NeoHookean():
            bulk = law.first_lame + 2.0 * law.shear_modulus / 3.0
            shear = left * law.shear_modulus
            young, ratio = (
                9.0 * bulk * shear / (3.0 * bulk + shear),
                (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear),
            )
            return NeoHookean(young, ratio, law.density)
        case MooneyRivlin():
            return replace(law, c10=left * law.c10, c01=left * law.c01, bulk_modulus=law.bulk, poisson_ratio=None)
        case Ogden():
            terms = tuple(replace(term, modulus=left * term.modulus) for term in law.terms)
            return replace(law, terms=terms, bulk_modulus=law.bulk, poisson_ratio=None)
    raise ValueError(f"no law of this file: {law}")


def _model(body: Body, law: FiniteMaterial, **others: Any) -> Model:
    values: dict[str, Any] = {
        "mesh": body.mesh(),
        "materials": {"bulk": law},
        "formulation": body.formulation,
        "integration": body.integration,
        "kinematics": "finite",
        "time": QuasiStatic(_STEP, end=_END),
        "record": Recording(sites=(Site("corner", "", (LENGTH,) * body.dim),)),
        "depth": 1.0 if body.dim == 3 else LENGTH,
    }
    return Model(**{**values, **others})


_AT_ONCE = Ramp((0.0, _STEP), (0.0, 1.0))


def _held_shear(body: Body, case: Case, amount: float) -> tuple[float, float]:
    """Return the errors of Cauchy stress and forces of a body that is sheared within a step and held, over the largest.

    The dead loads on its sides follow the closed form as well.
    """
    gradient = np.eye(3)
    gradient[0, body.dim - 1] = amount
    known = uniform(case, gradient, (2,) if body.formulation == "plane_stress" else ())
    times: Array = np.linspace(0.0, _END, round(_END / _STEP) + 1)
    response = ramp_response(_TERMS, _STEP, times)
    follows = Ramp(tuple(times.tolist()), tuple(response.tolist()))
    sides = {"left": (0, -1), "right": (0, 1)}
    sides |= {"front": (1, -1), "back": (1, 1)} if body.dim == 3 else {}
    loads = {
        side: Traction(tuple(sign * known.nominal[: body.dim, axis]), follows) for side, (axis, sign) in sides.items()
    }
    moved = (amount * LENGTH, *(0.0,) * (body.dim - 1))
    history = solve_problem(
        _model(
            body,
            relaxing(case.law),
            supports=dict.fromkeys(("bottom", "top"), _AXES[: body.dim]),
            support_motions={"top": SupportMotion(moved, _AT_ONCE)},
            tractions=loads,
        )
    )
    expected = response[:, None] * components(known.cauchy, body.dim)
    stress = np.abs(history["stress"].values[:, 0] - expected).max() / np.abs(expected).max()
    force = response * known.nominal[0, body.dim - 1] * LENGTH**2
    found = history["support_force"].sel(support="top").values[:, 0]
    return float(stress), float(np.abs(found - force).max() / np.abs(force).max())


def _shear() -> tuple[Check, ...]:
    """Shear by a half within a step and hold: what is left is ten times the tolerance of Newton's method.

    Plane stress is left out: there the volume changes, which the next problem has.
    """
    checks = []
    for case in CASES:
        bodies = [body for body in BODIES if body.formulation != "plane_stress"]
        worst = np.max([_held_shear(body, case, 0.5) for body in bodies], axis=0)
        names = ("Cauchy stress", "force of the support")
        checks += [
            absolute(f"{case.name}: {name}, largest error / largest", 0.0, float(error), 1e-5)
            for name, error in zip(names, worst, strict=True)
        ]
    return tuple(checks)


_SOFT = 10e3
_OGDEN: Ogden = CASES[2].law  # type: ignore[assignment]


def _nearly_incompressible(ratio: float) -> tuple[FiniteMaterial, ...]:
    """Return the laws with a Poisson's ratio at rest [-]."""
    return (
        NeoHookean(2.0 * _SOFT * (1.0 + ratio), ratio, 1000.0),
        MooneyRivlin(0.4 * _SOFT, 1000.0, 0.1 * _SOFT, poisson_ratio=ratio),
        replace(_OGDEN, bulk_modulus=None, poisson_ratio=ratio),
    )


_PLANE_STRESS = tuple(body for body in BODIES if body.formulation == "plane_stress")
_3D = tuple(body for body in BODIES if body.formulation == "solid" and body.integration != "full")


def _pulled(body: Body, law: FiniteMaterial, stretch: float, ramp: Ramp, step: float = _STEP) -> xr.Dataset:
    """Pull a body along x, free to become thinner."""
    low = ("left", "bottom") if body.dim == 2 else ("left", "front", "bottom")
    supports = {side: (axis,) for side, axis in zip((*low, "right"), (*_AXES[: body.dim], "x"), strict=True)}
    moved = ((stretch - 1.0) * LENGTH, *(0.0,) * (body.dim - 1))
    time = QuasiStatic(step, end=_END)
    motions = {"right": SupportMotion(moved, ramp)}
    return solve_problem(_model(body, law, supports=supports, support_motions=motions, time=time))


def _nominal(law: FiniteMaterial, stretch: Array) -> Array:
    """Return the nominal stresses [Pa] in tension of an incompressible law, at stretches (n,)."""
    strain = np.log(stretch)[:, None] * [1.0, -0.5, -0.5]
    kirchhoff = law.kirchhoff_stress(strain)
    found: Array = (kirchhoff[:, 0] - kirchhoff[:, 1]) / stretch
    return found


def _tension() -> tuple[Check, ...]:
    """Pull by half of the length within a step and hold.

    With Poisson's ratio of 0.49995 the volume still changes by some 1e-4, and with it the section and its stress.
    """
    checks = []
    for law in _nearly_incompressible(0.49995):
        errors = []
        for body in _PLANE_STRESS:
            history = _pulled(body, relaxing(law), 1.5, _AT_ONCE)
            elastic = float(_nominal(law, np.array([1.5]))[0]) * LENGTH**2
            expected = elastic * ramp_response(_TERMS, _STEP, history["time"].values)
            force = history["support_force"].sel(support="right").values[:, 0]
            errors.append(float(np.abs(force - expected).max() / elastic))
        name = type(law).__name__
        checks.append(absolute(f"{name}: force, largest error / elastic", 0.0, max(errors), 1e-3))
    return tuple(checks)


def _superposed(law: FiniteMaterial, stretch: Any, times: Array) -> Array:
    """Return the nominal stress [Pa] in tension at times (n,), from the integral of the law by Simpson's rule.

    In an incompressible body pulled by x(t), the deviator A has the components (a, b, b) with its trace with C zero, so
    that b = -a x^3/2, and what dashpots leave of its history makes the nominal stress x D(a) - D(b)/x^2 with ::

        D(a) = g(0) a(t) + int g'(s) a(t - s) ds
    """

    def parts(at: Array) -> Array:
        x = stretch(at)
        strain = np.log(x)[:, None] * [1.0, -0.5, -0.5]
        kirchhoff = law.kirchhoff_stress(strain)
        own = kirchhoff - kirchhoff.mean(axis=1, keepdims=True)
        return np.stack([own[:, 0] / x**2, own[:, 1] * x])

    found = np.zeros_like(times)
    for number, time in enumerate(times):
        # An even number of intervals, the shortest relaxation time in fifty or more.
        count = 2 * max(200, round(100 * time / min(term.time for term in _TERMS)))
        past = np.linspace(0.0, time, count + 1)
        rate = sum((-term.share / term.time * np.exp(-past / term.time) for term in _TERMS), np.zeros_like(past))
        simpson = np.ones(count + 1)
        simpson[1:-1:2], simpson[2:-1:2] = 4.0, 2.0
        of_history = parts(time - past)
        own, beside = of_history[:, 0] + (of_history * rate * simpson).sum(axis=1) * time / count / 3.0
        x = float(stretch(np.array([time]))[0])
        found[number] = x * own - beside / x**2
    return found


def _swung(body: Body, law: FiniteMaterial, step: float) -> float:
    """Return the largest error of the force that pulls to and fro by a third of the length, over the largest force."""
    knots = step * np.arange(round(_END / step) + 1)
    ramp = Ramp(tuple(knots.tolist()), tuple((0.5 - 0.5 * np.cos(2 * np.pi * knots)).tolist()))
    history = _pulled(body, relaxing(law), 4.0 / 3.0, ramp, step)
    times = history["time"].values
    expected = LENGTH**2 * _superposed(law, lambda t: 1.0 + (0.5 - 0.5 * np.cos(2 * np.pi * t)) / 3.0, times)
    force = history["support_force"].sel(support="right").values[:, 0]
    return float(np.abs(force - expected).max() / np.abs(expected).max())


def _order() -> tuple[Check, ...]:
    """Pull to and fro by a third of the length.

    In plane stress with Poisson's ratio of 0.49995, the error is of second order in the step but for 1e-5. In 3D the
    ratio is 0.499, as larger ones need smaller steps: then the volume leaves 1e-3.
    """
    checks = []
    for law, softer in zip(_nearly_incompressible(0.49995), _nearly_incompressible(0.499), strict=True):
        name, errors = type(law).__name__, [_swung(_PLANE_STRESS[0], law, step) for step in (0.05, 0.025)]
        in_3d = max(_swung(body, softer, 0.025) for body in _3D)
        checks += [
            absolute(f"{name}: plane stress, force, largest error / largest", 0.0, errors[1], 2e-3),
            absolute(f"{name}: plane stress, order in the step", 2.0, float(np.log2(errors[0] / errors[1])), 0.1),
            absolute(f"{name}: in 3D, force, largest error / largest", 0.0, in_3d, 5e-3),
        ]
    return tuple(checks)


def _bent(
    body: Body, law: FiniteMaterial, kinematics: Kinematics, amount: float, *, slow: bool = False, still: bool = True
) -> Array:
    """Return the force of the top over time that is moved aside and down within a second, over the largest [-]."""
    shift = np.zeros(body.dim)
    shift[0], shift[-1] = amount * LENGTH, -0.5 * amount * LENGTH
    ramp = Ramp((0.0, 0.5), (0.0, 1.0))
    end = 4.0 if slow else _END
    time = QuasiStatic(0.1 if slow else _STEP, end=end) if still else TimeStepping(_STEP, alpha=-0.1, end=end)
    model = _model(
        body,
        law,
        supports=dict.fromkeys(("bottom", "top"), _AXES[: body.dim]),
        support_motions={"top": SupportMotion(tuple(shift.tolist()), ramp)},
        kinematics=kinematics,
        time=time,
    )
    found: Array = simulate(model)["support_force"].sel(support="top").values
    return found


def _limits() -> tuple[Check, ...]:
    """Relax a million times later than the end, or twenty times sooner than it, on strain that is not uniform.

    What is left are the share of the time that has passed, or exp(-70), and the tolerance of Newton's method.
    """
    late, early = [], []
    for number, body in enumerate(BODIES):
        law = CASES[number % len(CASES)].law
        elastic = _bent(body, law, "finite", 0.3, still=number % 2 == 0)
        found = _bent(body, relaxing(law, (PronyTerm(0.6, 1e7),)), "finite", 0.3, still=number % 2 == 0)
        late.append(np.abs(found - elastic).max() / np.abs(elastic).max())
        rest = _bent(body, relaxed_law(law, 0.6), "finite", 0.3, slow=True)[-1]
        found = _bent(body, relaxing(law, (PronyTerm(0.6, 0.05),)), "finite", 0.3, slow=True)[-1]
        early.append(np.abs(found - rest).max() / np.abs(rest).max())
    return (
        absolute("relaxed long after the end: force, largest difference / elastic force", 0.0, max(late), 1e-5),
        absolute("relaxed long before the end: force, difference / force of the relaxed law", 0.0, max(early), 1e-5),
    )


def _small() -> tuple[Check, ...]:
    """Fit the order of the difference to Prony terms at small strain over loads that give strains of 4, 2 and 1 %."""
    amounts = np.array([4e-2, 2e-2, 1e-2])
    checks = []
    for number, body in enumerate(BODIES):
        case = CASES[number % len(CASES)]
        law = relaxing(case.law)
        small = _bent(body, law, "small", 1.0)
        errors = [np.abs(_bent(body, law, "finite", own) - own * small).max() for own in amounts]
        order = float(np.polyfit(np.log(amounts), np.log(errors), 1)[0])
        checks.append(absolute(f"{body.name}, {case.name}: order of the difference", 2.0, order, 0.1))
    return tuple(checks)


def _turned(body: Body, law: FiniteMaterial) -> Array:
    """Return by how much energy and forces of a body that relaxes change where every step turns it, each relative."""
    space = build_space(body.mesh())
    bulk = large_strain(space, finite_cell_materials(space, {"bulk": law}, body.formulation), 1.0, body.integration)
    start, steps = space.positions, 12
    generator = np.random.default_rng(5)
    shapes = [start + generator.uniform(-0.06, 0.06, start.shape) * LENGTH for _ in range(steps)]
    still = turning = bulk.at_rest(_STEP)
    errors = []
    for number, shape in enumerate(shapes, start=1):
        turn = rotation(np.deg2rad(30.0 * number), body.dim)
        still = bulk.ended(bulk.deformed((shape - start).ravel(), bulk.begun(still, _STEP)))
        turning = bulk.ended(bulk.deformed((shape @ turn.T - start).ravel(), bulk.begun(turning, _STEP)))
        force, turned = (bulk.force(state).reshape(start.shape) for state in (still, turning))
        energy = bulk.energy(still)
        errors.append(
            [abs(bulk.energy(turning) / energy - 1.0), np.abs(turned @ turn - force).max() / np.abs(force).max()]
        )
    worst: Array = np.max(errors, axis=0)
    return worst


def _objectivity() -> tuple[Check, ...]:
    """Strain a body at random in twelve steps, each turned by 30 degrees more: rounding."""
    worst = np.max([_turned(body, relaxing(case.law)) for body in BODIES for case in CASES], axis=0)
    names = ("change of energy / energy", "forces / largest")
    return tuple(absolute(name, 0.0, float(error), 1e-11) for name, error in zip(names, worst, strict=True))


def _balance() -> tuple[Check, ...]:
    """Strain a block and let go: the energy of its springs in the end is that of the relaxed law, the rest is lost."""
    body, law = _3D[0], CASES[2].law
    history = _pulled(body, relaxing(law, (PronyTerm(0.6, 0.05),)), 1.5, Ramp((0.0, 0.2), (0.0, 1.0)))
    elastic = _pulled(body, relaxed_law(law, 0.6), 1.5, Ramp((0.0, 0.2), (0.0, 1.0)))
    stored, lost = history["strain_energy"].values, history["viscous_dissipation"].values
    return (
        relative("stored in the end / by the relaxed law", 1.0, stored[-1] / elastic["strain_energy"].values[-1], 1e-5),
        relative("stored and lost / work", 1.0, (stored[-1] + lost[-1]) / history["external_work"].values[-1], 1e-6),
        absolute("largest gain of a step / work", 0.0, max(0.0, -np.diff(lost).min()) / lost[-1], 1e-6),
    )


_SIMO = "Simo 1987"
PROBLEMS = (
    Problem("large-relaxation-shear", "Shear by a half, held", _SIMO, slow=False, compute=_shear),
    Problem("large-relaxation-tension", "Tension by half, held", _SIMO, slow=False, compute=_tension),
    Problem("large-relaxation-order", "Tension to and fro", "integral of the law", slow=False, compute=_order),
    Problem("large-relaxation-limits", "Relaxation far later and far sooner", "elastic laws", False, _limits),
    Problem("large-relaxation-small", "Small loads on bodies that relax", "small strain", True, _small),
    Problem(
        "large-relaxation-turned",
        "A body that relaxes, turned by 360 degrees",
        "Truesdell & Noll 1965",
        False,
        _objectivity,
    ),
    Problem(
        "large-relaxation-energy", "What springs store and dashpots take", "energy of the relaxed law", False, _balance
    ),
)
