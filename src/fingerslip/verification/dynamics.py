"""Time integration: an oscillator, a bar, a rod that strikes a wall, and a plate that is free to move."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.material import Formulation
from fingerslip.model.model import Contact, Drive, Model, Recording
from fingerslip.model.programme import Hold
from fingerslip.model.timing import TimeStepping
from fingerslip.sites import Site
from fingerslip.verification.meshes import axes_of, box, components, dimension
from fingerslip.verification.problem import Check, Problem, absolute, each, largest, relative, solve_problem

Array = NDArray[np.float64]

_LENGTH, _MODULUS, _DENSITY = 1.0, 1e6, 1000.0
_WAVE_SPEED = float(np.sqrt(_MODULUS / _DENSITY))


def _uniaxial(element: str) -> Formulation:
    return "plane_stress" if dimension(element) == 2 else "solid"


def _bar(element: str, cells: int, width: float, time: TimeStepping) -> xr.Dataset:
    """Return the history of a bar that is fixed at one end and starts at 1 m/s; its other end is recorded."""
    thin = np.array([0.0, width])
    model = Model(
        mesh=box(element, np.linspace(0.0, _LENGTH, cells + 1), thin, thin),
        materials={"bulk": Elastic(_MODULUS, 0.0, _DENSITY)},
        formulation=_uniaxial(element),
        supports={"left": ("x",), "bulk": axes_of(element)[1:]},
        initial_velocity=components(element, 1.0, 0.0, 0.0),
        time=time,
        record=Recording(sites=(Site("end", "", components(element, _LENGTH, 0.0, 0.0)),)),
    )
    return solve_problem(model)


def _oscillator(step: float, end: float, alpha: float) -> xr.Dataset:
    """Return the history of one cell, whose only free motion is the stretch.

    Its stiffness is E A / L, and its mass, which is consistent, rho A L / 3.
    """
    return _bar("Q4", 1, 0.1, TimeStepping(step, alpha, end=end))


_ROTATION = float(np.sqrt(3.0)) * _WAVE_SPEED / _LENGTH


def _hht_order() -> Iterator[Check]:
    """Fit the order over halved steps; 0.05 is left of the way to the asymptotic one at 40 to 160 steps a period."""
    period = 2 * np.pi / _ROTATION
    for alpha in (0.0, -0.05, -1 / 3):
        errors = []
        for count in (40, 80, 160):
            history = _oscillator(period / count, 2.25 * period, alpha)
            exact = np.sin(_ROTATION * history["time"].values) / _ROTATION
            errors.append(float(np.abs(history["displacement"].values[:, 0, 0] - exact).max()))
        order = float(np.polyfit(np.log([4.0, 2.0, 1.0]), np.log(errors), 1)[0])
        yield absolute(f"alpha = {alpha:.3g}: order of convergence", 2.0, order, 0.05)


def _hht_damping() -> Iterator[Check]:
    """Take 1e4 radians as a step, 1e-8 from infinity in its square.

    That moves the double root of -0.05 by 1e-4, and the threefold one of -1/3 by 2e-3: allowed are 1e-3 and 5e-3.
    """
    for alpha, allowed in ((-0.05, 1e-3), (-1 / 3, 5e-3)):
        # The largest root of the recurrence that the displacements obey.
        values = _oscillator(1e4 / _ROTATION, 12e4 / _ROTATION, alpha)["displacement"].values[1:, 0, 0]
        rows = np.stack([values[i : i + 3] for i in range(len(values) - 3)])
        weights = 1.0 / np.abs(rows).max(axis=1)
        coefficients = np.linalg.lstsq(rows * weights[:, None], values[3:] * weights, rcond=None)[0]
        largest = float(np.abs(np.roots([1.0, *(-coefficients[::-1])])).max())
        yield relative(f"alpha = {alpha:.3g}: spectral radius", (1 + alpha) / (1 - alpha), largest, allowed)
    history = _oscillator(0.05 / _ROTATION, 100.0 / _ROTATION, 0.0)
    energy = history["kinetic_energy"].values + history["strain_energy"].values
    # 2000 steps, each with rounding of 1e-16 that may add up.
    yield absolute("alpha = 0: change of energy / energy", 0.0, float(np.abs(energy / energy[0] - 1).max()), 1e-11)


def _bar_frequencies(element: str) -> Iterator[Check]:
    """Read the first three frequencies of a bar from the spectrum of its end's motion.

    The trapezoidal rule lowers them by (omega h)^2 / 12, 1.3e-3 for the third of 50 steps, and consistent mass raises
    them by (k h)^2 / 24 = 4e-4 with 80 cells: 2e-3 altogether.
    """
    first = _WAVE_SPEED / (4 * _LENGTH)
    expected = [first, 3 * first, 5 * first]
    step = 1 / (250 * first)
    history = _bar(element, 80, 0.02, TimeStepping(step, 0.0, end=16 / first))
    signal = history["displacement"].values[:, 0, 0]
    window, count = np.hanning(signal.size) * (signal - signal.mean()), 8 * signal.size
    amplitude = np.log(np.abs(np.fft.rfft(window, count)) + 1e-300)
    for number, frequency in enumerate(expected, start=1):
        # A parabola through the log amplitudes around the nearest peak.
        near = round(frequency * step * count)
        low = int(near * 0.9)
        peak = low + int(np.argmax(amplitude[low : int(near * 1.1)]))
        before, at, after = amplitude[peak - 1 : peak + 2]
        measured = float((peak + 0.5 * (before - after) / (before - 2 * at + after)) / (step * count))
        yield relative(f"frequency {number} [Hz]", frequency, measured, 2e-3)


def _rod(element: str) -> Iterator[Check]:
    """Let a rod fly against a rigid wall at 0.1 m/s.

    Mean force within 0.5 %, momentum within 1 %: averages do not see the ringing of the front. The time of contact
    within 3 %: the front is spread over some cells when it returns.
    """
    speed, width = 0.1, 0.02
    thin, along = np.array([0.0, width]), np.linspace(0.0, _LENGTH, 201)
    area = width ** (dimension(element) - 1)
    round_trip = 2 * _LENGTH / _WAVE_SPEED
    up = Plane(components(element, 0.0, 0.0, 1.0))
    model = Model(
        mesh=box(element, thin, thin, along),
        materials={"bulk": Elastic(_MODULUS, 0.0, _DENSITY)},
        formulation=_uniaxial(element),
        contacts=(Contact("bottom", up, Coulomb(0.0), normal_penalty=1e3 * _MODULUS),),
        programme=(Hold(1.5 * round_trip),),
        initial_velocity=components(element, 0.0, 0.0, -speed),
        time=TimeStepping(round_trip / 400, -0.1),
    )
    # The wave's pressure E v0 / c over the penalty is 3 um; twice that while the front rings.
    history = solve_problem(model, penetration=2e-3 * speed / _WAVE_SPEED)
    at, force = history["time"].values / round_trip, history["counterface_force"].values[:, 0, -1]
    plateau = force[(at > 0.1) & (at < 0.9)]
    impulse = float(force.sum()) * round_trip / 400
    mass = _DENSITY * area * _LENGTH
    yield relative("contact force [N]", _MODULUS * area * speed / _WAVE_SPEED, float(plateau.mean()), 0.005)
    yield relative("contact time / (2 L / c)", 1.0, float(at[np.flatnonzero(force)[-1]]), 0.03)
    yield relative("impulse / (2 m v0)", 1.0, impulse / (2 * mass * speed), 0.01)


def _driven(element: str) -> Iterator[Check]:
    """Let a force act at once on a plate of mass m on a light column: x = F / k (1 - cos omega t).

    The column weighs a thousandth of the plate, and a third of it moves along. Its penalty spring is in series. 500
    steps a period and alpha = -0.05 take 1e-3 of the amplitude at most: 0.5 %.
    """
    width, force, mass, penalty = 0.1, 2.0, 1.0, 1e2 * _MODULUS
    area = width ** (dimension(element) - 1)
    stiffness = 1.0 / (_LENGTH / (_MODULUS * area) + 1.0 / (penalty * area))
    rotation = float(np.sqrt(stiffness / (mass * (1 + 1e-3 / 3))))
    thin, along = np.array([0.0, width]), np.linspace(0.0, _LENGTH, 9)
    down = Plane(components(element, 0.0, 0.0, -1.0))
    period = 2 * np.pi / rotation
    model = Model(
        mesh=box(element, thin, thin, along),
        materials={"bulk": Elastic(_MODULUS, 0.0, 1e-3 * mass / (area * _LENGTH))},
        formulation=_uniaxial(element),
        supports={"bottom": axes_of(element)},
        contacts=(Contact("top", down, Coulomb(0.0), normal_penalty=penalty, drive=Drive(mass, force)),),
        time=TimeStepping(period / 500, end=0.9 * period),
    )
    history = solve_problem(model, penetration=2.1 * force / (penalty * area))
    exact = force / stiffness * (1 - np.cos(rotation * history["time"].values))
    displacement = -history["counterface_displacement"].values[:, 0, -1]
    yield largest("displacement, largest error / largest", exact, displacement, 0.005)


_BOTH, _HILBER, _GRAFF = each("Q4", "H8"), "Hilber, Hughes & Taylor 1977", "Wave equation; Graff 1975"
PROBLEMS = (
    Problem("hht-order", "HHT-alpha on one oscillator: order", _HILBER, _hht_order),
    Problem("hht-damping", "HHT-alpha: damping and energy", _HILBER, _hht_damping),
    Problem("bar", "Free vibration of a bar", _GRAFF, _bar_frequencies, _BOTH),
    Problem("rod", "Rod against a rigid wall", _GRAFF, _rod, _BOTH),
    Problem("driven-plate", "Plate under a force on a column", "Newton's law; Graff 1975", _driven, _BOTH),
)
