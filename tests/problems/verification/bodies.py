"""Rigid bodies that are free: set sliding, filled, on a spring, falling through a damper, and turning.

Fingers are blocks whose nodes are held along the surface, without Poisson's effect: a squeeze by s gives the uniform
pressure s / (L / E + 1 / k_n), and friction is that of Coulomb's law on known normal forces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.mesh.joining import join_meshes
from fingerslip.model.model import Contact, Model, SupportMotion
from fingerslip.model.programme import Hold, Press, Ramp
from fingerslip.model.rigid_bodies import BodyLoad, BodyVelocity, Dampers, RigidBody, Springs
from fingerslip.model.timing import QuasiStatic, TimeStepping
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, absolute, relative, solve_problem

__all__ = ["PROBLEMS"]

Array = NDArray[np.float64]

_ELEMENTS = ("Q4", "H8")
_SIZE, _MODULUS, _PENALTY, _MU, _GRAVITY = 10e-3, 1e5, 1e9, 0.5, 9.81
_AREA = _SIZE**2


def _up(element: str) -> tuple[float, ...]:
    return (0.0, 1.0) if element == "Q4" else (0.0, 0.0, 1.0)


def _plane(element: str) -> dict[str, Any]:
    """Return the formulation, with a depth in the plane that makes its areas those in 3D."""
    if element == "Q4":
        return {"formulation": "plane_strain", "depth": _SIZE}
    return {"formulation": "solid"}


def _pad(element: str, modulus: float, *axes: Array) -> dict[str, Any]:
    """Return what a model of a pad that is held at its lower side and along its surface consists of."""
    along: tuple[str, ...] = ("x",) if element == "Q4" else ("x", "y")
    return {
        "mesh": box(element, *axes),
        "materials": {"bulk": Elastic(modulus, 0.0, 1.0)},
        "supports": {"bottom": _axes(element), "bulk": along},
        **_plane(element),
    }


def _axes(element: str) -> tuple[str, ...]:
    return ("x", "y") if element == "Q4" else ("x", "y", "z")


def _slide(element: str) -> tuple[Check, ...]:
    """Let a block of 0.1 kg slide on a stiff pad under its weight from 1 m/s.

    The weight acts at once: the block's bounce, 1/omega = 1 ms long at a contact stiffness of 1e5 N/m, may shift the
    stop by 0.5 % of 0.2 s.
    """
    speed, mass = 1.0, 0.1
    grid, height = np.linspace(0.0, _SIZE, 3), np.linspace(0.0, 2e-3, 2)
    sides = (grid,) * (1 if element == "Q4" else 2)
    down = tuple(-component for component in _up(element))
    vertical: Any = _axes(element)[-1]
    contact = Contact("top", Plane(down), Coulomb(_MU), _PENALTY, _PENALTY, rigid_body="block")
    block = RigidBody(mass, free=("x", vertical), initial_velocity=BodyVelocity(x=speed))
    stop = speed / (_MU * _GRAVITY)
    model = Model(
        **_pad(element, 1e9, *sides, height),
        contacts=(contact,),
        bodies={"block": block},
        gravity=tuple(_GRAVITY * component for component in down),
        time=TimeStepping(2e-4, end=0.22),
    )
    history = solve_problem(model)
    time, moved = history["time"].values, history["rigid_body_displacement"].values[:, 0, 0]
    rate = history["rigid_body_velocity"].values[:, 0, 0]
    first = int(np.argmax(rate <= 0.0))
    stopped = float(np.interp(0.0, rate[[first, first - 1]], time[[first, first - 1]]))
    return (
        relative("time to stop [s]", stop, stopped, 0.005),
        relative("way to stop [m]", speed * stop / 2, float(moved[-1]), 0.005),
        relative("friction / energy at the start", 1.0, _friction(history, mass, speed), 0.005),
    )


def _friction(history: xr.Dataset, mass: float, speed: float) -> float:
    return float(history["friction_dissipation"].values[-1]) / (0.5 * mass * speed**2)


_SQUEEZE, _CLOSED = 1e-3, 0.02
# Normal force of each finger.
_FORCE = _AREA * _SQUEEZE / (_SIZE / _MODULUS + 1.0 / _PENALTY)
_GRIP = 2 * _MU * _FORCE
_TANGENTIAL = 2 * _PENALTY * _AREA


def _gripped(element: str, body: RigidBody, **changes: Any) -> xr.Dataset:
    """Return the history of a body between two fingers that close on it in 20 ms."""
    axes = _axes(element)
    high = np.linspace(-_SIZE / 2, _SIZE / 2, 3)
    across = [] if element == "Q4" else [high]
    sides = {"left": np.linspace(-3 * _SIZE / 2, -_SIZE / 2, 3), "right": np.linspace(_SIZE / 2, 3 * _SIZE / 2, 3)}
    still = (0.0,) * (len(axes) - 1)
    closing, values = Ramp((0.0, _CLOSED), (0.0, 1.0)), _supported(axes)
    law, penalties = Coulomb(_MU), (_PENALTY, _PENALTY)
    model = Model(
        mesh=join_meshes({name: box(element, along, *across, high) for name, along in sides.items()}),
        materials=dict.fromkeys(("left_bulk", "right_bulk"), Elastic(_MODULUS, 0.0, 100.0)),
        **_plane(element),
        supports=values,
        support_motions={
            "left_left": SupportMotion((_SQUEEZE, *still), closing),
            "right_right": SupportMotion((-_SQUEEZE, *still), closing),
        },
        contacts=(
            Contact("left_right", Plane((-1.0, *still)), law, *penalties, rigid_body="body"),
            Contact("right_left", Plane((1.0, *still)), law, *penalties, rigid_body="body"),
        ),
        bodies={"body": body},
        damping=RayleighDamping(mass=2e3),
        **changes,
    )
    return solve_problem(model)


def _supported(axes: tuple[str, ...]) -> Mapping[str, Any]:
    """Hold the fingers' backs, and all of them along the surface of the body."""
    return {"left_left": ("x",), "right_right": ("x",), "left_bulk": axes[1:], "right_bulk": axes[1:]}


