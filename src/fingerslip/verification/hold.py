"""Friction that does not creep: contacts that are held for an hour of simulated time.

A regularised friction law lets a stuck contact slide at a rate that grows with its load. Here sticking is exact but for
the elastic slip of the tangential penalty, so that nothing may move once the load is there.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.contact.bodies import Cylinder, Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.materials import Elastic, RayleighDamping
from fingerslip.model import Component, Contact, Drive, Hold, Model, Press, Ramp, Slide, TimeStepping, Traction
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, absolute, solved

__all__ = ["ELASTIC_SLIP", "HOUR", "LOADED", "PROBLEMS", "held_by_forces", "held_in_partial_slip"]

Array = NDArray[np.float64]

HOUR = 3600.0
# Long enough for numerical damping to end all ringing.
LOADED = 60.0
_STEP = 0.25
_LENGTH, _HEIGHT, _MODULUS, _PENALTY = 10e-3, 4e-3, 34e3, 1e8
_PRESSURE, _MU = 2e3, 0.5
# Of the penalty at 0.99 mu p.
ELASTIC_SLIP = 0.99 * _MU * _PRESSURE / _PENALTY
_NANO = 1e9


def held_by_forces(element: str, share: float, duration: float, step: float) -> xr.Dataset:
    """Return the history of a block under constant forces, which come up within `LOADED` seconds.

    A plate presses with a force, a traction on the far side pulls. All nodes are held across, so that pressure and
    shear are uniform.

    Parameters
    ----------
    element : {'Q4', 'H8'}
        In the plane or in space.
    share : float
        Tangential force over mu N [-].
    duration : float
        Time after the forces have come up [s].
    step : float
        Time step [s].
    """
    plane = element == "Q4"
    length, height = np.linspace(0.0, _LENGTH, 3), np.linspace(0.0, _HEIGHT, 3)
    area = _LENGTH if plane else _LENGTH**2
    press = Ramp((0.0, 10.0), (0.0, 1.0))
    pull = Ramp((10.0, 20.0), (0.0, 1.0))
    across: Component = "y" if plane else "z"
    contact = Contact(
        boundary="bottom",
        body=Plane((0.0, 1.0) if plane else (0.0, 0.0, 1.0)),
        friction=Coulomb(_MU),
        normal_penalty=_PENALTY,
        tangential_penalty=_PENALTY,
        drive=Drive(mass=1e-3, force=_PRESSURE * area, ramp=press),
    )
    traction = (share * _MU * _PRESSURE, 0.0, 0.0)[: 2 if plane else 3]
    model = Model(
        mesh=box(element, length, height) if plane else box(element, length, length, height),
        materials={"bulk": Elastic(_MODULUS, 0.0, 1000.0)},
        formulation="plane_strain" if plane else "solid",
        supports={"bulk": (across,)},
        tractions={"top": Traction(traction, pull)},
        contacts=(contact,),
        time=TimeStepping(step, end=LOADED + duration),
    )
    return solved(model, penetration=1.01 * _PRESSURE / _PENALTY)


@cache
def held_in_partial_slip(duration: float, step: float) -> xr.Dataset:
    """Return the history of a block that a cylinder has been pressed into and slid along, and that is left alone.

    The cylinder stops where most of the contact slips and its middle sticks.
    """
    contact = Contact(
        boundary="bottom",
        body=Cylinder(20e-3),
        friction=Coulomb(_MU),
        normal_penalty=_PENALTY,
        tangential_penalty=_PENALTY,
        reach=1e-3,
    )
    model = Model(
        mesh=box("Q4", np.linspace(-10e-3, 10e-3, 41), np.linspace(0.0, 10e-3, 11)),
        materials={"bulk": Elastic(_MODULUS, 0.45, 1000.0)},
        formulation="plane_strain",
        supports={"top": ("x", "y")},
        contacts=(contact,),
        programme=(Press(0.2e-3, 0.2e-3), Slide(0.22e-3, 0.22e-3), Hold(LOADED + duration)),
        time=TimeStepping(step),
        damping=RayleighDamping(stiffness=1e-3),
    )
    return solved(model)


def _by_forces() -> tuple[Check, ...]:
    """The closed form is statics: the contact side has moved by the elastic slip mu p 0.99 / k, and stays there."""
    checks: list[Check] = []
    for element in ("Q4", "H8"):
        history = held_by_forces(element, 0.99, HOUR, _STEP)
        hold = history["time"].values >= LOADED - 1e-9
        moved = history["contact_displacement"].values[hold, :, 0]
        rate = np.abs(history["contact_velocity"].values[hold]).max()
        stuck = history["contact_state"].values[hold] == 1
        drift = np.abs(moved - ELASTIC_SLIP).max()
        checks += [
            absolute(
                f"{element}: way beyond the elastic slip, largest in an hour [nm]", 0.0, _NANO * float(drift), 1.0
            ),
            absolute(f"{element}: slip that was accumulated [nm]", 0.0, _NANO * _slipped(history, hold), 1.0),
            absolute(f"{element}: nodes that do not stick, at any step", 0.0, float((~stuck).sum()), 0.0),
            absolute(f"{element}: speed, largest [nm/s]", 0.0, _NANO * float(rate), 1.0),
        ]
    return tuple(checks)


def _slipped(history: xr.Dataset, hold: NDArray[np.bool_]) -> float:
    """Return the largest slip of any node during the hold [m]."""
    slip = history["slip_distance"].values[hold]
    return float((slip[-1] - slip[0]).max())


def _partial() -> tuple[Check, ...]:
    """What slips at the edges must stop with the cylinder: nothing moves any more, stuck or at its limit."""
    history = held_in_partial_slip(HOUR, _STEP)
    hold = history["time"].values >= history["time"].values[-1] - HOUR
    moved = history["contact_displacement"].values[hold]
    force, load = history["body_force"].values[hold, 0].T
    ratio = float((np.abs(force) / (_MU * load))[0])
    sliding = np.isclose(history["time"].values, 2.0)
    states = set(history["contact_state"].values[sliding].ravel().tolist())
    return (
        absolute(
            "partial slip: motion, largest in an hour [nm]", 0.0, _NANO * float(np.abs(moved - moved[0]).max()), 1.0
        ),
        absolute("partial slip: slip that was accumulated [nm]", 0.0, _NANO * _slipped(history, hold), 1.0),
        absolute("partial slip: Q / (mu N) (0.9 to 1)", 0.95, ratio, 0.05),
        absolute("partial slip: change of Q / Q", 0.0, float(np.abs(force / force[0] - 1).max()), 1e-6),
        absolute("partial slip: states that never occur", 0.0, len({0, 1, 2} - states), 0.0),
    )


PROBLEMS = (
    Problem("hold", "An hour under 0.99 mu N", "Coulomb's law; statics", slow=True, compute=_by_forces),
    Problem("hold-partial-slip", "An hour in partial slip", "Coulomb's law; statics", slow=True, compute=_partial),
)
