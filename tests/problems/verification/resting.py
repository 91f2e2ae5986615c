"""Blocks without inertia that only gravity and friction hold on a plate."""

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import box, components, formulation_of
from fingerslip.verification.problem import Problem, each, relative, solve_problem

_LENGTH, _HEIGHT, _MODULUS, _DENSITY, _GRAVITY, _PENALTY, _MU = 10e-3, 5e-3, 1e5, 1000.0, 9.81, 1e8, 0.5
_PRESSURE = _DENSITY * _GRAVITY * _HEIGHT
# The pull on the side, as a share of the friction that the weight can give.
_SHARE = 0.8
_ALLOWED = 1e-8


def _rested(element, *, pull=0.0, held=()):
    """Return the history of a block that is dropped from 0.1 mm and pulled on its right side by `pull` [Pa]."""
    up, side = components(element, 0.0, 0.0, 1.0), np.linspace(0.0, _LENGTH, 9)
    model = fs.Model(
        mesh=box(element, side, side, np.linspace(0.0, _HEIGHT, 5)),
        materials={"bulk": fs.Elastic(_MODULUS, 0.0, _DENSITY)},
        formulation=formulation_of(element),
        supports={"left": held} if held else {},
        contacts=(fs.Contact("bottom", fs.Plane(up, -1e-4), fs.Coulomb(_MU), _PENALTY, _PENALTY),),
        gravity=tuple(-_GRAVITY * component for component in up),
        tractions={"right": components(element, pull, 0.0, 0.0)},
        time=fs.QuasiStatic(0.1, end=0.3),
    )
    return solve_problem(model)


def _rest(element):
    pull = _SHARE * _MU * _PRESSURE * _LENGTH / _HEIGHT
    width = 1.0 if element == "Q4" else _LENGTH
    weight, pulling = _PRESSURE * _LENGTH * width, pull * _HEIGHT * width
    free, pulled, guided = _rested(element), _rested(element, pull=pull), _rested(element, held=("x",))
    sunk = -float(free["gap"].values[-1].mean())
    force = pulled["counterface_force"].values[-1, 0]
    areas = pulled["contact_area"].values
    sheared = float(np.average(pulled["contact_displacement"].values[-1, :, 0], weights=areas))
    carried = guided["counterface_force"].values[-1, 0, -1]
    yield relative("weight on the plate [N]", weight, free["counterface_force"].values[-1, 0, -1], _ALLOWED)
    yield relative("depth in the plate [m]", _PRESSURE / _PENALTY, sunk, _ALLOWED)
    yield relative("friction against a pull [N]", pulling, -force[0], _ALLOWED)
    yield relative("weight on the plate under a pull [N]", weight, force[-1], _ALLOWED)
    yield relative("mean slip of the springs [m]", pulling / (_PENALTY * _LENGTH * width), sheared, _ALLOWED)
    yield relative("weight on the plate, held along x [N]", weight, carried, _ALLOWED)


_TITLE = "Block on a plate, held by nothing else"
PROBLEMS = (Problem("resting-block", _TITLE, "statics", _rest, each("Q4", "H8")),)
