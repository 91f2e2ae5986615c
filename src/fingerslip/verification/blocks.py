"""Blocks on a frictional plate: dragged, on a spring, set sliding, and in stick-slip; in 2D and in 3D.

Where all nodes are held along the plate's normal, a plate that comes forward by d gives the uniform pressure k_n d:
the normal load is known in closed form and constant.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from fingerslip.arrays import Floats
from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb, FrictionLaw, StaticKinetic
from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.model.model import Contact, Model, Recording
from fingerslip.model.programme import Hold, Press, Slide
from fingerslip.model.timing import QuasiStatic, TimeStepping
from fingerslip.sites import Site
from fingerslip.verification.meshes import axes_of, box, components, dimension, formulation_of
from fingerslip.verification.problem import Check, Problem, absolute, each, largest, relative, solve_problem

_HEIGHT, _MODULUS, _PENALTY, _DEPTH, _MU = 4e-3, 34e3, 1e8, 20e-6, 0.5
PRESSURE = _PENALTY * _DEPTH
# Of the block's shear H / G and of the penalty 1 / k_t; nu = 0, so G = E / 2.
SHEAR_STIFFNESS = 1.0 / (_HEIGHT / (_MODULUS / 2) + 1.0 / _PENALTY)


def block_on_plate(element: str, *grids: Floats, material: Elastic, plate: Mapping[str, Any], **values: Any) -> Model:
    """Return a block of one material between ascending coordinates [m], its lower side `bottom` on a flat plate.

    `plate` holds what its contact has beside boundary and counterface, `values` what the model has besides.
    """
    facing_up = {"counterface": Plane(components(element, 0.0, 0.0, 1.0))}
    contact: dict[str, Any] = {**facing_up, **plate}
    return Model(
        mesh=box(element, *grids),
        materials={"bulk": material},
        formulation=formulation_of(element),
        contacts=(Contact("bottom", **contact),),
        **values,
    )


def drag_block(
    element: str,
    friction: FrictionLaw,
    *,
    depth: float = _DEPTH,
    speed: float = 1e-3,
    travel: float = 1e-3,
    direction: tuple[float, ...] = (),
    steps: int = 50,
) -> xr.Dataset:
    """Return the history of a block pressed in one step and dragged in many, with uniform pressure and shear.

    `depth` and `travel` are the ways of press and slide [m], `speed` is that of the slide [m/s]; it goes along +x.
    """
    grid, axes = np.linspace(0.0, 10e-3, 6), axes_of(element)
    step = travel / speed / steps
    model = block_on_plate(
        element,
        *(grid, grid, np.linspace(0.0, _HEIGHT, 4)),
        material=Elastic(_MODULUS, 0.0, 1.0),
        plate={"friction": friction, "normal_penalty": _PENALTY, "tangential_penalty": _PENALTY},
        supports={"bulk": axes[-1:], "top": axes[:-1]},
        programme=(Press(depth, depth / step), Slide(travel, speed, direction or None)),
        time=QuasiStatic(step),
    )
    return solve_problem(model, penetration=depth * (1 + 1e-9))


def _drag(element: str) -> Iterator[Check]:
    """Everything is linear or Coulomb's law: rounding."""
    history = drag_block(element, Coulomb(_MU))
    moved = history["counterface_displacement"].values[1:, 0, 0]
    traction = history["tangential_traction"].values[1:, :, 0]
    expected = np.minimum(SHEAR_STIFFNESS * moved, _MU * PRESSURE)[:, None]
    stick = (SHEAR_STIFFNESS * moved < _MU * PRESSURE)[:, None]
    wrong = (history["contact_state"].values[1:] != np.where(stick, 1, 2)).sum()
    force = history["counterface_force"].values[-1, 0]
    yield largest("traction, largest error / (mu p)", expected, traction, 1e-9, _MU * PRESSURE)
    yield absolute("nodes in the wrong state", 0.0, float(wrong), 0.0)
    yield relative("F / N at the end", _MU, float(force[0] / force[-1]), 1e-12)


# A stiff block on a soft bar that pulls it back, pressed on a plate: stiffness of the bar [N/m], mass of the block and
# a third of the bar [kg], normal force [N], and angular frequency [rad/s].
STIFFNESS, MASS, LOAD = 100.0, 1.0, 1.0
ROTATION = float(np.sqrt(STIFFNESS / MASS))
_BAR, _BLOCK, _THICK = 1.0, 0.2, 0.1
# The bar weighs a thousandth of the block; a third of it moves along.
_BAR_SHARE = 1e-3


