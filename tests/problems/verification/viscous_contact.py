"""Contact of bodies that relax, while the contact grows, stays and shrinks: Lee & Radok and Ting.

A rigid body with the approach h(t) presses on a body whose moduli all relax by g(t), which an incompressible one does.
While contact grows or stays, the force is the elastic one with each growth of it relaxed since (Lee & Radok 1960).
While it shrinks, the contact area is that of an earlier time t_1 of its growth, and what came later is forgotten (Ting
1966) ::

    int_(t_1)^t g(t - s) dh(s) = 0,    P(t) = int_0^(t_1) g(t - s) dP_e(h(s))

Contact ends where t_1 = 0, before the rigid body is back, as the surface follows slowly. The first condition says that
what the surface inside the contact has moved since t_1 is forgotten as well, so both hold for bodies of any size and
for cylinders, too, with the elastic force P_e of the same body.

Tolerances: beside the elastic force of the same mesh, what is left is Poisson's ratio of 0.4999 and penalties that do
not relax, each 1e-4 and the same on finer meshes, so that 1e-3 is allowed. Beside Hertz's force of a ball on a
half-space, the block of 200 contact radii and its cells, each half as large again as the one before, are 1.2 % too
stiff: 1.7 % with half the size, 1.1 % more with cells that grow by 1.8, and cells of 1/6 to 1/12 of the contact radius
change 0.2 %. So 2 % are allowed. The half width of contact is known to a cell, and the end of contact to a step.
"""

import numpy as np
from scipy import optimize

import fingerslip as fs
from fingerslip.verification.line import HALF_WIDTH, RADIUS, line_model
from fingerslip.verification.meshes import box, grade
from fingerslip.verification.problem import Problem, absolute, largest, solve_problem
from fingerslip.verification.viscoelastic import response_integral

_TERMS = (fs.PronyTerm(0.4, 0.2), fs.PronyTerm(0.3, 2.0))
_PRESS, _HOLD, _LIFT = 1.0, 0.5, 1.0


_START, _END = _PRESS + _HOLD, _PRESS + _HOLD + _LIFT


def _programme(depth):
    """Return a press, a hold and a lift at the same speed."""
    return fs.Press(depth, depth / _PRESS), fs.Hold(_HOLD), fs.Lift(depth, depth / _LIFT)


def _approach(time):
    """Return the approach at times (n,) [s] over the largest, shape (n,) [-]."""
    return np.interp(time, (0.0, _PRESS, _START, _END), (0.0, 1.0, 1.0, 0.0))


def _integral(time):
    """Return the integral of g from 0 to times (n,) [s]; none before 0."""
    return response_integral(_TERMS, np.maximum(np.asarray(time, dtype=float), 0.0))


def _remembered(since, time):
    """Return the integral of the first condition from a time of the press to one of the lift [s], over the depth."""
    grown = float(_integral(time - since) - _integral(time - _PRESS)) / _PRESS
    return grown - float(_integral(time - _START)) / _LIFT


def forgotten_since(time):
    """Return the time t_1 [s] up to which a body remembers its contact at a time [s]; 0 where contact has ended."""
    if time <= _START:
        return min(time, _PRESS)
    if _remembered(0.0, time) <= 0.0:
        return 0.0
    return float(optimize.brentq(_remembered, 0.0, _PRESS, args=(time,)))


def remembered_force(elastic, time):
    """Return the force [N] at a time [s] from the elastic force (n,) [N] at times (n,) [s] of the press."""
    knots = np.linspace(0.0, forgotten_since(time), 401)
    relaxed = _integral(time - knots[:-1]) - _integral(time - knots[1:])
    length = np.maximum(np.diff(knots), 1e-300)
    return float((np.diff(elastic(knots)) * relaxed / length).sum())


def _computed(model):
    """Return histories of a body that does not relax and one that does, times, their forces, and what the latter is."""
    histories = solve_problem(model(())), solve_problem(model(_TERMS))
    elastic, viscous = (history["counterface_force"].values[:, 0, -1] for history in histories)
    times = histories[0]["time"].values
    expected = [remembered_force(lambda at: np.interp(at, times, elastic), float(time)) for time in times]
    return histories, times, elastic, viscous, np.array(expected)


def _phases(times):
    lifting = times > _START + 1e-9
    return {"pressed and held": ~lifting, "lifted": lifting}


