"""A rigid ball on a half-space: Hertz, Mindlin, and a tangential cycle.

Half of the body is computed, cut along the plane of the motion, 50 contact radii wide and deep; R is 50 contact radii,
nu = 0.48.

Tolerances, with cells of 1/8 of the contact radius: the square of that, 1.6 %; the far field, which beyond 50 radii
carries 0.42 / 50 = 0.8 % of the normal and 0.85 / 50 = 1.7 % of the tangential approach; Dundurs' beta = 0.038, which
enters net forces in second order. Hence 2 % for the contact radius and 3 % for all that combines these. 0.06, half a
cell, for the stick radius over the contact radius, which is taken from the area that sticks. 5 % rms of mu p0 for the
traction, as an edge half a cell off gives h / (2 a) / sqrt(h / a) = 18 % at its nodes, less than a tenth of all.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
import xarray as xr

from fingerslip.arrays import Floats
from fingerslip.contact.counterfaces import Sphere
from fingerslip.contact.friction import Coulomb
from fingerslip.materials.elastic import Elastic
from fingerslip.model.model import Contact, Model
from fingerslip.model.programme import Phase, Press, Slide
from fingerslip.model.timing import QuasiStatic
from fingerslip.verification.meshes import box, grade, mirror
from fingerslip.verification.problem import Check, Problem, absolute, relative, solve_problem

MODULUS, RATIO, MU = 1e5, 0.48, 0.5
SHEAR_MODULUS = MODULUS / (2 * (1 + RATIO))
PLANE_MODULUS = MODULUS / (1 - RATIO**2)
CONTACT_RADIUS, RADIUS = 1e-3, 50e-3
APPROACH = CONTACT_RADIUS**2 / RADIUS
SIZE = CONTACT_RADIUS / 8
OUTER = 50 * CONTACT_RADIUS
# Overall slip begins where the ball has moved mu times the approach times this.
OVERALL = (2 - RATIO) / (2 * (1 - RATIO))
_PRESS_STEPS, _SLIDE_STEPS = 10, 20


def _model(programme: tuple[Phase, ...], steps: int) -> Model:
    along = mirror(grade(1.25 * CONTACT_RADIUS, SIZE, OUTER, 2.0))
    aside = grade(1.25 * CONTACT_RADIUS, SIZE, OUTER, 2.0)
    heights = grade(0.75 * CONTACT_RADIUS, SIZE, OUTER, 1.8)
    contact = Contact(
        boundary="bottom",
        counterface=Sphere(RADIUS, centre=(0.0, 0.0, -RADIUS)),
        friction=Coulomb(MU),
        normal_penalty=1e3 * MODULUS / SIZE,
        tangential_penalty=1e3 * MODULUS / SIZE,
        search_distance=(1.25 * CONTACT_RADIUS) ** 2 / (2 * RADIUS),
    )
    return Model(
        mesh=box("H8", along, aside, heights),
        materials={"bulk": Elastic(MODULUS, RATIO, 1000.0)},
        formulation="solid",
        supports={"top": ("x", "y", "z"), "front": ("y",)},
        contacts=(contact,),
        programme=programme,
        time=QuasiStatic(1.0 / steps),
    )


# Half a second, that is 10 steps, to the approach.
_PRESS = Press(APPROACH, 2 * APPROACH)


@cache
def slid() -> xr.Dataset:
    """Return the history of a press (10 steps) and a slide into overall slip (20 steps)."""
    distance = 1.2 * OVERALL * MU * APPROACH
    return solve_problem(_model((_PRESS, Slide(distance, distance)), _SLIDE_STEPS), penetration=0.02 * APPROACH)


@cache
def press_and_cycle() -> xr.Dataset:
    """Return the history of a press (10 steps), a slide (20 steps), one back (40) and one forth (40)."""
    start_of_unloading = (1 - (1 - 0.8) ** (2 / 3)) * OVERALL * MU * APPROACH
    forth, back = (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)
    programme = (
        _PRESS,
        Slide(start_of_unloading, start_of_unloading, forth),
        Slide(2 * start_of_unloading, start_of_unloading, back),
        Slide(2 * start_of_unloading, start_of_unloading, forth),
    )
    return solve_problem(_model(programme, _SLIDE_STEPS), penetration=0.02 * APPROACH)


def _forces(history: xr.Dataset) -> tuple[Floats, Floats]:
    """Return the normal and the tangential force on the whole body, two halves, over time [N]."""
    force = 2 * history["counterface_force"].values[:, 0]
    return force[:, 2], force[:, 0]


def radii(history: xr.Dataset) -> Floats:
    """Return the distances of the contact nodes from the axis, shape (n_c,) [m]."""
    return np.asarray(np.linalg.norm(history["contact_position"].values[:, :2], axis=1))


def _contact_radius(force: float) -> float:
    return float((3 * force * RADIUS / (4 * PLANE_MODULUS)) ** (1 / 3))


def mindlin_displacement(force: Floats | float, normal: float) -> Floats:
    """Return Mindlin's displacement (n,) [m] under growing tangential forces (n,) and a constant normal one [N]."""
    factor = 3 * MU * normal * (2 - RATIO) / (16 * _contact_radius(normal) * SHEAR_MODULUS)
    return np.asarray(factor * (1 - (1 - np.asarray(force) / (MU * normal)) ** (2 / 3)))


