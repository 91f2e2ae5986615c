"""Materials that relax by Prony terms: relaxation, creep, oscillation, vibration and contact.

Blocks in simple shear follow the shear modulus G(t) alone; bars in tension follow Young's modulus, whose relaxation for
one term and a constant bulk modulus k has the closed form ::

    E(t) = E_oo + (E_0 - E_oo) exp(-(3 k + G g)/(3 k + G) t/tau),    g = 1 - s

with E_0 and E_oo from G and g G. Strain that is linear within every step is followed exactly, so that a block that is
sheared by a ramp and held has only rounding. Where strain is not linear the error is of second order in the step.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

import numpy as np
import xarray as xr

from fingerslip.arrays import Floats
from fingerslip.contact.counterfaces import Cylinder
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.material import Formulation
from fingerslip.materials.prony import Prony, PronyTerm
from fingerslip.model.model import Component, Model, Recording, SupportMotion, Traction
from fingerslip.model.programme import Hold, Press, Ramp
from fingerslip.model.timing import QuasiStatic, TimeStepping, Timing
from fingerslip.sites import Site
from fingerslip.verification.line import line_model
from fingerslip.verification.meshes import axes_of, box, components
from fingerslip.verification.problem import Check, Problem, absolute, largest, relative, solve_problem

_SIZE, _SHIFT = 10e-3, 0.1e-3
_TERMS: Prony = (PronyTerm(0.3, 0.02), PronyTerm(0.2, 0.2), PronyTerm(0.2, 2.0))
_ONE: Prony = (PronyTerm(0.6, 0.1),)
_MODULUS, _RATIO, _DENSITY = 100e3, 0.4, 1000.0
_SHEAR = _MODULUS / (2 * (1 + _RATIO))


def response_integral(terms: Prony, time: Floats) -> Floats:
    """Return the integral of the stress over G after a strain of 1, from 0 to times (n,) [s], shape (n,) [s]."""
    result = time.copy()
    for term in terms:
        result -= term.share * (time + term.time * np.expm1(-time / term.time))
    return result


def ramp_response(terms: Prony, duration: float, time: Floats) -> Floats:
    """Return the stress over G of a strain that rises to 1 within a duration [s] and stays, at times (n,) [s]."""
    before, after = (response_integral(terms, past) for past in (np.maximum(time - duration, 0.0), time))
    return np.asarray((after - before) / duration)


def complex_modulus(terms: Prony, frequency: float) -> complex:
    """Return storage and loss modulus over G at an angular frequency [rad/s]."""
    turns = 1j * frequency * np.array([term.time for term in terms])
    shares = np.array([term.share for term in terms])
    return complex(1.0 - np.sum(shares / (1.0 + turns)))


def _block(
    formulation: Formulation,
    terms: Prony,
    time: Timing,
    *,
    motion: Ramp | None = None,
    traction: Ramp | None = None,
    cells: int = 2,
    velocity: float = 0.0,
) -> xr.Dataset:
    """Return what happens to a block in simple shear: its upper side moves, or a traction of 1 kPa pulls it."""
    element = "H8" if formulation == "solid" else "Q4"
    held: dict[str, tuple[Component, ...]] = {"bulk": axes_of(element)[1:], "bottom": ("x",)}
    motions, loads = {}, {}
    if motion is not None:
        held["top"], motions["top"] = ("x",), SupportMotion(components(element, _SHIFT, 0.0, 0.0), motion)
    if traction is not None:
        loads["top"] = Traction(components(element, 1e3, 0.0, 0.0), traction)
    model = Model(
        mesh=box(element, *[np.linspace(0.0, _SIZE, cells + 1)] * 3),
        materials={"bulk": Elastic(_MODULUS, _RATIO, _DENSITY, prony=terms)},
        formulation=formulation,
        depth=_SIZE if element == "Q4" else 1.0,
        supports=held,
        support_motions=motions,
        tractions=loads,
        initial_velocity=components(element, velocity, 0.0, 0.0) if velocity else None,
        time=time,
        record=Recording(sites=(Site("top", "probe", components(element, _SIZE / 2, _SIZE / 2, _SIZE)),)),
    )
    return solve_problem(model)


def _force(history: xr.Dataset, support: str) -> Floats:
    """Return the force of a support along x over time [N]."""
    return np.asarray(history["support_force"].sel(support=support).values[:, 0])


def _relaxation() -> Iterator[Check]:
    """Shear a block by a ramp and hold it: exact but for rounding; pull a bar: second order."""
    ramp, scale = Ramp((0.0, 0.1), (0.0, 1.0)), _SHEAR * _SHIFT * _SIZE
    for formulation in get_args(Formulation):
        history = _block(formulation, _TERMS, QuasiStatic(0.01, end=1.0), motion=ramp)
        expected = scale * ramp_response(_TERMS, 0.1, history["time"].values)
        force = _force(history, "top")
        yield largest(f"{formulation}: shear force, largest error / elastic", expected, force, 1e-10, scale)
        stress = history["stress"].sel(stress_component="xz" if formulation == "solid" else "xy").values[:, 0]
        force = stress * _SIZE**2
        yield largest(f"{formulation}: shear stress, largest error / elastic", expected, force, 1e-10, scale)
    in_tension: tuple[Formulation, ...] = ("plane_stress", "solid")
    for formulation in in_tension:
        errors = [stretched_bar(formulation, QuasiStatic(step, end=1.0))[1] for step in (0.02, 0.01)]
        order = float(np.log2(errors[0] / errors[1]))
        yield absolute(f"{formulation}: tension, largest error / elastic", 0.0, errors[1], 1e-4)
        yield absolute(f"{formulation}: tension, order in the step", 2.0, order, 0.1)


def stretched_bar(formulation: Formulation, time: Timing) -> tuple[xr.Dataset, float]:
    """Return what happens to a bar that is stretched by a ramp of 0.1 s and held, and the largest error of its force.

    The bar has one Prony term; the error is over the elastic force [-].
    """
    element, duration = "H8" if formulation == "solid" else "Q4", 0.1
    held: dict[str, tuple[Component, ...]] = {"left": ("x",), "right": ("x",), "bottom": axes_of(element)[-1:]}
    motion = SupportMotion(components(element, _SHIFT, 0.0, 0.0), Ramp((0.0, duration), (0.0, 1.0)))
    model = Model(
        mesh=box(element, *[np.linspace(0.0, _SIZE, 3)] * 3),
        materials={"bulk": Elastic(_MODULUS, _RATIO, _DENSITY, prony=_ONE)},
        formulation=formulation,
        depth=_SIZE if element == "Q4" else 1.0,
        supports=held | ({"front": ("y",)} if element == "H8" else {}),
        support_motions={"right": motion},
        time=time,
    )
    history = solve_problem(model)
    bulk, left = _MODULUS / (3 * (1 - 2 * _RATIO)), 1.0 - _ONE[0].share
    at_once, in_the_end = (9 * bulk * modulus / (3 * bulk + modulus) for modulus in (_SHEAR, left * _SHEAR))
    slower = (3 * bulk + _SHEAR) / (3 * bulk + left * _SHEAR)
    young = (PronyTerm(1.0 - in_the_end / at_once, slower * _ONE[0].time),)
    scale = at_once * _SHIFT * _SIZE
    expected = scale * ramp_response(young, duration, history["time"].values)
    return history, float(np.abs(_force(history, "right") - expected).max() / scale)


def _creep() -> Iterator[Check]:
    """Pull a block by a traction that rises and stays: its compliance retards with tau / (1 - s)."""
    share, time = _ONE[0].share, _ONE[0].time
    left, duration = 1.0 - share, 0.05
    elastic = 1e3 * _SIZE / _SHEAR
    errors = []
    for step in (0.01, 0.005):
        history = _block("plane_strain", _ONE, QuasiStatic(step, end=2.0), traction=Ramp((0.0, duration), (0.0, 1.0)))
        # A compliance 1 + s/(1-s) (1 - exp(...)) is that of a term with a negative share.
        t = history["time"].values
        retarded = time / left

        def integral(t: Floats, retarded: float = retarded) -> Floats:
            return np.asarray(t + share / left * (t + retarded * np.expm1(-t / retarded)))

        expected = elastic * (integral(t) - integral(np.maximum(t - duration, 0.0))) / duration
        errors.append(float(np.abs(history["displacement"].values[:, 0, 0] - expected).max() / elastic))
    yield absolute("displacement, largest error / elastic", 0.0, errors[1], 1e-3)
    yield absolute("order in the step", 2.0, float(np.log2(errors[0] / errors[1])), 0.1)
    end = float(history["displacement"].values[-1, 0, 0])
    yield relative("in the end / elastic", 1.0 / left, end / elastic, 1e-3)


def _oscillation() -> Iterator[Check]:
    """Shear a block to and fro; with n steps a period linear strain within a step damps by (2 pi/n)^2/12."""
    terms, count, periods = _TERMS[:2], 200, 4
    for frequency in (0.3, 3.0, 20.0):
        rate = 2 * np.pi * frequency
        times = np.arange(periods * count + 1) / (count * frequency)
        # So long after the start that what it left has relaxed: the slowest term is added as its closed form says.
        history = _block(
            "plane_strain",
            terms,
            QuasiStatic(float(times[1]), end=float(times[-1])),
            motion=Ramp(tuple(times.tolist()), tuple(np.sin(rate * times).tolist())),
        )
        expected = complex_modulus(terms, rate)
        ratio = _force(history, "top") / (_SHEAR * _SHIFT * _SIZE)
        for term in terms:
            turns = rate * term.time
            ratio += term.share * turns / (1 + turns**2) * np.exp(-times / term.time)
        last = slice(-count, None)
        storage = 2 * float(np.mean(ratio[last] * np.sin(rate * times[last])))
        loss = 2 * float(np.mean(ratio[last] * np.cos(rate * times[last])))
        yield relative(f"storage modulus / G at {frequency:g} Hz", expected.real, storage, 1e-3)
        yield relative(f"loss modulus / G at {frequency:g} Hz", expected.imag, loss, 1e-3)


def _vibration() -> Iterator[Check]:
    """Let a block of one cell, k = G A/H and m = rho A H/3, swing freely after a start with a velocity.

    Its displacement is the inverse transform of v / (p^2 + w^2 (g + p tau)/(1 + p tau)): a sum over three poles.
    """
    square = 3 * _SHEAR / (_DENSITY * _SIZE**2)
    time = 1.0 / float(np.sqrt(square))
    terms: Prony = (PronyTerm(0.5, time),)
    end, errors = 64 * time / 4, []
    for count in (400, 800):
        scheme = TimeStepping(end / count, alpha=0.0, end=end)
        history = _block("plane_strain", terms, scheme, cells=1, velocity=1e-3)
        expected = _swing(square, terms[0], history["time"].values)
        errors.append(float(np.abs(history["displacement"].values[:, 0, 0] / 1e-3 - expected).max() / expected.max()))
    energy = history["viscous_dissipation"].values[-1] / history["kinetic_energy"].values[0]
    yield absolute("displacement, largest error / largest", 0.0, errors[1], 1e-3)
    yield absolute("order in the step", 2.0, float(np.log2(errors[0] / errors[1])), 0.1)
    yield relative("viscous dissipation / energy at the start", 1.0, float(energy), 0.01)


def _swing(square: float, term: PronyTerm, times: Floats) -> Floats:
    """Return the displacement over the velocity at the start [s]."""
    left = 1.0 - term.share
    polynomial = np.array([term.time, 1.0, square * term.time, square * left])
    poles, slope = np.roots(polynomial), np.polyder(polynomial)
    amplitude = np.zeros(times.size, dtype=complex)
    for pole in poles:
        amplitude += (1.0 + pole * term.time) / np.polyval(slope, pole) * np.exp(pole * times)
    return amplitude.real


def _limits(terms: Prony, left: float) -> Iterator[Check]:
    """Relax far later or far sooner than anything happens: elastic, with the modulus at once or what is left of it."""
    history = _block("solid", terms, TimeStepping(1e-3, end=1.0), motion=Ramp((0.0, 0.5), (0.0, 1.0)))
    force = _force(history, "top")[-1] / (_SHEAR * _SHIFT * _SIZE)
    yield relative("force / elastic force", left, float(force), 1e-5)


def _hertz() -> Iterator[Check]:
    """Press a cylinder on a half-plane and hold: while contact grows or stays, the force is that of Lee & Radok.

    It is the elastic force history, each growth of it relaxed since; the area of contact follows the approach alone.
    """
    depth, terms = 3e-6, (PronyTerm(0.4, 0.2), PronyTerm(0.3, 2.0))
    programme = (Press(depth, depth), Hold(2.0))
    histories = [
        solve_problem(line_model("Q4", lambda x: 0.0 * x, Cylinder(200e-3), programme, cells=8, mu=0.0, prony=layers))
        for layers in ((), terms)
    ]
    elastic, viscous = (history["counterface_force"].values[:, 0, 1] for history in histories)
    times, expected = histories[0]["time"].values, np.zeros_like(elastic)
    for start, growth in zip(times, np.diff(elastic), strict=False):
        expected += growth * ramp_response(terms, float(times[1]), np.maximum(times - start, 0.0))
    end = float(expected[-1] / elastic[-1])
    widths = [int((history["normal_traction"].values[-1] > 0).sum()) for history in histories]
    yield largest("force, largest error / largest", expected, viscous, 2e-3, elastic.max())
    yield relative("force at the end / elastic force", end, viscous[-1] / elastic[-1], 2e-3)
    yield absolute("nodes in contact at the end, difference to elastic", 0.0, widths[1] - widths[0], 0.5)


_LIMITS = {
    "relaxed long after the end": ((PronyTerm(0.6, 1e6),), 1.0),
    "relaxed at once": ((PronyTerm(0.6, 1e-3),), 0.4),
}
_SIMO, _RADOK = "Prony series; Simo & Hughes 1998", "Lee & Radok 1960"
PROBLEMS = (
    Problem("relaxation", "Block sheared, bar pulled, and held", _SIMO, _relaxation),
    Problem("retardation", "Block under a constant shear traction", "standard linear solid", _creep),
    Problem("complex-modulus", "Block sheared to and fro", "Ferry 1980", _oscillation),
    Problem("viscous-vibration", "Block that swings freely", "Laplace transform", _vibration),
    Problem("viscous-limits", "Relaxation far later and far sooner", "Hooke's law", _limits, _LIMITS),
    Problem("viscous-hertz", "Cylinder pressed on a body that relaxes, and held", _RADOK, _hertz),
)