def _on_spring(
    element: str, friction: FrictionLaw, moves: tuple[Slide | Hold, ...], step: float, velocity: float
) -> xr.Dataset:
    """Return the history of the block; the plate reaches its load in the first step.

    The bar has k = E A / L = 100 N/m; all nodes are held across x. The plate's penalty is 2e6 times the bar's
    stiffness: its elastic slip is next to none, and the step is so long for the block's ringing on it that numerical
    damping ends that within a few steps.
    """
    width = _THICK ** (dimension(element) - 2)
    area, base = _THICK * width, _BLOCK * width
    block_mass = MASS / (1 + _BAR_SHARE / 3)
    along, thin = np.array([0.0, _BLOCK / 2, _BLOCK, _BLOCK + _BAR]), np.array([0.0, _THICK])
    regions = {"block": lambda x: x[0] < _BLOCK, "bar": lambda x: x[0] > _BLOCK}
    mesh = box(element, along, thin, thin, regions=regions)
    under = [facet for facet in mesh.boundaries["bottom"] if mesh.p[0, mesh.facets[:, facet]].mean() < _BLOCK]
    mesh = mesh.with_boundaries({"sole": np.array(under)})
    modulus = STIFFNESS * _BAR / area
    penalties = LOAD / base * 1e3, 2e6 * STIFFNESS / base
    model = Model(
        mesh=mesh,
        materials={
            "block": Elastic(1e6 * modulus, 0.0, block_mass / (_BLOCK * area)),
            "bar": Elastic(modulus, 0.0, _BAR_SHARE * block_mass / (_BAR * area)),
        },
        formulation="plane_stress" if dimension(element) == 2 else "solid",
        supports={"right": ("x",), "block": axes_of(element)[1:], "bar": axes_of(element)[1:]},
        contacts=(Contact("sole", Plane(components(element, 0.0, 0.0, 1.0)), friction, *penalties),),
        programme=(Press(1e-3, 1e-3 / step), *moves),
        time=TimeStepping(step, -0.05),
        initial_velocity=components(element, velocity, 0.0, 0.0),
        record=Recording(sites=(Site("block", "", components(element, 0.0, 0.0, 0.0)),)),
    )
    return solve_problem(model, penetration=1e-3 * (1 + 1e-9))


# Comes to rest near the middle of the dead zone, where a little error does not add a half cycle.
START_SPEED = 0.975


def coulomb_oscillator(element: str) -> xr.Dataset:
    """Return the history of the block that starts at 0.975 m/s from the relaxed spring, for five periods."""
    period = 2 * np.pi / ROTATION
    return _on_spring(element, Coulomb(_MU), (Hold(5 * period),), period / 500, START_SPEED)


