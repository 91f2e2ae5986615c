"""Laws of large strain that relax: held shear and tension, both limits, small loads, and a turn of 360 degrees.

A body that is strained within one step and held has, in quasi-linear viscoelasticity, the elastic stress of its shape
times the response R(t) of the Prony series to a ramp of one step, and the elastic pressure of its volume. In simple
shear by dead loads the volume stays, so that all of the stress is R(t) of the elastic; in tension of a material that
is hardly compressible likewise.
"""

from dataclasses import replace

import numpy as np
from scipy import integrate

import fingerslip as fs
from fingerslip.verification.meshes import axes_of
from fingerslip.verification.problem import Problem, absolute, relative, solve_problem
from fingerslip.verification.viscoelastic import ramp_response
from problems.blocks import difference
from problems.verification.large_laws import (
    BODIES,
    CASES,
    LENGTH,
    body_model,
    moved_top,
    pulled,
    sheared,
    small_limit,
    stress_row,
    turned,
)
from problems.verification.large_motion import PAIRS

_TERMS = (fs.PronyTerm(0.3, 0.1), fs.PronyTerm(0.25, 0.4))
_STEP, _END = 0.05, 1.0


def relaxing(law, terms=_TERMS):
    """Return a law with Prony terms."""
    return replace(law, prony=terms)


def relaxed_law(law, share):
    """Return the elastic law that is left when a share of the energy of the shape has relaxed."""
    left = 1.0 - share
    match law:
        case fs.NeoHookean():
            bulk = law.first_lame + 2.0 * law.shear_modulus / 3.0
            shear = left * law.shear_modulus
            ratio = (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear)
            return fs.NeoHookean(9.0 * bulk * shear / (3.0 * bulk + shear), ratio, law.density)
        case fs.MooneyRivlin():
            return replace(law, c10=left * law.c10, c01=left * law.c01, bulk_modulus=law.bulk, poisson_ratio=None)
        case fs.Ogden():
            terms = tuple(replace(term, modulus=left * term.modulus) for term in law.terms)
            return replace(law, terms=terms, bulk_modulus=law.bulk, poisson_ratio=None)
    raise ValueError(f"no law of this file: {law}")


_TIME = fs.QuasiStatic(_STEP, end=_END)
_AT_ONCE = fs.Ramp((0.0, _STEP), (0.0, 1.0))


def _held_shear(body, case, amount):
    """Return the errors of Cauchy stress and forces of a body that is sheared within a step and held, over the largest.

    The dead loads on its sides follow the closed form as well.
    """
    times = np.linspace(0.0, _END, round(_END / _STEP) + 1)
    response = ramp_response(_TERMS, _STEP, times)
    fields, state = sheared(body, case, amount, fs.Ramp(tuple(times.tolist()), tuple(response.tolist())))
    fields |= moved_top(body, amount * LENGTH, 0.0, _AT_ONCE)
    history = solve_problem(body_model(body, relaxing(case.law), time=_TIME, **fields))
    expected = response[:, None] * stress_row(state.cauchy, body.dim)
    force = response * state.nominal[0, body.dim - 1] * LENGTH**2
    held = history["support_force"].sel(support="top").values[:, 0]
    return difference(history["stress"].values[:, 0], expected), difference(held, force)


def _shear(case):
    """Shear by a half within a step and hold: what is left is ten times the tolerance of Newton's method.

    Plane stress is left out: there the volume changes, which the next problem has.
    """
    bodies = [body for body in BODIES if body.formulation != "plane_stress"]
    worst = np.max([_held_shear(body, case, 0.5) for body in bodies], axis=0)
    for name, error in zip(("Cauchy stress", "force of the support"), worst, strict=True):
        yield absolute(f"{name}, largest error / largest", 0.0, float(error), 1e-5)


_SOFT = 10e3
_OGDEN = CASES[2].law  # type: ignore[assignment]


def _nearly_incompressible(ratio):
    """Return the laws with a Poisson's ratio at rest [-]."""
    return (
        fs.NeoHookean(2.0 * _SOFT * (1.0 + ratio), ratio, 1000.0),
        fs.MooneyRivlin(0.4 * _SOFT, 1000.0, 0.1 * _SOFT, poisson_ratio=ratio),
        replace(_OGDEN, bulk_modulus=None, poisson_ratio=ratio),
    )


_PLANE_STRESS = tuple(body for body in BODIES if body.formulation == "plane_stress")
_3D = tuple(body for body in BODIES if body.formulation == "solid" and body.integration != "full")


