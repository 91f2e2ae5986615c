"""Blocks without inertia that only gravity and friction hold on a plate."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.materials.elastic import Elastic
from fingerslip.model.model import Component, Contact, Model
from fingerslip.model.timing import QuasiStatic
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, relative, solve_problem

__all__ = ["PROBLEMS"]

_LENGTH, _HEIGHT, _MODULUS, _DENSITY, _GRAVITY, _PENALTY, _MU = 10e-3, 5e-3, 1e5, 1000.0, 9.81, 1e8, 0.5
_PRESSURE = _DENSITY * _GRAVITY * _HEIGHT
# The pull on the side, as a share of the friction that the weight can give.
_SHARE = 0.8
_ALLOWED = 1e-8


def _rested(element: str, *, pull: float = 0.0, held: tuple[Component, ...] = ()) -> xr.Dataset:
    """Return the history of a block that is dropped from 0.1 mm and pulled on its right side by `pull` [Pa]."""
    plane = element == "Q4"
    count = 1 if plane else 2
    sides = [np.linspace(0.0, _LENGTH, 9)] * count
    up, aside = (0.0,) * count + (1.0,), (pull,) + (0.0,) * count
    formulation: Any = "plane_strain" if plane else "solid"
    model = Model(
        mesh=box(element, *sides, np.linspace(0.0, _HEIGHT, 5)),
        materials={"bulk": Elastic(_MODULUS, 0.0, _DENSITY)},
        formulation=formulation,
        supports={"left": held} if held else {},
        contacts=(
            Contact("bottom", Plane(up, -1e-4), Coulomb(_MU), normal_penalty=_PENALTY, tangential_penalty=_PENALTY),
        ),
        gravity=tuple(-_GRAVITY * component for component in up),
        tractions={"right": aside},
        time=QuasiStatic(0.1, end=0.3),
    )
    return solve_problem(model)


def _rest(element: str) -> tuple[Check, ...]:
    pull = _SHARE * _MU * _PRESSURE * _LENGTH / _HEIGHT
    width = 1.0 if element == "Q4" else _LENGTH
    weight, pulling = _PRESSURE * _LENGTH * width, pull * _HEIGHT * width
    free, pulled, guided = _rested(element), _rested(element, pull=pull), _rested(element, held=("x",))
    sunk = -float(free["gap"].values[-1].mean())
    force = pulled["counterface_force"].values[-1, 0]
    sheared = float(np.average(pulled["contact_displacement"].values[-1, :, 0], weights=_areas(pulled)))
    carried = guided["counterface_force"].values[-1, 0, -1]
    return (
        relative("weight on the plate [N]", weight, free["counterface_force"].values[-1, 0, -1], _ALLOWED),
        relative("depth in the plate [m]", _PRESSURE / _PENALTY, sunk, _ALLOWED),
        relative("friction against a pull [N]", pulling, -force[0], _ALLOWED),
        relative("weight on the plate under a pull [N]", weight, force[-1], _ALLOWED),
        relative("mean slip of the springs [m]", pulling / (_PENALTY * _LENGTH * width), sheared, _ALLOWED),
        relative("weight on the plate, held along x [N]", weight, carried, _ALLOWED),
    )


def _areas(history: xr.Dataset) -> np.ndarray[Any, Any]:
    return np.asarray(history["contact_area"].values)


PROBLEMS = (Problem("resting-block", "Block on a plate, held by nothing else", "statics", False, _rest, ("Q4", "H8")),)