def _hertz() -> Iterator[Check]:
    history = slid()
    force = float(_forces(history)[0][_PRESS_STEPS])
    radius = _contact_radius(force)
    peak = 3 * force / (2 * np.pi * radius**2)
    pressure, distance = history["normal_traction"].values[_PRESS_STEPS], radii(history)
    inside = distance < 0.8 * radius
    slope, square = np.polyfit(distance[inside] ** 2, pressure[inside] ** 2, 1)
    profile = peak * np.sqrt(np.maximum(1 - (distance / radius) ** 2, 0.0))
    error = np.sqrt(np.mean((pressure - profile)[distance < radius] ** 2)) / peak
    yield relative("contact radius [mm]", 1e3 * radius, 1e3 * float(np.sqrt(-square / slope)), 0.02)
    yield relative("approach [mm]", 1e3 * radius**2 / RADIUS, 1e3 * APPROACH, 0.03)
    yield relative("peak pressure [Pa]", peak, float(np.sqrt(square)), 0.03)
    yield absolute("profile: rms error / peak", 0.0, float(error), 0.05)


def _mindlin() -> Iterator[Check]:
    history = slid()
    normal, tangential = _forces(history)
    moved = history["counterface_displacement"].values[:, 0, 0]
    ratio = np.zeros_like(normal)
    ratio[1:] = tangential[1:] / (MU * normal[1:])
    yield from _stick_checks(history, ratio)
    partial = (ratio > 0.1) & (ratio < 0.95)
    force, first = float(normal[_PRESS_STEPS]), _PRESS_STEPS + 1
    expected = mindlin_displacement(tangential[partial], force)
    displacement = np.abs(moved[partial] - expected).max() / expected.max()
    # 1 - Q/(mu P) = (1 - delta/delta*)^(3/2): its 2/3 power is straight, and zero at overall slip.
    slope, start = np.polyfit(moved[partial], (1 - ratio[partial]) ** (2 / 3), 1)
    # The tangential stiffness before slip, from the first step, whose own slip Mindlin gives.
    share = float(tangential[first]) / (MU * force)
    stiffness = float(tangential[first]) / float(moved[first]) * 1.5 * (1 - (1 - share) ** (2 / 3)) / share
    yield absolute("displacement: largest error / largest", 0.0, float(displacement), 0.03)
    yield relative("k_t / k_n", 2 * (1 - RATIO) / (2 - RATIO), stiffness / (1.5 * force / APPROACH), 0.03)
    yield relative("delta_t / (mu delta_n) at overall slip", OVERALL, -start / slope / (MU * APPROACH), 0.03)
    yield relative("F / (mu N) at the end", 1.0, float(ratio[-1]), _ROLLING)