_FORCE = "force, largest error / largest elastic force"


def _line():
    """Press a cylinder on a block, hold and lift it."""
    cells, face, programme = 16, fs.Cylinder(RADIUS), _programme(3e-6)
    size = HALF_WIDTH / cells
    histories, times, elastic, viscous, expected = _computed(
        lambda prony: line_model("Q4", lambda x: 0.0 * x, face, programme, cells=cells, mu=0.0, prony=prony)
    )
    for name, phase in _phases(times).items():
        yield largest(f"{name}: {_FORCE}", expected[phase], viscous[phase], 1e-3, elastic.max())
    # Half the width of the nodes that press, half a cell beside them included.
    widths = [0.5 * size * (history["normal_traction"].values > 0.0).sum(axis=1) for history in histories]
    wanted = np.interp([forgotten_since(float(time)) for time in times], times, widths[0])
    touching = expected > 0.02 * elastic.max()
    yield largest("half width of contact, largest error / cell", wanted[touching], widths[1][touching], 1.0, size)
    yield _parting(times, viscous, 1.0 / 40)


def _parting(times, force, allowed):
    """Return the check of the approach at which contact ends, over the largest [-]."""
    assert _remembered(0.0, _START) > 0.0  # the body remembers the press when it is lifted
    expected = float(optimize.brentq(lambda time: _remembered(0.0, time), _START, _END))
    last = times[np.flatnonzero(force > 0.0)[-1]]
    return absolute("approach at which contact ends / largest", *_approach(np.array([expected, last])), allowed)


_MODULUS, _RATIO = 1e5, 0.4999
_CONTACT_RADIUS, _BALL = 1e-3, 50e-3
_APPROACH = _CONTACT_RADIUS**2 / _BALL
_OUTER, _GROWTH = 200 * _CONTACT_RADIUS, 1.5


def _ball_model(cells, prony):
    """Return a ball that is pressed on a quarter of a block, held and lifted, with `cells` in the contact radius."""
    size = _CONTACT_RADIUS / cells
    along = grade(1.25 * _CONTACT_RADIUS, size, _OUTER, _GROWTH)
    heights = grade(0.75 * _CONTACT_RADIUS, size, _OUTER, _GROWTH)
    contact = fs.Contact(
        boundary="bottom",
        counterface=fs.Sphere(_BALL, centre=(0.0, 0.0, -_BALL)),
        friction=fs.Coulomb(0.0),
        normal_penalty=1e3 * _MODULUS / size,
        tangential_penalty=1e3 * _MODULUS / size,
        search_distance=(1.25 * _CONTACT_RADIUS) ** 2 / (2 * _BALL),
    )
    return fs.Model(
        mesh=box("H8", along, along, heights),
        materials={"bulk": fs.Elastic(_MODULUS, _RATIO, 1000.0, prony=prony)},
        formulation="solid",
        supports={"top": ("x", "y", "z"), "left": ("x",), "front": ("y",)},
        contacts=(contact,),
        programme=_programme(_APPROACH),
        time=fs.QuasiStatic(1.0 / 20),
    )


def _sphere():
    """Press a ball on a quarter of a block, hold and lift it: beside its own elastic force, and beside Hertz's."""
    _, times, elastic, viscous, expected = _computed(lambda prony: _ball_model(8, prony))
    highest = float(4.0 / 3.0 * _MODULUS / (1.0 - _RATIO**2) * np.sqrt(_BALL) / 4.0 * _APPROACH**1.5)
    hertz = np.array([remembered_force(lambda at: highest * _approach(at) ** 1.5, float(time)) for time in times])
    for name, phase in _phases(times).items():
        of_hertz = f"{name}: force, largest error / largest force of Hertz"
        yield largest(f"{name}: {_FORCE}", expected[phase], viscous[phase], 1e-3, elastic.max())
        yield largest(of_hertz, hertz[phase], viscous[phase], 0.02, highest)
    yield _parting(times, viscous, 1.0 / 20)


_SOURCE = "Lee & Radok 1960; Ting 1966"
PROBLEMS = (
    Problem("viscous-line", "Cylinder pressed, held and lifted", "Ting 1966", _line),
    Problem("viscous-sphere", "Ball pressed, held and lifted", _SOURCE, _sphere, slow=True),
)