def _jug(element: str) -> tuple[Check, ...]:
    """Fill a jug, 1.25 times as heavy as two fingers can hold, in 0.5 s.

    On the springs of stick friction, with omega = 1e3 rad/s, the growing weight makes ripples of 1/(omega 0.5 s) =
    2e-3 of itself: 0.5 %. Once it is full, it slides on at a constant acceleration.
    """
    mass, filled, end = 1.25 * _GRIP / _GRAVITY, 0.55, 0.65
    vertical: Any = _axes(element)[-1]
    jug = RigidBody(mass, free=("x", vertical), filling=Ramp((0.05, filled), (0.0, 1.0)))
    down = tuple(-_GRAVITY * component for component in _up(element))
    history = _gripped(element, jug, gravity=down, time=TimeStepping(5e-4, end=end))
    time, used = history["time"].values, history["friction_utilisation"].values
    slides = float(time[np.argmax(used.min(axis=1) > 1.0 - 1e-6)])
    weight = mass * _GRAVITY * (slides - 0.05) / (filled - 0.05)
    late = time > filled + 0.02
    falls = -float(np.polyfit(time[late], history["rigid_body_velocity"].values[late, 0, -1], 1)[0])
    aside = float(np.abs(history["rigid_body_displacement"].values[:, 0, 0]).max())
    held = history.isel(time=int(np.searchsorted(time, 0.3)))
    return (
        relative("normal force of a finger [N]", _FORCE, _normal(history), 1e-4),
        relative("weight at which it slides / (2 mu N)", 1.0, weight / _GRIP, 0.005),
        relative("acceleration when full [m/s2]", _GRAVITY - _GRIP / mass, falls, 2e-3),
        relative("utilisation at 0.3 s", 0.5 * 1.25, float(held["friction_utilisation"][0]), 0.01),
        absolute("motion along the squeeze / squeeze", 0.0, aside / _SQUEEZE, 1e-9),
    )


def _normal(history: xr.Dataset) -> float:
    """Return the normal force of a finger at the end [N]."""
    return float(history["counterface_force"].values[-1, 1, 0])