# Slipping tractions follow the ball's surface, which is tilted by up to a / R = 0.02 against its path: the net force
# differs from mu N in second order and by the way that the ball has moved over its radius.
_ROLLING = 1e-3


def _stick_checks(history: xr.Dataset, ratio: Floats) -> Iterator[Check]:
    distance, area, normal_force = radii(history), history["contact_area"].values, _forces(history)[0]
    for wanted in (0.3, 0.6, 0.9):
        step = _PRESS_STEPS + int(np.argmin(np.abs(ratio[_PRESS_STEPS:] - wanted)))
        normal = float(normal_force[step])
        radius = _contact_radius(normal)
        peak = 3 * normal / (2 * np.pi * radius**2)
        stick = float((1 - ratio[step]) ** (1 / 3))
        sticking = history["contact_state"].values[step] == 1
        stick_radius = float(np.sqrt(2 * area[sticking].sum() / np.pi)) / radius
        profile = np.sqrt(np.maximum(1 - (distance / radius) ** 2, 0.0))
        profile -= stick * np.sqrt(np.maximum(1 - (distance / (stick * radius)) ** 2, 0.0))
        error = (history["tangential_traction"].values[step, :, 0] / (MU * peak) - profile)[distance < radius]
        at = f"Q/(mu P) = {ratio[step]:.3f}"
        yield absolute(f"{at}: stick radius / a", stick, stick_radius, 0.06)
        yield absolute(f"{at}: traction, rms error / (mu p0)", 0.0, float(np.sqrt(np.mean(error**2))), 0.05)


def _cycle() -> Iterator[Check]:
    history = press_and_cycle()
    normal_force, tangential = _forces(history)
    normal, moved = float(normal_force[_PRESS_STEPS]), history["counterface_displacement"].values[:, 0, 0]
    turn, back = _PRESS_STEPS + _SLIDE_STEPS, _PRESS_STEPS + 3 * _SLIDE_STEPS
    largest = float(tangential[turn])
    ratio = largest / (MU * normal)
    virgin = float(mindlin_displacement(largest, normal))
    down = virgin - 2 * mindlin_displacement((largest - tangential[turn : back + 1]) / 2, normal)
    up = -virgin + 2 * mindlin_displacement((tangential[back:] + largest) / 2, normal)
    radius, compliance = _contact_radius(normal), (2 - RATIO) / SHEAR_MODULUS
    shape = 1 - (1 - ratio) ** (5 / 3) - 5 * ratio / 6 * (1 + (1 - ratio) ** (2 / 3))
    loss = 9 * (MU * normal) ** 2 * compliance / (10 * radius) * shape
    dissipation = history["friction_dissipation"].values
    for name, path, expected in (("unloading", moved[turn : back + 1], down), ("reloading", moved[back:], up)):
        yield absolute(f"{name}: largest error / delta*", 0.0, float(np.abs(path - expected).max() / virgin), 0.03)
    yield relative("Q after the cycle / Q before", 1.0, float(tangential[-1]) / largest, 0.01)
    # The loss goes with the cube of the force in small slip: three times the 3 % of the displacement.
    yield relative("dissipation per cycle [uJ]", 1e6 * loss, 2e6 * float(dissipation[-1] - dissipation[turn]), 0.09)


_TITLE, _SOURCE = "Ball pushed forth, back and forth at constant load", "Mindlin & Deresiewicz 1953"
PROBLEMS = (
    Problem("hertz-sphere", "Rigid ball on a half-space", "Hertz 1882; Johnson 1985", _hertz, slow=True),
    Problem("mindlin", "Ball pressed, then pushed sideways", "Mindlin 1949; Johnson 1985", _mindlin, slow=True),
    Problem("tangential-cycle", _TITLE, _SOURCE, _cycle, slow=True),
)
