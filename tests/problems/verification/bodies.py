"""Rigid bodies that are free: set sliding, filled, on a spring, falling through a damper, and turning.

Fingers are blocks whose nodes are held along the surface, without Poisson's effect: a squeeze by s gives the uniform
pressure s / (L / E + 1 / k_n), and friction is that of Coulomb's law on known normal forces.
"""

from dataclasses import replace

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import axes_of, box, components, dimension, formulation_of
from fingerslip.verification.problem import Problem, absolute, each, largest, relative, solve_problem
from problems.held import apart, held, two_fingers

_SIZE, _MODULUS, _PENALTY, _MU, _GRAVITY = 10e-3, 1e5, 1e9, 0.5, 9.81
_AREA = _SIZE**2


def _plane(element):
    """Return the formulation, with a depth in 2D that makes its areas those in 3D."""
    return {"formulation": formulation_of(element)} | ({"depth": _SIZE} if element == "Q4" else {})


def _pad(element, modulus, along, height):
    """Return what a model of a pad that is held at its lower side and along its surface consists of."""
    return {
        "mesh": box(element, along, along, height),
        "materials": {"bulk": fs.Elastic(modulus, 0.0, 1.0)},
        "supports": {"bottom": axes_of(element), "bulk": axes_of(element)[:-1]},
        **_plane(element),
    }


def _downwards(element):
    return components(element, 0.0, 0.0, -1.0)


def _weight(element):
    return components(element, 0.0, 0.0, -_GRAVITY)


def _crossings(values, time):
    """Return the times at which values grow through zero [s]."""
    up = np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))
    return time[up] - values[up] * (time[up + 1] - time[up]) / (values[up + 1] - values[up])


def _slide(element):
    """Let a block of 0.1 kg slide on a stiff pad under its weight from 1 m/s.

    The weight acts at once: the block's bounce, 1/omega = 1 ms long at a contact stiffness of 1e5 N/m, may shift the
    stop by 0.5 % of 0.2 s.
    """
    speed, mass = 1.0, 0.1
    block = fs.RigidBody(mass, free=("x", axes_of(element)[-1]), initial_velocity=fs.BodyVelocity(x=speed))
    face = fs.Plane(_downwards(element))
    model = fs.Model(
        **_pad(element, 1e9, np.linspace(0.0, _SIZE, 3), np.linspace(0.0, 2e-3, 2)),
        contacts=(fs.Contact("top", face, fs.Coulomb(_MU), _PENALTY, _PENALTY, rigid_body="block"),),
        bodies={"block": block},
        gravity=_weight(element),
        time=fs.TimeStepping(2e-4, end=0.22),
    )
    history = solve_problem(model)
    time, moved = history["time"].values, history["rigid_body_displacement"].values[:, 0, 0]
    rate = history["rigid_body_velocity"].values[:, 0, 0]
    first = int(np.argmax(rate <= 0.0))
    stop = speed / (_MU * _GRAVITY)
    stopped = float(np.interp(0.0, rate[[first, first - 1]], time[[first, first - 1]]))
    friction = float(history["friction_dissipation"].values[-1]) / (0.5 * mass * speed**2)
    yield relative("time to stop [s]", stop, stopped, 0.005)
    yield relative("way to stop [m]", speed * stop / 2, float(moved[-1]), 0.005)
    yield relative("friction / energy at the start", 1.0, friction, 0.005)


_SQUEEZE, _CLOSED = 1e-3, 0.02
# Normal force of each finger.
_FORCE = _AREA * _SQUEEZE / (_SIZE / _MODULUS + 1.0 / _PENALTY)
_GRIP = 2 * _MU * _FORCE
_TANGENTIAL = 2 * _PENALTY * _AREA


def _gripped(element, body, **changes):
    """Return the history of a body between two fingers that close on it in 20 ms; all are held along its surface."""
    axes = axes_of(element)
    model = held(
        element,
        body=body,
        squeeze=_SQUEEZE,
        closing=fs.Ramp((0.0, _CLOSED), (0.0, 1.0)),
        penalty=_PENALTY,
        mesh=two_fingers(element, 2, 2),
        materials=dict.fromkeys(("left_bulk", "right_bulk"), fs.Elastic(_MODULUS, 0.0, 100.0)),
        supports={"left_left": ("x",), "right_right": ("x",), "left_bulk": axes[1:], "right_bulk": axes[1:]},
        damping=fs.RayleighDamping(mass=2e3),
        **changes,
    )
    return solve_problem(model)