def _sprung(element: str) -> tuple[Check, ...]:
    """Pull a block on a spring against the friction of two fingers, and let it go: it loses 2 F/k every half cycle.

    The friction springs stretch by F/k_t = 1e-3 F/k at each turn, and 500 steps a cycle at alpha = -0.01 take less than
    1e-3 of the amplitude, up to seven times F/k: 0.5 %. Turning takes the friction springs some time: 1 % of a cycle.
    When the block stops, they throw it back by up to 1e-2 F/k: 2 %.
    """
    stiffness = _TANGENTIAL / 1e3
    mass = stiffness / (2 * np.pi / 0.1) ** 2
    drop = _GRIP / stiffness
    pull = 7.3 * _GRIP
    checks: list[Check] = []
    vertical: Any = _axes(element)[-1]
    ramp = Ramp((0.0, 0.1, 0.3, 0.4, 0.4002), (0.0, 0.0, 1.0, 1.0, 0.0))
    block = RigidBody(
        mass,
        free=(vertical,),
        springs=Springs(**{vertical: stiffness}),
        loads=(BodyLoad(**{vertical: pull}, ramp=ramp),),
    )
    history = _gripped(element, block, time=TimeStepping(2e-4, -0.01, end=0.8))
    time, moved = history["time"].values, history["rigid_body_displacement"].values[:, 0, -1]
    rate = history["rigid_body_velocity"].values[:, 0, -1]
    turns = np.flatnonzero((np.diff(np.sign(rate)) != 0) & (time[:-1] > 0.41))[:3]
    peaks = np.abs([float(moved[np.searchsorted(time, 0.4)]), *moved[turns]])
    lost = -np.diff(peaks) / drop
    checks += [
        relative(f"lost in half cycle {number} / (F / k)", 2.0, one, 0.005) for number, one in enumerate(lost, start=1)
    ]
    crossing = [float(np.interp(0.0, *_across(rate, time, turn))) for turn in turns]
    left = abs(float(moved[-1])) / drop
    checks += [
        relative("time of a cycle [s]", 0.1, crossing[2] - crossing[0], 0.01),
        absolute("rest, error / (F / k)", 0.0, left - abs(peaks[-1] / drop - 2.0), 0.02),
    ]
    checks.append(_stick(element, stiffness))
    return tuple(checks)


def _across(rate: Array, time: Array, turn: int) -> tuple[Array, Array]:
    """Return rates in ascending order, and times, on both sides of a change of sign."""
    pair = np.array([turn, turn + 1])
    order = pair[np.argsort(rate[pair])]
    return rate[order], time[order]


def _stick(element: str, stiffness: float) -> Check:
    """Take the period of a block that sticks: friction springs of both fingers and its own spring act together.

    100 steps a period leave 1e-3.
    """
    vertical: Any = _axes(element)[-1]
    mass = (_TANGENTIAL + stiffness) / (2 * np.pi / 0.02) ** 2
    ramp = Ramp((0.0, 0.05, 0.0502), (0.0, 0.0, 1.0))
    block = RigidBody(
        mass,
        free=(vertical,),
        springs=Springs(**{vertical: stiffness}),
        loads=(BodyLoad(**{vertical: 0.2 * _GRIP}, ramp=ramp),),
    )
    history = _gripped(element, block, time=TimeStepping(2e-4, 0.0, end=0.16))
    time, moved = history["time"].values, history["rigid_body_displacement"].values[:, 0, -1]
    rest = 0.2 * _GRIP / (_TANGENTIAL + stiffness)
    above = moved - rest
    up = np.flatnonzero((above[:-1] < 0.0) & (above[1:] >= 0.0))
    crossings = time[up] - above[up] * (time[up + 1] - time[up]) / (above[up + 1] - above[up])
    return relative("period in stick [s]", 0.02, float(np.diff(crossings).mean()), 2e-3)


def _fall(element: str) -> tuple[Check, ...]:
    """Let a body fall through a damper: v = (m g / c) (1 - exp(-c t / m)).

    The trapezoidal rule at 200 steps a time constant errs by 1/(12 200^2) = 2e-6; 1e-5.
    """
    mass, coefficient = 0.3, 6.0
    constant = mass / coefficient
    vertical: Any = _axes(element)[-1]
    grid = np.linspace(0.0, _SIZE, 2)
    model = Model(
        **_pad(element, _MODULUS, *(grid,) * len(_axes(element))),
        bodies={"body": RigidBody(mass, free=(vertical,), dampers=Dampers(**{vertical: coefficient}))},
        gravity=tuple(-_GRAVITY * component for component in _up(element)),
        time=TimeStepping(constant / 200, 0.0, end=20 * constant),
    )
    history = solve_problem(model)
    rate = -history["rigid_body_velocity"].values[:, 0, -1]
    terminal = mass * _GRAVITY / coefficient
    exact = terminal * (1.0 - np.exp(-history["time"].values / constant))
    error = float(np.abs(rate - exact).max() / terminal)
    return (
        relative("terminal velocity [m/s]", terminal, float(rate[-1]), 1e-8),
        absolute("velocity, largest error / terminal", 0.0, error, 1e-5),
    )


