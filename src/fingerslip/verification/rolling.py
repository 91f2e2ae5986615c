"""Rigid bodies that roll and travel: on a pad against a spring, down an incline, between two plates, and on an edge.

Pads are columns: their nodes are held along the surface and have no Poisson's effect, so that rolling costs nothing but
what the width a = (2 R d)^(1/2) of a contact with the penetration d makes of directions: shares of (a / R)^2 / 2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from fingerslip.arrays import Floats
from fingerslip.contact.counterfaces import Counterface, Cylinder, Plane, Sphere
from fingerslip.contact.friction import Coulomb
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.mesh.joining import join_meshes
from fingerslip.model.model import Contact, Model, SupportMotion
from fingerslip.model.programme import Hold, Ramp, Slide
from fingerslip.model.rigid_bodies import BodyLoad, Dampers, RigidBody, Springs
from fingerslip.model.timing import QuasiStatic, TimeStepping
from fingerslip.verification.meshes import axes_of, box, components, formulation_of
from fingerslip.verification.problem import Check, Problem, relative, solve_problem

_RADIUS, _WIDTH, _HEIGHT, _MASS, _GRAVITY = 10e-3, 10e-3, 2e-3, 0.05, 9.81
_INERTIA = 0.5 * _MASS * _RADIUS**2
_PENALTY = 1e10


def _pad(element: str, strain: str, along: Floats, *, modulus: float = 1e6, low: float = -_HEIGHT) -> Any:
    """Return what a model of a pad of columns between heights `low` and `low` + 2 mm consists of."""
    across = np.linspace(-_WIDTH / 2, _WIDTH / 2, 3)
    return {
        "mesh": box(element, along, across, np.linspace(low, low + _HEIGHT, 2)),
        "materials": {"bulk": (NeoHookean if strain == "finite" else Elastic)(modulus, 0.0, 1.0)},
        "supports": {"bottom": axes_of(element)[-1:], "bulk": axes_of(element)[:-1]},
        "kinematics": strain,
        "formulation": formulation_of(element),
        "depth": _WIDTH if element == "Q4" else 1.0,
    }


def _rolling(element: str) -> tuple[Any, float]:
    """Return the direction in which bodies turn that roll, and the sign of the turn that rolls them along x."""
    return ("rz", -1.0) if element == "Q4" else ("ry", 1.0)


def _face(element: str, height: float, *, up: float = -1.0, is_ball: bool = False) -> Counterface:
    """Return the round face of a body whose centre is at a height [m], which presses down, or upwards for 1."""
    normal, centre = components(element, 0.0, 0.0, up), components(element, 0.0, 0.0, height)
    if is_ball and element == "H8":
        return Sphere(_RADIUS, normal, centre)
    return Cylinder(_RADIUS, normal, centre, axis=None if element == "Q4" else (0.0, 1.0, 0.0))


def _body(element: str, height: float, **changes: Any) -> RigidBody:
    """Return a body that is free to move in a plane and to turn, with its centre at a height [m]."""
    return RigidBody(
        _MASS,
        free=("x", axes_of(element)[-1], _rolling(element)[0]),
        centre=components(element, 0.0, 0.0, height),
        inertia=(_INERTIA,) * (1 if element == "Q4" else 3),
        **changes,
    )


def _end(history: xr.Dataset, element: str) -> tuple[float, float]:
    """Return how far a body has moved along x [m], and turned the way in which it rolls [rad], at the end."""
    return float(history["rigid_body_displacement"].values[-1, 0, 0]), float(_turn(history, element)[-1])


def _turn(history: xr.Dataset, element: str) -> Floats:
    about, sign = _rolling(element)
    return np.asarray(sign * history["rigid_body_rotation"].sel(rotation_axis=about[1]).values[:, 0])


_SLOW = QuasiStatic(0.01, end=0.6)
_STIFFNESS, _MOMENT, _LOAD = 100.0, 1e-3, 0.35


def _spring(element: str, strain: str, time: QuasiStatic | TimeStepping) -> Iterator[Check]:
    """Turn a cylinder on a pad by a moment M against a spring k along the pad: it rolls by M / (R k) = 1 mm.

    The contact is 2 a = 1.75 mm wide: (a / R)^2 / 2 = 0.4 %. With inertia, the damper leaves exp(-k t / c) = 2e-4.
    """
    (about, sign), up = _rolling(element), axes_of(element)[-1]
    # At large strain something has to hold every direction where nothing has inertia.
    slow = {"x": 3.0} if time is not _SLOW else {up: 1.0, about: 1e-7} if strain == "finite" else {}
    pressed, turned = Ramp((0.0, 0.1), (0.0, 1.0)), Ramp((0.1, 0.5), (0.0, 1.0))
    loads = (BodyLoad(**{up: -_LOAD}, ramp=pressed), BodyLoad(**{about: sign * _MOMENT}, ramp=turned))
    body = _body(element, _RADIUS, springs=Springs(x=_STIFFNESS), dampers=Dampers(**slow), loads=loads)
    contact = Contact("top", _face(element, _RADIUS), Coulomb(0.8), _PENALTY, _PENALTY, rigid_body="cylinder")
    pad = _pad(element, strain, np.linspace(-2e-3, 3e-3, 51))
    history = solve_problem(Model(**pad, contacts=(contact,), bodies={"cylinder": body}, time=time))
    moved, angle = _end(history, element)
    yield relative("way [m]", _MOMENT / (_RADIUS * _STIFFNESS), moved, 0.004)
    yield relative("rotation x R / way", 1.0, angle * _RADIUS / moved, 0.004)


_FRICTION, _END = 0.3, 0.07


def _incline(element: str, strain: str, slope: float) -> Iterator[Check]:
    """Let a solid cylinder go on an incline, below and above the slope tan a = 3 mu up to which it rolls.

    It rolls with 2/3 g sin a, or slides with g (sin a - mu cos a) and turns with 2 mu g cos a / R. The pad gives way by
    0.02 mm: a / R = 6 %, of which the square counts, and nodes that come and go shake it: 1 %.
    """
    sine, cosine = np.sin(np.arctan(slope)), np.cos(np.arctan(slope))
    contact = Contact("top", _face(element, _RADIUS), Coulomb(_FRICTION), _PENALTY, _PENALTY, rigid_body="cylinder")
    history = solve_problem(
        Model(
            **_pad(element, strain, np.linspace(-1e-3, 16e-3, 86), modulus=4e6),
            contacts=(contact,),
            bodies={"cylinder": _body(element, _RADIUS, filling=Ramp((0.0, 0.02), (0.0, 1.0)))},
            gravity=components(element, _GRAVITY * sine, 0.0, -_GRAVITY * cosine),
            time=TimeStepping(5e-4, -0.1, end=_END),
        )
    )
    time = history["time"].values
    late = time > 0.03
    rates = history["rigid_body_velocity"].values[:, 0, 0], np.gradient(_turn(history, element), time)
    along, about = (float(np.polyfit(time[late], rate[late], 1)[0]) for rate in rates)
    rolls = slope < 3.0 * _FRICTION
    exact = _GRAVITY * (2.0 / 3.0 * sine if rolls else sine - _FRICTION * cosine)
    turns = exact / _RADIUS if rolls else 2.0 * _FRICTION * _GRAVITY * cosine / _RADIUS
    yield relative("acceleration [m/s2]", exact, along, 0.01)
    yield relative("angular acceleration [rad/s2]", turns, about, 0.01)


_SQUEEZE, _TRAVEL = 0.04e-3, 4e-3


def _between(element: str, strain: str, time: QuasiStatic | TimeStepping) -> Iterator[Check]:
    """Roll a cylinder, in 3D a ball, between two plates, the upper of which moves by u: by u / 2 and u / (2 R).

    The contacts are as those on a spring: 0.4 %.
    """
    along, axes = np.linspace(-2e-3, 6e-3, 81), axes_of(element)
    low, high = (_pad(element, strain, along, low=height) for height in (-_RADIUS - _HEIGHT, _RADIUS))
    squeezed, moved = Ramp((0.0, 0.1), (0.0, 1.0)), Ramp((0.1, 0.5), (0.0, 1.0))
    contacts = tuple(
        Contact(face, _face(element, 0.0, up=up, is_ball=True), Coulomb(0.8), _PENALTY, _PENALTY, rigid_body="ball")
        for face, up in (("low_top", -1.0), ("high_bottom", 1.0))
    )
    both = {
        "mesh": join_meshes({"low": low["mesh"], "high": high["mesh"]}),
        "materials": dict.fromkeys(("low_bulk", "high_bulk"), low["materials"]["bulk"]),
        "supports": dict.fromkeys(("low_bottom", "high_top"), axes[-1:])
        | dict.fromkeys(("low_bulk", "high_bulk"), axes[:-1]),
    }
    model = Model(
        **low | both,
        support_motions={
            "high_top": SupportMotion(components(element, 0.0, 0.0, -2 * _SQUEEZE), squeezed),
            "high_bulk": SupportMotion(components(element, _TRAVEL, 0.0, 0.0), moved),
        },
        contacts=contacts,
        bodies={"ball": _body(element, 0.0)},
        time=time,
    )
    way, angle = _end(solve_problem(model), element)
    yield relative("way / u", 0.5, way / _TRAVEL, 0.004)
    yield relative("rotation x 2 R / u", 1.0, angle * 2 * _RADIUS / _TRAVEL, 0.004)


_SPRING, _ACROSS = 10.0, 10e-3


def _travel(element: str, strain: str) -> Iterator[Check]:
    """Slide a flat plate under a load N by s = 10 mm off a narrow pad: it turns against a torsion spring K.

    The pad's own stiffness against a turn is S = sum of A x^2 / (L / E + 1 / k_n), and that of the shear between its
    columns G w L b / 3. The plate turns by N s / (K + S) = 0.001, which shortens the arm by h / s of it: 1e-4. How the
    penalty shares the shear is left out: 1e-4.
    """
    about, up = _rolling(element)[0], axes_of(element)[-1]
    load = BodyLoad(**{up: -1.0}, ramp=Ramp((0.0, 0.1), (0.0, 1.0)))
    held = Dampers(**{up: 1.0}) if strain == "finite" else None
    body = replace(
        _body(element, 1e-3, springs=Springs(**{about: _SPRING}), loads=(load,), dampers=held),
        free=(up, about),
        programme=(Hold(0.1), Slide(_ACROSS, 0.05, components(element, 1.0, 0.0, 0.0)), Hold(0.1)),
    )
    down = Plane(components(element, 0.0, 0.0, -1.0), 0.0)
    model = Model(
        **_pad(element, strain, np.linspace(-1e-3, 1e-3, 9)),
        contacts=(Contact("top", down, Coulomb(0.0), _PENALTY, rigid_body="plate"),),
        bodies={"plate": body},
        time=QuasiStatic(0.01),
    )
    history = solve_problem(model)
    areas, at = history["contact_area"].values, history["contact_position"].values[:, 0]
    reference = float(areas @ at**2) / (_HEIGHT / 1e6 + 1.0 / _PENALTY) + 0.5e6 * 2e-3 * _HEIGHT * _WIDTH / 3.0
    moved, angle = _end(history, element)
    yield relative("way [m]", _ACROSS, moved, 1e-9)
    yield relative("rotation [rad]", _ACROSS / (_SPRING + reference), angle, 1e-3)


def _cases(*rows: tuple[Any, ...]) -> dict[str, tuple[Any, ...]]:
    """Return cases that are named by the kind of cell, the strain, and the time steps or whether the body rolls."""

    def name(element: str, strain: str, last: Any = None) -> str:
        word = ("rolls" if last < 3.0 * _FRICTION else "slides") if isinstance(last, float) else type(last).__name__
        return f"{element}, {strain} strain" + ("" if last is None else f", {word}")

    return {name(*row): row for row in rows}


_SHAKEN, _SQUEEZED = TimeStepping(2e-3, -0.1, end=0.8), TimeStepping(1e-3, -0.1, end=0.5)
_STILL = QuasiStatic(0.01, end=0.5)
_ON_A_PAD = _cases(
    *(("Q4", "small", _SLOW), ("H8", "small", _SLOW), ("Q4", "small", _SHAKEN)),
    *(("Q4", "finite", _SHAKEN), ("Q4", "finite", _SLOW)),
)
_DOWN = _cases(
    *(("Q4", "small", 0.5), ("Q4", "small", 1.5), ("H8", "small", 0.5), ("Q4", "finite", 0.5), ("Q4", "finite", 1.5))
)
_PLATES = _cases(
    *(("Q4", "small", _STILL), ("H8", "small", _STILL), ("Q4", "small", _SQUEEZED), ("Q4", "finite", _SQUEEZED))
)
_OFF = _cases(("Q4", "small"), ("H8", "small"), ("Q4", "finite"))
_NEWTON = "Newton's and Euler's laws"
PROBLEMS = (
    Problem("rolling-cylinder", "Cylinder that rolls on a pad against a spring", "statics", _spring, _ON_A_PAD),
    Problem("cylinder-on-incline", "Cylinder that rolls or slides down an incline", _NEWTON, _incline, _DOWN),
    Problem("ball-between-plates", "Ball that rolls between two plates", "kinematics", _between, _PLATES),
    Problem("travelling-plate", "Plate that slides off a pad and turns", "statics", _travel, _OFF),
)