def _extremes(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return times and values of the extremes of a curve, from a parabola through three points each."""
    inner = np.flatnonzero((values[1:-1] - values[:-2]) * (values[2:] - values[1:-1]) < 0) + 1
    before, at, after = values[inner - 1], values[inner], values[inner + 1]
    offset = 0.5 * (before - after) / (before - 2 * at + after)
    return times[inner] + offset * (times[1] - times[0]), at - 0.25 * (before - after) * offset


def _oscillator(element: str) -> Iterator[Check]:
    """Friction turns round within a step: 1/500 of a period, so 0.5 % for times and amplitudes.

    The position of rest has the drops of all half cycles in it: 2 % of mu N / k.
    """
    dead = _MU * LOAD / STIFFNESS
    history = coulomb_oscillator(element)
    position = history["displacement"].values[:, 0, 0]
    first = -dead + float(np.sqrt(dead**2 + START_SPEED**2 / ROTATION**2))
    halves = int(np.ceil((first / dead - 1) / 2))
    times, peaks = _extremes(history["time"].values, position)
    large = np.abs(peaks) > 1.5 * dead
    times, peaks = times[large], peaks[large]
    rest = (first - 2 * dead * halves) * (-1) ** halves
    period = 2 * float(np.mean(np.diff(times)))
    drop = 2 * float(np.mean(-np.diff(np.abs(peaks))))
    yield relative("first amplitude [mm]", 1e3 * first, 1e3 * float(peaks[0]), 0.005)
    yield relative("drop per cycle 4 mu N / k [mm]", 4e3 * dead, 1e3 * drop, 0.005)
    yield relative("period [s]", 2 * np.pi / ROTATION, period, 0.005)
    yield absolute("position of rest / (mu N / k)", rest / dead, float(position[-1]) / dead, 0.02)


_GRAVITY = 9.81


def _sliding(element: str) -> Iterator[Check]:
    """Let a heavy elastic block slide at 1 m/s on a plate at rest.

    It bounces on its own stiffness at about 1000 rad/s until material damping has ended that, which shifts the
    time of stopping by about 1 / 1000 s, 0.5 % of it: 1 %, and for the way, which has it twice, 2 %.
    """
    speed = 1.0
    model = block_on_plate(
        element,
        *(np.linspace(0, 0.2, 9), np.linspace(0, 0.1, 3), np.linspace(0, 0.05, 3)),
        material=Elastic(1e6, 0.3, 1000.0),
        plate={"counterface": Plane(components(element, 0.0, 0.0, 1.0), offset=0.0), "friction": Coulomb(_MU)},
        time=TimeStepping(2.5e-4, end=0.3),
        damping=RayleighDamping(stiffness=2e-4),
        gravity=components(element, 0.0, 0.0, -_GRAVITY),
        initial_velocity=components(element, speed, 0.0, 0.0),
    )
    # A thousandth of the height: the leading edge bears several times the mean pressure rho g h = 490 Pa.
    history = solve_problem(model, penetration=50e-6)
    position = history["contact_displacement"].values[:, :, 0].mean(axis=1)
    times, velocity = history["time"].values, history["contact_velocity"].values[:, :, 0].mean(axis=1) / speed
    # Where the straight line through the falling velocity, from 0.9 to 0.1 of that at the start, comes to zero.
    falling = (velocity < 0.9) & (velocity > 0.1) & (times < times[np.argmax(velocity < 0.1)])
    slope, start = np.polyfit(times[falling], velocity[falling], 1)
    yield relative("time v0 / (mu g) [s]", speed / (_MU * _GRAVITY), float(-start / slope), 0.01)
    yield relative("travel v0^2 / (2 mu g) [m]", speed**2 / (2 * _MU * _GRAVITY), float(position[-1]), 0.02)


# A plate drags the block and its friction drops at once where it slips: in closed form the stretch of the spring at the
# end of sticking beyond that which kinetic friction holds [m], the peak-to-peak way of the block [m], and the time to
# stick, 2 D / V, and to slip, (pi + 2 atan(V / (omega D))) / omega, together [s].
STATIC, KINETIC, SPEED = 0.5, 0.3, 0.02
_OVERSHOOT = (STATIC - KINETIC) * LOAD / STIFFNESS
SWING = 2 * float(np.hypot(_OVERSHOOT, SPEED / ROTATION))
PERIOD = 2 * _OVERSHOOT / SPEED + (np.pi + 2 * float(np.arctan2(SPEED, ROTATION * _OVERSHOOT))) / ROTATION


def stick_slip(element: str) -> xr.Dataset:
    """Return the history of the block on a plate that moves at 20 mm/s, for six periods."""
    law = StaticKinetic(STATIC, KINETIC, 1e-4 * SPEED)
    duration = 6 * PERIOD
    drive = Slide(duration * SPEED, SPEED)
    return _on_spring(element, law, (drive,), 2 * np.pi / ROTATION / 1000, 0.0)


def _stick_slip(element: str) -> Iterator[Check]:
    """The law takes the slip rate of the step before, so friction is a step late at both ends of slip.

    A step is 1/1000 of the oscillator's period and the state changes there at the plate's speed; 1 %.
    """
    history = stick_slip(element)
    times, peaks = _extremes(history["time"].values, history["displacement"].values[:, 0, 0])
    middle = 0.5 * (peaks.max() + peaks.min())
    far = np.abs(peaks - middle) > 0.4 * SWING
    tops, lows = peaks[far & (peaks > middle)], peaks[far & (peaks < middle)]
    period = float(np.mean(np.diff(times[far & (peaks > middle)])[1:]))
    swing = float(tops[1:].mean() - lows[1:].mean())
    yield relative("swing [mm]", 1e3 * SWING, 1e3 * swing, 0.01)
    yield relative("period [s]", PERIOD, period, 0.01)


_BOTH = each("Q4", "H8")
PROBLEMS = (
    Problem("dragged-block", "Block pressed and dragged", "Coulomb's law; simple shear", _drag, _BOTH),
    Problem("coulomb-oscillator", "Block on a spring and a plate", "Den Hartog 1931", _oscillator, _BOTH),
    Problem("sliding-block", "Block set sliding under gravity", "Coulomb's law; Newton", _sliding, _BOTH),
    Problem("stick-slip", "Block on a spring, dragged", "Popov 2010; Den Hartog 1931", _stick_slip, _BOTH),
)
