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

from dataclasses import dataclass

import numpy as np
from scipy import optimize

import fingerslip as fs
from fingerslip.verification.line import HALF_WIDTH, RADIUS, line_model
from fingerslip.verification.meshes import box, grade
from fingerslip.verification.problem import Problem, absolute, solve_problem

_TERMS = (fs.PronyTerm(0.4, 0.2), fs.PronyTerm(0.3, 2.0))
_PRESS, _HOLD, _LIFT = 1.0, 0.5, 1.0


@dataclass(frozen=True)
class Pressed:
    """A press, a hold and a lift at the same speed."""

    depth: float  # largest approach [m]

    @property
    def programme(self):
        """The phases."""
        return fs.Press(self.depth, self.depth / _PRESS), fs.Hold(_HOLD), fs.Lift(self.depth, self.depth / _LIFT)

    def approach(self, time):
        """Return the approach at times (n,) [s], shape (n,) [m]."""
        shares = (0.0, _PRESS, _PRESS + _HOLD, _PRESS + _HOLD + _LIFT), (0.0, 1.0, 1.0, 0.0)
        return self.depth * np.interp(time, *shares)


def _integral(time):
    """Return the integral of g from 0 to times (n,) [s]; none before 0."""
    found = np.maximum(np.asarray(time, dtype=float), 0.0)
    past = found.copy()
    for term in _TERMS:
        found = found - term.share * (past + term.time * np.expm1(-past / term.time))
    return found


def forgotten_since(time):
    """Return the time t_1 [s] up to which a body remembers its contact at a time [s]; 0 where contact has ended."""
    lifted = time - _PRESS - _HOLD
    if lifted <= 0.0:
        return min(time, _PRESS)

    def left(since):
        grown = float(_integral(time - since) - _integral(time - _PRESS)) / _PRESS
        return grown - float(_integral(lifted)) / _LIFT

    return 0.0 if left(0.0) <= 0.0 else float(optimize.brentq(left, 0.0, _PRESS))


def remembered_force(elastic, time):
    """Return the force [N] at a time [s] from the elastic force (n,) [N] at times (n,) [s] of the press."""
    knots = np.linspace(0.0, forgotten_since(time), 401)
    relaxed = _integral(time - knots[:-1]) - _integral(time - knots[1:])
    length = np.maximum(np.diff(knots), 1e-300)
    return float((np.diff(elastic(knots)) * relaxed / length).sum())


def _computed(model):
    """Return the histories of a body that does not relax and of one that does."""
    return solve_problem(model(())), solve_problem(model(_TERMS))


def _forces(histories):
    """Return times [s], and the elastic force, that with relaxation and what it should be from the elastic one [N]."""
    elastic, viscous = (history["counterface_force"].values[:, 0, -1] for history in histories)
    times = histories[0]["time"].values
    expected = [remembered_force(lambda at: np.interp(at, times, elastic), float(time)) for time in times]
    return times, elastic, viscous, np.array(expected)


def _phases(times):
    lifting = times > _PRESS + _HOLD + 1e-9
    return {"pressed and held": ~lifting, "lifted": lifting}


def _line():
    """Press a cylinder on a block, hold and lift it."""
    pressed, cells = Pressed(3e-6), 16
    size = HALF_WIDTH / cells
    face, programme = fs.Cylinder(RADIUS), pressed.programme
    histories = _computed(
        lambda prony: line_model("Q4", lambda x: 0.0 * x, face, programme, cells=cells, mu=0.0, prony=prony)
    )
    times, elastic, viscous, expected = _forces(histories)
    for name, phase in _phases(times).items():
        error = float(np.abs(viscous - expected)[phase].max() / elastic.max())
        yield absolute(f"{name}: force, largest error / largest elastic force", 0.0, error, 1e-3)
    # Half the width of the nodes that press, half a cell beside them included.
    widths = [0.5 * size * (history["normal_traction"].values > 0.0).sum(axis=1) for history in histories]
    wanted = np.interp([forgotten_since(float(time)) for time in times], times, widths[0])
    touching = expected > 0.02 * elastic.max()
    apart = float(np.abs(widths[1] - wanted)[touching].max() / size)
    yield absolute("half width of contact, largest error / cell", 0.0, apart, 1.0)
    yield absolute("approach at which contact ends / largest", *_parting(pressed, times, viscous), 1.0 / 40)


def _parting(pressed, times, force):
    """Return the expected approach at which contact ends and the computed one, over the largest [-]."""
    start, end = _PRESS + _HOLD, _PRESS + _HOLD + _LIFT
    grown = float(_integral(start) - _integral(start - _PRESS))
    assert grown > 0.0  # the body remembers the press when it is lifted

    def left(time):
        whole = float(_integral(time) - _integral(time - _PRESS)) / _PRESS
        return whole - float(_integral(time - start)) / _LIFT

    expected = float(optimize.brentq(left, start, end))
    last = times[np.flatnonzero(force > 0.0)[-1]]
    there, here = pressed.approach(np.array([expected, last])) / pressed.depth
    return float(there), float(here)


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
        programme=Pressed(_APPROACH).programme,
        time=fs.QuasiStatic(1.0 / 20),
    )


def _sphere():
    """Press a ball on a quarter of a block, hold and lift it: beside its own elastic force, and beside Hertz's."""
    times, elastic, viscous, expected = _forces(_computed(lambda prony: _ball_model(8, prony)))
    stiffness = 4.0 / 3.0 * _MODULUS / (1.0 - _RATIO**2) * np.sqrt(_BALL) / 4.0
    pressed = Pressed(_APPROACH)
    hertz = [remembered_force(lambda at: stiffness * pressed.approach(at) ** 1.5, float(time)) for time in times]
    largest = float(stiffness * _APPROACH**1.5)
    for name, phase in _phases(times).items():
        errors = np.abs(viscous - expected)[phase].max() / elastic.max(), np.abs(viscous - hertz)[phase].max() / largest
        yield absolute(f"{name}: force, largest error / largest elastic force", 0.0, float(errors[0]), 1e-3)
        yield absolute(f"{name}: force, largest error / largest force of Hertz", 0.0, float(errors[1]), 0.02)
    yield absolute("approach at which contact ends / largest", *_parting(pressed, times, viscous), 1.0 / 20)


_BALL_SOURCE = "Lee & Radok 1960; Ting 1966"
PROBLEMS = (
    Problem("viscous-line", "Cylinder pressed, held and lifted", "Ting 1966", _line),
    Problem("viscous-sphere", "Ball pressed, held and lifted", _BALL_SOURCE, _sphere, slow=True),
)