def _missed(history, expected):
    """Return the largest error of the force that pulls, over the largest expected [-]."""
    return difference(history["support_force"].sel(support="right").values[:, 0], expected)


def _nominal(law, stretch):
    """Return the nominal stresses [Pa] in tension of an incompressible law, at stretches (n,)."""
    strain = np.log(stretch)[:, None] * [1.0, -0.5, -0.5]
    kirchhoff = law.kirchhoff_stress(strain)
    return np.asarray((kirchhoff[:, 0] - kirchhoff[:, 1]) / stretch)


def _tension(law):
    """Pull by half of the length within a step and hold.

    With Poisson's ratio of 0.49995 the volume still changes by some 1e-4, and with it the section and its stress.
    """
    elastic = float(_nominal(law, np.array([1.5]))[0]) * LENGTH**2
    histories = [pulled(body, relaxing(law), 1.5, ramp=_AT_ONCE, time=_TIME) for body in _PLANE_STRESS]
    expected = elastic * ramp_response(_TERMS, _STEP, histories[0]["time"].values)
    worst = max(_missed(history, expected) for history in histories) * np.abs(expected).max() / elastic
    yield absolute("force, largest error / elastic", 0.0, worst, 1e-3)


def _superposed(law, stretch, times):
    """Return the nominal stress [Pa] in tension at times (n,), from the integral of the law by Simpson's rule.

    In an incompressible body pulled by x(t), the deviator A has the components (a, b, b) with its trace with C zero, so
    that b = -a x^3/2, and what dashpots leave of its history makes the nominal stress x D(a) - D(b)/x^2 with ::

        D(a) = g(0) a(t) + int g'(s) a(t - s) ds
    """

    def parts(at):
        x = stretch(at)
        strain = np.log(x)[:, None] * [1.0, -0.5, -0.5]
        kirchhoff = law.kirchhoff_stress(strain)
        own = kirchhoff - kirchhoff.mean(axis=1, keepdims=True)
        return np.stack([own[:, 0] / x**2, own[:, 1] * x])

    def at_time(time):
        # An even number of intervals, the shortest relaxation time in fifty or more.
        past = np.linspace(0.0, time, 2 * max(200, round(100 * time / min(term.time for term in _TERMS))) + 1)
        rate = sum((-term.share / term.time * np.exp(-past / term.time) for term in _TERMS), np.zeros_like(past))
        of_history = parts(time - past)
        own, beside = of_history[:, 0] + integrate.simpson(of_history * rate, x=past)
        x = float(stretch(np.array([time]))[0])
        return x * own - beside / x**2

    return np.array([at_time(time) if time > 0.0 else 0.0 for time in times])


def _swung(body, law, step):
    """Return the largest error of the force that pulls to and fro by a third of the length, over the largest force."""
    knots = step * np.arange(round(_END / step) + 1)
    ramp = fs.Ramp(tuple(knots.tolist()), tuple((0.5 - 0.5 * np.cos(2 * np.pi * knots)).tolist()))
    history = pulled(body, relaxing(law), 4.0 / 3.0, ramp=ramp, time=fs.QuasiStatic(step, end=_END))
    times = history["time"].values
    expected = LENGTH**2 * _superposed(law, lambda t: 1.0 + (0.5 - 0.5 * np.cos(2 * np.pi * t)) / 3.0, times)
    return _missed(history, expected)


def _order(law, softer):
    """Pull to and fro by a third of the length.

    In plane stress with Poisson's ratio of 0.49995, the error is of second order in the step but for 1e-5. In 3D the
    ratio is 0.499, as larger ones need smaller steps: then the volume leaves 1e-3.
    """
    errors = [_swung(_PLANE_STRESS[0], law, step) for step in (0.05, 0.025)]
    yield absolute("plane stress, force, largest error / largest", 0.0, errors[1], 2e-3)
    yield absolute("plane stress, order in the step", 2.0, float(np.log2(errors[0] / errors[1])), 0.1)
    in_3d = max(_swung(body, softer, 0.025) for body in _3D)
    yield absolute("in 3D, force, largest error / largest", 0.0, in_3d, 5e-3)


def _bent(body, law, kinematics, amount, *, slow=False, still=True):
    """Return the force of the top over time that is moved aside and down within a second, over the largest [-]."""
    end = 4.0 if slow else _END
    time = fs.QuasiStatic(0.1 if slow else _STEP, end=end) if still else fs.TimeStepping(_STEP, alpha=-0.1, end=end)
    moved = moved_top(body, amount * LENGTH, -0.5 * amount * LENGTH, fs.Ramp((0.0, 0.5), (0.0, 1.0)))
    supports = dict.fromkeys(("bottom", "top"), axes_of(body.element))
    model = body_model(body, law, supports=supports, kinematics=kinematics, time=time, **moved)
    return np.asarray(fs.simulate(model)["support_force"].sel(support="top").values)


