"""Laws of large strain that relax: held shear and tension, both limits, small loads, and a turn of 360 degrees.

A body that is strained within one step and held has, in quasi-linear viscoelasticity, the elastic stress of its shape
times the response R(t) of the Prony series to a ramp of one step, and the elastic pressure of its volume. In simple
shear by dead loads the volume stays, so that all of the stress is R(t) of the elastic; in tension of a material that
is hardly compressible likewise.
"""

from dataclasses import replace

import numpy as np

import fingerslip as fs
from fingerslip.fe.cell_materials import finite_cell_materials
from fingerslip.fe.finite.bulk import large_strain
from fingerslip.fe.space import build_space
from fingerslip.verification.meshes import SIDES, axes_of, components
from fingerslip.verification.problem import Problem, absolute, relative, solve_problem
from fingerslip.verification.viscoelastic import ramp_response
from problems.verification.large_laws import BODIES, CASES, LENGTH, body_model, moved_top, rotation, sheared, stress_row
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
    stress = np.abs(history["stress"].values[:, 0] - expected).max() / np.abs(expected).max()
    force = response * state.nominal[0, body.dim - 1] * LENGTH**2
    missed = np.abs(history["support_force"].sel(support="top").values[:, 0] - force).max()
    return float(stress), float(missed / np.abs(force).max())


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


def _pulled(body, law, stretch, ramp, step=_STEP):
    """Pull a body along x, free to become thinner."""
    supports = {low: (axis,) for (low, _), axis in zip(SIDES[body.dim], axes_of(body.element), strict=True)}
    moved = components(body.element, (stretch - 1.0) * LENGTH, 0.0, 0.0)
    fields = {"supports": supports | {"right": ("x",)}, "time": fs.QuasiStatic(step, end=_END)}
    return solve_problem(body_model(body, law, support_motions={"right": fs.SupportMotion(moved, ramp)}, **fields))


def _missed(history, expected):
    """Return the largest error of the force that pulls [N]."""
    return float(np.abs(history["support_force"].sel(support="right").values[:, 0] - expected).max())


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
    errors = []
    for body in _PLANE_STRESS:
        history = _pulled(body, relaxing(law), 1.5, _AT_ONCE)
        expected = elastic * ramp_response(_TERMS, _STEP, history["time"].values)
        errors.append(_missed(history, expected) / elastic)
    yield absolute("force, largest error / elastic", 0.0, max(errors), 1e-3)


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


def _swung(body, law, step):
    """Return the largest error of the force that pulls to and fro by a third of the length, over the largest force."""
    knots = step * np.arange(round(_END / step) + 1)
    ramp = fs.Ramp(tuple(knots.tolist()), tuple((0.5 - 0.5 * np.cos(2 * np.pi * knots)).tolist()))
    history = _pulled(body, relaxing(law), 4.0 / 3.0, ramp, step)
    times = history["time"].values
    expected = LENGTH**2 * _superposed(law, lambda t: 1.0 + (0.5 - 0.5 * np.cos(2 * np.pi * t)) / 3.0, times)
    return _missed(history, expected) / float(np.abs(expected).max())


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
        late.append(np.abs(bent - elastic).max() / np.abs(elastic).max())
        rest = _bent(body, relaxed_law(law, 0.6), "finite", 0.3, slow=True)[-1]
        bent = _bent(body, relaxing(law, (fs.PronyTerm(0.6, 0.05),)), "finite", 0.3, slow=True)[-1]
        early.append(np.abs(bent - rest).max() / np.abs(rest).max())
    yield absolute("relaxed long after the end: force, largest difference / elastic force", 0.0, max(late), 1e-5)
    name = "relaxed long before the end: force, difference / force of the relaxed law"
    yield absolute(name, 0.0, max(early), 1e-5)


def _small(body, case):
    """Fit the order of the difference to Prony terms at small strain over loads that give strains of 4, 2 and 1 %."""
    amounts, law = np.array([4e-2, 2e-2, 1e-2]), relaxing(case.law)
    small = _bent(body, law, "small", 1.0)
    errors = [np.abs(_bent(body, law, "finite", amount) - amount * small).max() for amount in amounts]
    order = float(np.polyfit(np.log(amounts), np.log(errors), 1)[0])
    yield absolute("order of the difference", 2.0, order, 0.1)


def _turned(body, law):
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
    return np.asarray(np.max(errors, axis=0))


def _objectivity():
    """Strain a body at random in twelve steps, each turned by 30 degrees more: rounding."""
    worst = np.max([_turned(body, relaxing(case.law)) for body in BODIES for case in CASES], axis=0)
    for name, error in zip(("change of energy / energy", "forces / largest"), worst, strict=True):
        yield absolute(name, 0.0, float(error), 1e-11)


def _balance():
    """Strain a block and let go: the energy of its springs in the end is that of the relaxed law, the rest is lost."""
    body, law = _3D[0], CASES[2].law
    history = _pulled(body, relaxing(law, (fs.PronyTerm(0.6, 0.05),)), 1.5, fs.Ramp((0.0, 0.2), (0.0, 1.0)))
    elastic = _pulled(body, relaxed_law(law, 0.6), 1.5, fs.Ramp((0.0, 0.2), (0.0, 1.0)))
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
