"""Time integration: an oscillator, a bar, and a rod that strikes a wall."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.materials.elastic import Elastic
from fingerslip.model.model import Component, Contact, Drive, Model, Recording
from fingerslip.model.programme import Hold
from fingerslip.model.timing import TimeStepping
from fingerslip.sites import Site
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Check, Problem, absolute, relative, solve_problem

Array = NDArray[np.float64]

_LENGTH, _MODULUS, _DENSITY = 1.0, 1e6, 1000.0
_WAVE_SPEED = float(np.sqrt(_MODULUS / _DENSITY))


def _oscillator(step: float, end: float, alpha: float) -> Any:
    """Return the history of one cell, held at one end, whose other end starts at 1 m/s.

    Its only free motion is the stretch: stiffness E A / L and, with consistent mass, rho A L / 3.
    """
    mesh = box("Q4", np.array([0.0, _LENGTH]), np.array([0.0, 0.1]))
    model = Model(
        mesh=mesh,
        materials={"bulk": Elastic(_MODULUS, 0.0, _DENSITY)},
        formulation="plane_stress",
        supports={"left": ("x",), "bulk": ("y",)},
        initial_velocity=(1.0, 0.0),
        time=TimeStepping(step, alpha, end=end),
        record=Recording(sites=(Site("end", "", (_LENGTH, 0.0)),)),
    )
    return solve_problem(model)


_ROTATION = float(np.sqrt(3.0)) * _WAVE_SPEED / _LENGTH


def _hht_order() -> tuple[Check, ...]:
    """Fit the order over halved steps; 0.05 is left of the way to the asymptotic one at 40 to 160 steps a period."""
    period = 2 * np.pi / _ROTATION
    checks = []
    for alpha in (0.0, -0.05, -1 / 3):
        errors = []
        for count in (40, 80, 160):
            history = _oscillator(period / count, 2.25 * period, alpha)
            exact = np.sin(_ROTATION * history["time"].values) / _ROTATION
            errors.append(float(np.abs(history["displacement"].values[:, 0, 0] - exact).max()))
        order = float(np.polyfit(np.log([4.0, 2.0, 1.0]), np.log(errors), 1)[0])
        checks.append(absolute(f"alpha = {alpha:.3g}: order of convergence", 2.0, order, 0.05))
    return tuple(checks)


def _spectral_radius(alpha: float) -> float:
    """Return the largest root of the recurrence that the displacements at a very large step obey."""
    history = _oscillator(1e4 / _ROTATION, 12e4 / _ROTATION, alpha)
    values = history["displacement"].values[1:, 0, 0]
    rows = np.stack([values[i : i + 3] for i in range(len(values) - 3)])
    weights = 1.0 / np.abs(rows).max(axis=1)
    coefficients = np.linalg.lstsq(rows * weights[:, None], values[3:] * weights, rcond=None)[0]
    return float(np.abs(np.roots([1.0, *(-coefficients[::-1])])).max())


def _hht_damping() -> tuple[Check, ...]:
    """Take 1e4 radians as a step, 1e-8 from infinity in its square.

    That moves the double root of -0.05 by 1e-4, and the threefold one of -1/3 by 2e-3: allowed are 1e-3 and 5e-3.
    """
    checks = [
        relative(f"alpha = {alpha:.3g}: spectral radius", (1 + alpha) / (1 - alpha), _spectral_radius(alpha), allowed)
        for alpha, allowed in ((-0.05, 1e-3), (-1 / 3, 5e-3))
    ]
    history = _oscillator(0.05 / _ROTATION, 100.0 / _ROTATION, 0.0)
    energy = history["kinetic_energy"].values + history["strain_energy"].values
    # 2000 steps, each with rounding of 1e-16 that may add up.
    drift = float(np.abs(energy / energy[0] - 1).max())
    return (*checks, absolute("alpha = 0: change of energy / energy", 0.0, drift, 1e-11))


def _bar_mesh(element: str, count: int) -> Any:
    thin = np.array([0.0, 0.02])
    axes = [np.linspace(0.0, _LENGTH, count + 1), thin, thin]
    return box(element, *axes[: 2 if element == "Q4" else 3])


def _bar_frequencies() -> tuple[Check, ...]:
    """Read the first three frequencies of a bar from the spectrum of its end's motion.

    The trapezoidal rule lowers them by (omega h)^2 / 12, 1.3e-3 for the third of 50 steps, and consistent mass raises
    them by (k h)^2 / 24 = 4e-4 with 80 cells: 2e-3 altogether.
    """
    return (*_spectrum("Q4"), *_spectrum("H8"))


def _spectrum(element: str) -> tuple[Check, ...]:
    first = _WAVE_SPEED / (4 * _LENGTH)
    plane = element == "Q4"
    across: tuple[Component, ...] = ("y",) if plane else ("y", "z")
    position: tuple[float, ...] = (_LENGTH, 0.0) if plane else (_LENGTH, 0.0, 0.0)
    model = Model(
        mesh=_bar_mesh(element, 80),
        materials={"bulk": Elastic(_MODULUS, 0.0, _DENSITY)},
        formulation="plane_stress" if plane else "solid",
        supports={"left": ("x",), "bulk": across},
        initial_velocity=(1.0, 0.0, 0.0)[: len(position)],
        time=TimeStepping(1 / (250 * first), 0.0, end=16 / first),
        record=Recording(sites=(Site("end", "", position),)),
    )
    history = solve_problem(model)
    end = history["displacement"].values[:, 0, 0]
    peaks = _peaks(end, float(model.time.step), [first * (2 * n - 1) for n in (1, 2, 3)])
    return tuple(
        relative(f"{element}: frequency {n} [Hz]", first * (2 * n - 1), peak, 2e-3)
        for n, peak in zip((1, 2, 3), peaks, strict=True)
    )


def _peaks(signal: Array, step: float, guesses: list[float]) -> list[float]:
    """Return the frequencies [Hz] of the spectral peaks nearest to guesses, from a parabola through log amplitudes."""
    window = np.hanning(signal.size) * (signal - signal.mean())
    count = 8 * signal.size
    amplitude = np.log(np.abs(np.fft.rfft(window, count)) + 1e-300)
    peaks = []
    for guess in guesses:
        near = round(guess * step * count)
        low = int(near * 0.9)
        peak = low + int(np.argmax(amplitude[low : int(near * 1.1)]))
        before, at, after = amplitude[peak - 1 : peak + 2]
        peaks.append(float((peak + 0.5 * (before - after) / (before - 2 * at + after)) / (step * count)))
    return peaks


def _rod() -> tuple[Check, ...]:
    return (*_strike("Q4"), *_strike("H8"))


def _strike(element: str) -> tuple[Check, ...]:
    """Let a rod fly against a rigid wall at 0.1 m/s.

    Mean force within 0.5 %, momentum within 1 %: averages do not see the ringing of the front. The time of contact
    within 3 %: the front is spread over some cells when it returns.
    """
    speed, width = 0.1, 0.02
    plane = element == "Q4"
    thin, along = np.array([0.0, width]), np.linspace(0.0, _LENGTH, 201)
    area = width if plane else width**2
    round_trip = 2 * _LENGTH / _WAVE_SPEED
    contact = Contact(
        boundary="bottom",
        counterface=Plane((0.0, 1.0) if plane else (0.0, 0.0, 1.0)),
        friction=Coulomb(0.0),
        normal_penalty=1e3 * _MODULUS,
    )
    model = Model(
        mesh=box(element, thin, along) if plane else box(element, thin, thin, along),
        materials={"bulk": Elastic(_MODULUS, 0.0, _DENSITY)},
        formulation="plane_stress" if plane else "solid",
        contacts=(contact,),
        programme=(Hold(1.5 * round_trip),),
        initial_velocity=(0.0, -speed) if plane else (0.0, 0.0, -speed),
        time=TimeStepping(round_trip / 400, -0.1),
    )
    # The wave's pressure E v0 / c over the penalty is 3 um; twice that while the front rings.
    history = solve_problem(model, penetration=2e-3 * speed / _WAVE_SPEED)
    at, force = history["time"].values / round_trip, history["counterface_force"].values[:, 0, -1]
    plateau = force[(at > 0.1) & (at < 0.9)]
    impulse = float(force.sum()) * round_trip / 400
    mass = _DENSITY * area * _LENGTH
    return (
        relative(f"{element}: contact force [N]", _MODULUS * area * speed / _WAVE_SPEED, float(plateau.mean()), 0.005),
        relative(f"{element}: contact time / (2 L / c)", 1.0, float(at[np.flatnonzero(force)[-1]]), 0.03),
        relative(f"{element}: impulse / (2 m v0)", 1.0, impulse / (2 * mass * speed), 0.01),
    )


def _driven(element: str) -> tuple[Check, ...]:
    """Let a force act at once on a plate of mass m on a light column: x = F / k (1 - cos omega t).

    The column weighs a thousandth of the plate, and a third of it moves along. Its penalty spring is in series. 500
    steps a period and alpha = -0.05 take 1e-3 of the amplitude at most: 0.5 %.
    """
    plane, width, force, mass = element == "Q4", 0.1, 2.0, 1.0
    area = width if plane else width**2
    stiffness = 1.0 / (_LENGTH / (_MODULUS * area) + 1.0 / (1e2 * _MODULUS * area))
    rotation = float(np.sqrt(stiffness / (mass * (1 + 1e-3 / 3))))
    thin, along = np.array([0.0, width]), np.linspace(0.0, _LENGTH, 9)
    down = (0.0, -1.0) if plane else (0.0, 0.0, -1.0)
    contact = Contact(
        boundary="top",
        counterface=Plane(down),
        friction=Coulomb(0.0),
        normal_penalty=1e2 * _MODULUS,
        drive=Drive(mass, force),
    )
    period = 2 * np.pi / rotation
    model = Model(
        mesh=box(element, thin, along) if plane else box(element, thin, thin, along),
        materials={"bulk": Elastic(_MODULUS, 0.0, 1e-3 * mass / (area * _LENGTH))},
        formulation="plane_stress" if plane else "solid",
        supports={"bottom": ("x", "y") if plane else ("x", "y", "z")},
        contacts=(contact,),
        time=TimeStepping(period / 500, end=0.9 * period),
    )
    history = solve_problem(model, penetration=2.1 * force / (1e2 * _MODULUS * area))
    exact = force / stiffness * (1 - np.cos(rotation * history["time"].values))
    displacement = -history["counterface_displacement"].values[:, 0, -1]
    error = float(np.abs(displacement - exact).max() / exact.max())
    return (absolute("displacement, largest error / largest", 0.0, error, 0.005),)


PROBLEMS = (
    Problem("hht-order", "HHT-alpha on one oscillator: order", "Hilber, Hughes & Taylor 1977", False, _hht_order),
    Problem("hht-damping", "HHT-alpha: damping and energy", "Hilber, Hughes & Taylor 1977", False, _hht_damping),
    Problem("bar", "Free vibration of a bar", "Wave equation; Graff 1975", slow=False, compute=_bar_frequencies),
    Problem("rod", "Rod against a rigid wall", "Wave equation; Graff 1975", slow=False, compute=_rod),
    Problem(
        "driven-plate", "Plate under a force on a column", "Newton's law; Graff 1975", False, _driven, ("Q4", "H8")
    ),
)