def _turn(element: str) -> tuple[Check, ...]:
    """Turn a body on a torsion spring, and a plate on the springs of a stiff pad.

    The pad gives way by its penalty alone, so that its stiffness against a turn is the sum of k_n A x^2 over the nodes.
    500 steps a period leave 2e-5 in the period; in steps without inertia nothing but rounding, and E / (k_n L) = 1e-5
    of the pad's own stiffness.
    """
    checks: list[Check] = []
    about: Any = "rz" if element == "Q4" else "ry"
    count = 1 if element == "Q4" else 3
    centre = (0.0,) * len(_axes(element))
    body = RigidBody(1.0, free=(about,), centre=centre, inertia=(2e-5,) * count)
    grid = np.linspace(-_SIZE / 2, _SIZE / 2, 5)
    pad = _pad(element, 1e14 * 2e-3, *(grid,) * (len(centre) - 1), np.linspace(-2e-3, 0.0, 2))
    sprung = replace(body, springs=Springs(**{about: 5.0}), initial_velocity=BodyVelocity(**{about: 10.0}))
    period = 2 * np.pi * np.sqrt(2e-5 / 5.0)
    alone = solve_problem(Model(**pad, bodies={"plate": sprung}, time=TimeStepping(period / 500, 0.0, end=4 * period)))
    angle = _rotation(alone, about)
    exact = 10.0 * period / (2 * np.pi) * np.sin(2 * np.pi * alone["time"].values / period)
    error = float(np.abs(angle - exact).max() / exact.max())
    checks.append(absolute("on a spring, largest error / amplitude", 0.0, error, 1e-3))
    checks += _rocking(element, body, pad)
    return tuple(checks)


def _rotation(history: xr.Dataset, about: str) -> Array:
    found: Array = history["rigid_body_rotation"].sel(rotation_axis=about[1]).values[:, 0]
    return found


def _rocking(element: str, body: RigidBody, pad: Mapping[str, Any]) -> tuple[Check, ...]:
    """Press a plate on the pad, and turn it by a moment at rest and by a blow."""
    (about,), depth = body.free, 20e-6
    down = tuple(-component for component in _up(element))
    contact = Contact("top", Plane(down), Coulomb(0.0), _PENALTY, rigid_body="plate")
    moment, pressed = 2e-3, (Press(depth, depth / 0.01), Hold(0.09))
    loaded = replace(body, programme=pressed, loads=(BodyLoad(**{about: moment}, ramp=Ramp((0.02, 0.05), (0.0, 1.0))),))
    still = solve_problem(Model(**pad, contacts=(contact,), bodies={"plate": loaded}, time=QuasiStatic(0.01)))
    arms, areas = still["contact_position"].values[:, 0], still["contact_area"].values
    stiffness = float(_PENALTY * areas @ arms**2)
    period = 2 * np.pi * np.sqrt(2e-5 / stiffness)
    step = period / 500
    # Pressed within one step, so that the blow meets the whole stiffness from the first step on.
    struck = replace(
        body,
        programme=(Press(depth, depth / step), Hold(4 * period)),
        initial_velocity=BodyVelocity(**{about: 1e-3 * 2 * np.pi / period}),
    )
    rocked = solve_problem(Model(**pad, contacts=(contact,), bodies={"plate": struck}, time=TimeStepping(step, -0.01)))
    angle, time = _rotation(rocked, about), rocked["time"].values
    up = np.flatnonzero((angle[:-1] < 0.0) & (angle[1:] >= 0.0))
    crossings = time[up] - angle[up] * step / (angle[up + 1] - angle[up])
    return (
        relative("on a pad, rotation [rad]", moment / stiffness, _rotation(still, about)[-1], 1e-4),
        relative("on a pad, period [s]", period, float(np.diff(crossings).mean()), 1e-3),
        relative(
            "on a pad, moment of contact [N m]",
            -moment,
            float(still["rigid_body_moment"].sel(rotation_axis=about[1]).values[-1, 0]),
            1e-8,
        ),
    )


PROBLEMS = (
    Problem(
        "free-block", "Block that slides to rest on a pad", "Coulomb's and Newton's laws", False, _slide, _ELEMENTS
    ),
    Problem(
        "filled-jug",
        "Jug between two fingers, filled until it slides",
        "Coulomb's and Newton's laws",
        False,
        _jug,
        _ELEMENTS,
    ),
    Problem("held-block", "Block on a spring between two fingers", "Coulomb oscillator", False, _sprung, _ELEMENTS),
    Problem("damped-fall", "Body that falls through a damper", "Newton's law", False, _fall, _ELEMENTS),
    Problem("turning-body", "Body on a torsion spring and on a pad", "Euler's law", False, _turn, _ELEMENTS),
)