def _jug(element):
    """Fill a jug, 1.25 times as heavy as two fingers can hold, in 0.5 s.

    On the springs of stick friction, with omega = 1e3 rad/s, the growing weight makes ripples of 1/(omega 0.5 s) =
    2e-3 of itself: 0.5 %. Once it is full, it slides on at a constant acceleration.
    """
    mass, filled, end = 1.25 * _GRIP / _GRAVITY, 0.55, 0.65
    jug = fs.RigidBody(mass, free=("x", axes_of(element)[-1]), filling=fs.Ramp((0.05, filled), (0.0, 1.0)))
    history = _gripped(element, jug, time=fs.TimeStepping(5e-4, end=end))
    time = history["time"].values
    slides = float(time[np.argmax(history["friction_utilisation"].values.min(axis=1) > 1.0 - 1e-6)])
    weight = mass * _GRAVITY * (slides - 0.05) / (filled - 0.05)
    late = time > filled + 0.02
    falls = -float(np.polyfit(time[late], history["rigid_body_velocity"].values[late, 0, -1], 1)[0])
    aside = float(np.abs(history["rigid_body_displacement"].values[:, 0, 0]).max())
    used = float(history["friction_utilisation"].values[np.searchsorted(time, 0.3), 0])
    normal = float(history["counterface_force"].values[-1, 1, 0])
    yield relative("normal force of a finger [N]", _FORCE, normal, 1e-4)
    yield relative("weight at which it slides / (2 mu N)", 1.0, weight / _GRIP, 0.005)
    yield relative("acceleration when full [m/s2]", _GRAVITY - _GRIP / mass, falls, 2e-3)
    yield relative("utilisation at 0.3 s", 0.5 * 1.25, used, 0.01)
    yield absolute("motion along the squeeze / squeeze", 0.0, aside / _SQUEEZE, 1e-9)


_STIFFNESS = _TANGENTIAL / 1e3


def _pulled(element, mass, pull, ramp, time):
    """Return the history of a block on a spring between two fingers, under a load [N] along its spring."""
    up = axes_of(element)[-1]
    loads, springs = (fs.BodyLoad(**{up: pull}, ramp=ramp),), fs.Springs(**{up: _STIFFNESS})
    return _gripped(element, fs.RigidBody(mass, free=(up,), springs=springs, loads=loads), gravity=None, time=time)


def _sprung(element):
    """Pull a block on a spring against the friction of two fingers, and let it go: it loses 2 F/k every half cycle.

    The friction springs stretch by F/k_t = 1e-3 F/k at each turn, and 500 steps a cycle at alpha = -0.01 take less than
    1e-3 of the amplitude, up to seven times F/k: 0.5 %. Turning takes the friction springs some time: 1 % of a cycle.
    When the block stops, they throw it back by up to 1e-2 F/k: 2 %. Of the period in stick 100 steps leave 1e-3.
    """
    drop = _GRIP / _STIFFNESS
    ramp = fs.Ramp((0.0, 0.1, 0.3, 0.4, 0.4002), (0.0, 0.0, 1.0, 1.0, 0.0))
    mass = _STIFFNESS / (2 * np.pi / 0.1) ** 2
    history = _pulled(element, mass, 7.3 * _GRIP, ramp, fs.TimeStepping(2e-4, -0.01, end=0.8))
    time, moved = history["time"].values, history["rigid_body_displacement"].values[:, 0, -1]
    rate = history["rigid_body_velocity"].values[:, 0, -1]
    turns = np.flatnonzero((np.diff(np.sign(rate)) != 0) & (time[:-1] > 0.41))[:3]
    peaks = np.abs([float(moved[np.searchsorted(time, 0.4)]), *moved[turns]])
    for number, lost in enumerate(-np.diff(peaks) / drop, start=1):
        yield relative(f"lost in half cycle {number} / (F / k)", 2.0, lost, 0.005)
    first, last = (time[turn] - rate[turn] * (time[turn + 1] - time[turn]) / np.diff(rate)[turn] for turn in turns[::2])
    yield relative("time of a cycle [s]", 0.1, float(last - first), 0.01)
    left = abs(float(moved[-1])) / drop
    yield absolute("rest, error / (F / k)", 0.0, left - abs(peaks[-1] / drop - 2.0), 0.02)
    # In stick the friction springs of both fingers and the block's own spring act together.
    mass = (_TANGENTIAL + _STIFFNESS) / (2 * np.pi / 0.02) ** 2
    ramp = fs.Ramp((0.0, 0.05, 0.0502), (0.0, 0.0, 1.0))
    stuck = _pulled(element, mass, 0.2 * _GRIP, ramp, fs.TimeStepping(2e-4, 0.0, end=0.16))
    above = stuck["rigid_body_displacement"].values[:, 0, -1] - 0.2 * _GRIP / (_TANGENTIAL + _STIFFNESS)
    period = float(np.diff(_crossings(above, stuck["time"].values)).mean())
    yield relative("period in stick [s]", 0.02, period, 2e-3)


