"""Rigid bodies that roll and travel: on a pad against a spring, down an incline, between two plates, and on an edge.

Pads are columns: their nodes are held along the surface and have no Poisson's effect, so that rolling costs nothing but
what the width a = (2 R d)^(1/2) of a contact with the penetration d makes of directions: shares of (a / R)^2 / 2.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.contact.counterfaces import Counterface, Cylinder, Plane, Sphere
from fingerslip.contact.friction import Coulomb
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.mesh.joining import join_meshes
from fingerslip.model.model import Contact, Model, SupportMotion
from fingerslip.model.programme import Hold, Ramp, Slide
from fingerslip.model.rigid_bodies import BodyLoad, Dampers, RigidBody, Springs
from fingerslip.model.timing import QuasiStatic, TimeStepping
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, relative, solve_problem

Array = NDArray[np.float64]

_RADIUS, _WIDTH, _HEIGHT, _MASS, _GRAVITY = 10e-3, 10e-3, 2e-3, 0.05, 9.81
_INERTIA = 0.5 * _MASS * _RADIUS**2
_PENALTY = 1e10


def _pad(element: str, along: Array, *, modulus: float = 1e6, is_finite: bool = False, low: float = -_HEIGHT) -> Any:
    """Return what a model of a pad of columns between heights `low` and `low` + 2 mm consists of."""
    across = [] if element == "Q4" else [np.linspace(-_WIDTH / 2, _WIDTH / 2, 3)]
    held: Any = ("x", "y") if across else ("x",)
    return {
        "mesh": box(element, along, *across, np.linspace(low, low + _HEIGHT, 2)),
        "materials": {"bulk": (NeoHookean if is_finite else Elastic)(modulus, 0.0, 1.0)},
        "supports": {"bottom": (_up(element),), "bulk": held},
        "kinematics": "finite" if is_finite else "small",
        "formulation": "solid" if across else "plane_strain",
        "depth": 1.0 if across else _WIDTH,
    }


def _up(element: str) -> Any:
    return "y" if element == "Q4" else "z"


def _above(element: str, along: float, height: float) -> tuple[float, ...]:
    return (along, height) if element == "Q4" else (along, 0.0, height)


def _rolling(element: str) -> tuple[Any, float]:
    """Return the direction in which bodies turn that roll, and the sign of the turn that rolls them along x."""
    return ("rz", -1.0) if element == "Q4" else ("ry", 1.0)


def _face(element: str, height: float, *, up: float = -1.0, is_ball: bool = False) -> Counterface:
    """Return the round face of a body whose centre is at a height [m], which presses down, or upwards for 1."""
    normal, centre = _above(element, 0.0, up), _above(element, 0.0, height)
    if is_ball and element == "H8":
        return Sphere(_RADIUS, normal, centre)
    return Cylinder(_RADIUS, normal, centre, axis=None if element == "Q4" else (0.0, 1.0, 0.0))


def _body(element: str, height: float, inertia: float = _INERTIA, **changes: Any) -> RigidBody:
    """Return a body that is free to move in a plane and to turn, with its centre at a height [m]."""
    free: Any = ("x", _up(element), _rolling(element)[0])
    return RigidBody(
        _MASS,
        free=free,
        centre=_above(element, 0.0, height),
        inertia=(inertia,) * (1 if element == "Q4" else 3),
        **changes,
    )


def _end(history: xr.Dataset, element: str) -> tuple[float, float]:
    """Return how far a body has moved along x [m], and turned the way in which it rolls [rad], at the end."""
    return float(history["rigid_body_displacement"].values[-1, 0, 0]), float(_turn(history, element)[-1])


def _turn(history: xr.Dataset, element: str) -> Array:
    about, sign = _rolling(element)
    return np.asarray(sign * history["rigid_body_rotation"].sel(rotation_axis=about[1]).values[:, 0])


_SLOW = QuasiStatic(0.01, end=0.6)
_STIFFNESS, _MOMENT, _LOAD = 100.0, 1e-3, 0.35


def _spring() -> tuple[Check, ...]:
    """Turn a cylinder on a pad by a moment M against a spring k along the pad: it rolls by M / (R k) = 1 mm.

    The contact is 2 a = 1.75 mm wide: (a / R)^2 / 2 = 0.4 %. With inertia, the damper leaves exp(-k t / c) = 2e-4.
    """
    checks: list[Check] = []
    exact = _MOMENT / (_RADIUS * _STIFFNESS)
    cases: tuple[tuple[str, str, Any], ...] = (
        ("Q4", "small", _SLOW),
        ("H8", "small", _SLOW),
        ("Q4", "small", TimeStepping(2e-3, -0.1, end=0.8)),
        ("Q4", "finite", TimeStepping(2e-3, -0.1, end=0.8)),
        ("Q4", "finite", _SLOW),
    )
    for element, strain, time in cases:
        about, sign = _rolling(element)
        # At large strain something has to hold every direction where nothing has inertia.
        slow = Dampers(
            **({"x": 3.0} if time is not _SLOW else {_up(element): 1.0, about: 1e-7} if strain == "finite" else {})
        )
        pressed, turned = Ramp((0.0, 0.1), (0.0, 1.0)), Ramp((0.1, 0.5), (0.0, 1.0))
        loads = (BodyLoad(**{_up(element): -_LOAD}, ramp=pressed), BodyLoad(**{about: sign * _MOMENT}, ramp=turned))
        body = _body(element, _RADIUS, springs=Springs(x=_STIFFNESS), dampers=slow, loads=loads)
        contact = Contact("top", _face(element, _RADIUS), Coulomb(0.8), _PENALTY, _PENALTY, rigid_body="cylinder")
        pad = _pad(element, np.linspace(-2e-3, 3e-3, 51), is_finite=strain == "finite")
        moved, angle = _end(
            solve_problem(Model(**pad, contacts=(contact,), bodies={"cylinder": body}, time=time)), element
        )
        where = f"{element}, {strain} strain, {type(time).__name__}"
        checks += [
            relative(f"{where}: way [m]", exact, moved, 0.004),
            relative(f"{where}: rotation x R / way", 1.0, angle * _RADIUS / moved, 0.004),
        ]
    return tuple(checks)


_FRICTION, _END = 0.3, 0.07


def _incline() -> tuple[Check, ...]:
    """Let a solid cylinder go on an incline, below and above the slope tan a = 3 mu up to which it rolls.

    It rolls with 2/3 g sin a, or slides with g (sin a - mu cos a) and turns with 2 mu g cos a / R. The pad gives way by
    0.02 mm: a / R = 6 %, of which the square counts, and nodes that come and go shake it: 1 %.
    """
    checks: list[Check] = []
    for element, strain, slope in (
        ("Q4", "small", 0.5),
        ("Q4", "small", 1.5),
        ("H8", "small", 0.5),
        ("Q4", "finite", 0.5),
        ("Q4", "finite", 1.5),
    ):
        sine, cosine = np.sin(np.arctan(slope)), np.cos(np.arctan(slope))
        pad = _pad(element, np.linspace(-1e-3, 16e-3, 86), modulus=4e6, is_finite=strain == "finite")
        contact = Contact("top", _face(element, _RADIUS), Coulomb(_FRICTION), _PENALTY, _PENALTY, rigid_body="cylinder")
        history = solve_problem(
            Model(
                **pad,
                contacts=(contact,),
                bodies={"cylinder": _body(element, _RADIUS, filling=Ramp((0.0, 0.02), (0.0, 1.0)))},
                gravity=tuple(_GRAVITY * part for part in _above(element, sine, -cosine)),
                time=TimeStepping(5e-4, -0.1, end=_END),
            )
        )
        time = history["time"].values
        late = time > 0.03
        rate = history["rigid_body_velocity"].values[late, 0, 0]
        along, about = (
            float(np.polyfit(time[late], rate_of_turn, 1)[0])
            for rate_of_turn in (rate, np.gradient(_turn(history, element), time)[late])
        )
        rolls = slope < 3.0 * _FRICTION
        exact = _GRAVITY * (2.0 / 3.0 * sine if rolls else sine - _FRICTION * cosine)
        turns = exact / _RADIUS if rolls else 2.0 * _FRICTION * _GRAVITY * cosine / _RADIUS
        where = f"{element}, {strain} strain, {'rolls' if rolls else 'slides'}"
        checks += [
            relative(f"{where}: acceleration [m/s2]", exact, along, 0.01),
            relative(f"{where}: angular acceleration [rad/s2]", turns, about, 0.01),
        ]
    return tuple(checks)


_SQUEEZE, _TRAVEL = 0.04e-3, 4e-3


def _between() -> tuple[Check, ...]:
    """Roll a cylinder, in 3D a ball, between two plates, the upper of which moves by u: by u / 2 and u / (2 R).

    The contacts are as those on a spring: 0.4 %.
    """
    checks: list[Check] = []
    for element, strain, time in (
        ("Q4", "small", QuasiStatic(0.01, end=0.5)),
        ("H8", "small", QuasiStatic(0.01, end=0.5)),
        ("Q4", "small", TimeStepping(1e-3, -0.1, end=0.5)),
        ("Q4", "finite", TimeStepping(1e-3, -0.1, end=0.5)),
    ):
        along = np.linspace(-2e-3, 6e-3, 81)
        low, high = (
            _pad(element, along, is_finite=strain == "finite", low=height) for height in (-_RADIUS - _HEIGHT, _RADIUS)
        )
        held: Any = ("x", "y") if element == "H8" else ("x",)
        squeezed, moved = Ramp((0.0, 0.1), (0.0, 1.0)), Ramp((0.1, 0.5), (0.0, 1.0))
        contacts = tuple(
            Contact(face, _face(element, 0.0, up=up, is_ball=True), Coulomb(0.8), _PENALTY, _PENALTY, rigid_body="ball")
            for face, up in (("low_top", -1.0), ("high_bottom", 1.0))
        )
        law = low["materials"]["bulk"]
        history = solve_problem(
            Model(
                **low
                | {
                    "mesh": join_meshes({"low": low["mesh"], "high": high["mesh"]}),
                    "materials": {"low_bulk": law, "high_bulk": law},
                    "supports": {
                        "low_bottom": (_up(element),),
                        "high_top": (_up(element),),
                        "low_bulk": held,
                        "high_bulk": held,
                    },
                },
                support_motions={
                    "high_top": SupportMotion(_above(element, 0.0, -2 * _SQUEEZE), squeezed),
                    "high_bulk": SupportMotion(_above(element, _TRAVEL, 0.0), moved),
                },
                contacts=contacts,
                bodies={"ball": _body(element, 0.0)},
                time=time,
            )
        )
        way, angle = _end(history, element)
        where = f"{element}, {strain} strain, {type(time).__name__}"
        checks += [
            relative(f"{where}: way / u", 0.5, way / _TRAVEL, 0.004),
            relative(f"{where}: rotation x 2 R / u", 1.0, angle * 2 * _RADIUS / _TRAVEL, 0.004),
        ]
    return tuple(checks)


_SPRING, _ACROSS = 10.0, 10e-3


def _travel() -> tuple[Check, ...]:
    """Slide a flat plate under a load N by s = 10 mm off a narrow pad: it turns against a torsion spring K.

    The pad's own stiffness against a turn is S = sum of A x^2 / (L / E + 1 / k_n), and that of the shear between its
    columns G w L b / 3. The plate turns by N s / (K + S) = 0.001, which shortens the arm by h / s of it: 1e-4. How the
    penalty shares the shear is left out: 1e-4.
    """
    checks: list[Check] = []
    for element, strain in (("Q4", "small"), ("H8", "small"), ("Q4", "finite")):
        about = _rolling(element)[0]
        pad = _pad(element, np.linspace(-1e-3, 1e-3, 9), is_finite=strain == "finite")
        load = BodyLoad(**{_up(element): -1.0}, ramp=Ramp((0.0, 0.1), (0.0, 1.0)))
        held = Dampers(**{_up(element): 1.0}) if strain == "finite" else None
        body = replace(
            _body(element, 1e-3, springs=Springs(**{about: _SPRING}), loads=(load,), dampers=held),
            free=(_up(element), about),
            programme=(Hold(0.1), Slide(_ACROSS, 0.05, _above(element, 1.0, 0.0)), Hold(0.1)),
        )
        contact = Contact("top", Plane(_above(element, 0.0, -1.0), 0.0), Coulomb(0.0), _PENALTY, rigid_body="plate")
        history = solve_problem(Model(**pad, contacts=(contact,), bodies={"plate": body}, time=QuasiStatic(0.01)))
        areas, at = history["contact_area"].values, history["contact_position"].values[:, 0]
        reference = float(areas @ at**2) / (_HEIGHT / 1e6 + 1.0 / _PENALTY) + 0.5e6 * 2e-3 * _HEIGHT * _WIDTH / 3.0
        where = f"{element}, {strain} strain"
        moved, angle = _end(history, element)
        checks += [
            relative(f"{where}: way [m]", _ACROSS, moved, 1e-9),
            relative(f"{where}: rotation [rad]", _ACROSS / (_SPRING + reference), angle, 1e-3),
        ]
    return tuple(checks)


PROBLEMS = (
    Problem("rolling-cylinder", "Cylinder that rolls on a pad against a spring", "statics", False, _spring),
    Problem(
        "cylinder-on-incline",
        "Cylinder that rolls or slides down an incline",
        "Newton's and Euler's laws",
        False,
        _incline,
    ),
    Problem("ball-between-plates", "Ball that rolls between two plates", "kinematics", slow=False, compute=_between),
    Problem("travelling-plate", "Plate that slides off a pad and turns", "statics", slow=False, compute=_travel),
)