def _limits():
    """Relax a million times later than the end, or twenty times sooner than it, on strain that is not uniform.

    What is left are the share of the time that has passed, or exp(-70), and the tolerance of Newton's method.
    """
    late, early = [], []
    for number, (body, case) in enumerate(PAIRS.values()):
        law, still = case.law, number % 2 == 0
        elastic = _bent(body, law, "finite", 0.3, still=still)
        bent = _bent(body, relaxing(law, (fs.PronyTerm(0.6, 1e7),)), "finite", 0.3, still=still)
        late.append(difference(bent, elastic))
        rest = _bent(body, relaxed_law(law, 0.6), "finite", 0.3, slow=True)[-1]
        bent = _bent(body, relaxing(law, (fs.PronyTerm(0.6, 0.05),)), "finite", 0.3, slow=True)[-1]
        early.append(difference(bent, rest))
    yield absolute("relaxed long after the end: force, largest difference / elastic force", 0.0, max(late), 1e-5)
    name = "relaxed long before the end: force, difference / force of the relaxed law"
    yield absolute(name, 0.0, max(early), 1e-5)


def _small(body, case):
    """Compare with Prony terms at small strain over loads that give strains of 4, 2 and 1 %."""
    law = relaxing(case.law)
    small = _bent(body, law, "small", 1.0)
    yield small_limit(lambda amount: _bent(body, law, "finite", amount), small, np.array([4e-2, 2e-2, 1e-2]))


def _objectivity():
    """Strain a body at random in twelve steps, each turned by 30 degrees more: rounding."""
    worst = np.zeros(3)
    for body in BODIES:
        generator, nodes = np.random.default_rng(5), body.mesh().doflocs.shape[::-1]
        shapes = [generator.uniform(-0.06, 0.06, nodes) * LENGTH for _ in range(12)]
        for case in CASES:
            worst = np.maximum(worst, turned(body, relaxing(case.law), shapes))
    for name, error in zip(("change of energy / energy", "forces / largest"), worst[:2], strict=True):
        yield absolute(name, 0.0, float(error), 1e-11)


def _balance():
    """Strain a block and let go: the energy of its springs in the end is that of the relaxed law, the rest is lost."""
    body, law = _3D[0], CASES[2].law
    laws = relaxing(law, (fs.PronyTerm(0.6, 0.05),)), relaxed_law(law, 0.6)
    history, elastic = (pulled(body, own, 1.5, ramp=fs.Ramp((0.0, 0.2), (0.0, 1.0)), time=_TIME) for own in laws)
    stored, lost = history["strain_energy"].values, history["viscous_dissipation"].values
    shares = (
        stored[-1] / elastic["strain_energy"].values[-1],
        (stored[-1] + lost[-1]) / history["external_work"].values[-1],
    )
    yield relative("stored in the end / by the relaxed law", 1.0, shares[0], 1e-5)
    yield relative("stored and lost / work", 1.0, shares[1], 1e-6)
    yield absolute("largest gain of a step / work", 0.0, max(0.0, -np.diff(lost).min()) / lost[-1], 1e-6)


_SIMO, _TURNED = "Simo 1987", "A body that relaxes, turned by 360 degrees"
_HARD, _SOFTER = _nearly_incompressible(0.49995), _nearly_incompressible(0.499)
_LAWS = {case.name: (case,) for case in CASES}
_PULLED = {type(law).__name__: (law,) for law in _HARD}
_SWUNG = {type(law).__name__: (law, softer) for law, softer in zip(_HARD, _SOFTER, strict=True)}
_SPRINGS = "energy of the relaxed law"
PROBLEMS = (
    Problem("large-relaxation-shear", "Shear by a half, held", _SIMO, _shear, _LAWS),
    Problem("large-relaxation-tension", "Tension by half, held", _SIMO, _tension, _PULLED),
    Problem("large-relaxation-order", "Tension to and fro", "integral of the law", _order, _SWUNG),
    Problem("large-relaxation-limits", "Relaxation far later and far sooner", "elastic laws", _limits),
    Problem("large-relaxation-small", "Small loads on bodies that relax", "small strain", _small, PAIRS, slow=True),
    Problem("large-relaxation-turned", _TURNED, "Truesdell & Noll 1965", _objectivity),
    Problem("large-relaxation-energy", "What springs store and dashpots take", _SPRINGS, _balance),
)