def _fall(element):
    """Let a body fall through a damper: v = (m g / c) (1 - exp(-c t / m)).

    The trapezoidal rule at 200 steps a time constant errs by 1/(12 200^2) = 2e-6; 1e-5.
    """
    mass, coefficient, up = 0.3, 6.0, axes_of(element)[-1]
    constant = mass / coefficient
    body = fs.RigidBody(mass, free=(up,), dampers=fs.Dampers(**{up: coefficient}))
    time = fs.TimeStepping(constant / 200, 0.0, end=20 * constant)
    history = solve_problem(apart(body, dimension(element), gravity=_weight(element), time=time))
    rate = -history["rigid_body_velocity"].values[:, 0, -1]
    terminal = mass * _GRAVITY / coefficient
    exact = terminal * (1.0 - np.exp(-history["time"].values / constant))
    yield relative("terminal velocity [m/s]", terminal, float(rate[-1]), 1e-8)
    yield largest("velocity, largest error / terminal", exact, rate, 1e-5, terminal)


def _turn(element):
    """Turn a body on a torsion spring, and a plate on the springs of a stiff pad.

    The pad gives way by its penalty alone, so that its stiffness against a turn is the sum of k_n A x^2 over the nodes.
    500 steps a period leave 2e-5 in the period; in steps without inertia nothing but rounding, and E / (k_n L) = 1e-5
    of the pad's own stiffness.
    """
    about = "rz" if element == "Q4" else "ry"
    inertia = (2e-5,) if element == "Q4" else (1e-5, 2e-5, 3e-5)
    body = fs.RigidBody(1.0, free=(about,), centre=components(element, 0.0, 0.0, 0.0), inertia=inertia)
    pad = _pad(element, 1e14 * 2e-3, np.linspace(-_SIZE / 2, _SIZE / 2, 5), np.linspace(-2e-3, 0.0, 2))
    sprung = replace(body, springs=fs.Springs(**{about: 5.0}), initial_velocity=fs.BodyVelocity(**{about: 10.0}))
    period = 2 * np.pi * np.sqrt(2e-5 / 5.0)
    alone = solve_problem(
        fs.Model(**pad, bodies={"plate": sprung}, time=fs.TimeStepping(period / 500, 0.0, end=4 * period))
    )
    exact = 10.0 * period / (2 * np.pi) * np.sin(2 * np.pi * alone["time"].values / period)
    yield largest("on a spring, largest error / amplitude", exact, _rotation(alone, about), 1e-3, exact.max())
    yield from _rocking(element, body, pad)


def _rotation(history, about):
    return history["rigid_body_rotation"].sel(rotation_axis=about[1]).values[:, 0]


def _rocking(element, body, pad):
    """Press a plate on the pad, and turn it by a moment at rest and by a blow."""
    (about,), depth = body.free, 20e-6
    contact = fs.Contact("top", fs.Plane(_downwards(element)), fs.Coulomb(0.0), _PENALTY, rigid_body="plate")
    moment, pressed = 2e-3, (fs.Press(depth, depth / 0.01), fs.Hold(0.09))
    loaded = replace(
        body, programme=pressed, loads=(fs.BodyLoad(**{about: moment}, ramp=fs.Ramp((0.02, 0.05), (0.0, 1.0))),)
    )
    still = solve_problem(fs.Model(**pad, contacts=(contact,), bodies={"plate": loaded}, time=fs.QuasiStatic(0.01)))
    arms, areas = still["contact_position"].values[:, 0], still["contact_area"].values
    stiffness = float(_PENALTY * areas @ arms**2)
    period = 2 * np.pi * np.sqrt(2e-5 / stiffness)
    step = period / 500
    # Pressed within one step, so that the blow meets the whole stiffness from the first step on.
    struck = replace(
        body,
        programme=(fs.Press(depth, depth / step), fs.Hold(4 * period)),
        initial_velocity=fs.BodyVelocity(**{about: 1e-3 * 2 * np.pi / period}),
    )
    rocked = solve_problem(
        fs.Model(**pad, contacts=(contact,), bodies={"plate": struck}, time=fs.TimeStepping(step, -0.01))
    )
    swing = float(np.diff(_crossings(_rotation(rocked, about), rocked["time"].values)).mean())
    at_contact = float(still["rigid_body_moment"].sel(rotation_axis=about[1]).values[-1, 0])
    yield relative("on a pad, rotation [rad]", moment / stiffness, _rotation(still, about)[-1], 1e-4)
    yield relative("on a pad, period [s]", period, swing, 1e-3)
    yield relative("on a pad, moment of contact [N m]", -moment, at_contact, 1e-8)


_BOTH, _LAWS = each("Q4", "H8"), "Coulomb's and Newton's laws"
PROBLEMS = (
    Problem("free-block", "Block that slides to rest on a pad", _LAWS, _slide, _BOTH),
    Problem("filled-jug", "Jug between two fingers, filled until it slides", _LAWS, _jug, _BOTH),
    Problem("held-block", "Block on a spring between two fingers", "Coulomb oscillator", _sprung, _BOTH),
    Problem("damped-fall", "Body that falls through a damper", "Newton's law", _fall, _BOTH),
    Problem("turning-body", "Body on a torsion spring and on a pad", "Euler's law", _turn, _BOTH),
)
