"""The number from our runs that each published statement is compared with.

Whether the statement holds says the rule at the end of its `check` in ``data/published/wang2014.yaml``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fingerslip.arrays import Floats
from fingerslip.validation.evidence import FINGERPRINT, FRICTION, TABLE2, VARIANTS, Evidence
from fingerslip.validation.measures import Densities, Measures
from fingerslip.validation.rows import Outcome

Runs = Sequence[Measures]
Number = Floats | float | tuple[int, int]

_FRICTIONS = (0.2, 0.4, 0.6, 0.8)
_LARGER_IN_B = ("FA-I", "FA-II", "SA-II")


def outcome_of(name: str, evidence: Evidence) -> Outcome:
    """Return the number of a check, counts of what is lost, or None where an event did not happen."""
    with np.errstate(all="ignore"):
        if name in PHALANX_CHECKS:
            outcome = PHALANX_CHECKS[name](evidence.phalanges(TABLE2))
        elif name in FRICTION_CHECKS:
            runs = [evidence.one("wang2014_friction", {FRICTION: friction}) for friction in _FRICTIONS]
            outcome = FRICTION_CHECKS[name](runs)
        else:
            both = (evidence.phalanges("wang2014_fingerprint", {FINGERPRINT: enabled}) for enabled in (True, False))
            outcome = FINGERPRINT_CHECKS[name](*both)
    return outcome if isinstance(outcome, tuple) else float(outcome) if np.isfinite(outcome) else None


def _times(runs: Runs, event: str) -> Floats:
    return np.array([run.run.events.slip.time(event) for run in runs], dtype=np.float64)


def _heights(runs: Runs) -> Floats:
    """Return the heights of the peaks of overall slip [m/s^2]."""
    return np.array([np.nan if run.overall_peak is None else run.overall_peak.height for run in runs])


def _numbers(runs: Runs, name: str) -> Floats:
    return np.array([getattr(run, name) for run in runs], dtype=np.float64)


def _ratio(part: ArrayLike, whole: ArrayLike) -> Floats:
    return np.asarray(part) / np.where(np.asarray(whole) == 0.0, np.nan, whole)


def _surface_over_deep(runs: Runs) -> Floats:
    largest = [runs[0].largest_acceleration.get(kind) for kind in ("FA-I", "SA-I", "FA-II", "SA-II")]
    values = np.array(largest, dtype=np.float64)
    return _ratio(values[:2].min(), values[2:].max())


def _of_densities(combine: Callable[[Densities], float]) -> Callable[[Runs], float]:
    """Return what gives a number of the densities of the original phalanx."""
    return lambda runs: np.nan if runs[0].densities is None else combine(runs[0].densities)


def _larger_at_one_edge(densities: Densities) -> float:
    means = np.array([[densities.mean_after.get((kind, area)) for kind in _LARGER_IN_B] for area in "AB"], dtype=float)
    return float(np.max([_ratio(means[1], means[0]).min(), _ratio(means[0], means[1]).min()]))


#: Checks by id of the published statement: of the original, the flattened and the scaled phalanx.
PHALANX_CHECKS: Mapping[str, Callable[[Runs], Number]] = {
    "overall-order": lambda runs: np.diff(_times(runs, "overall")).min(),
    "latency-order": lambda runs: np.diff(_times(runs, "latency")).min(),
    "overall-peak-order": lambda runs: np.diff(_heights(runs)[::-1]).min(),
    "surface-receptors-feel-more": _surface_over_deep,
    "edges-first": lambda runs: _numbers(runs, "centre_after_edge").min(),
    "density-rises": _of_densities(lambda densities: min(densities.growth.values())),
    "density-then-stays": _of_densities(lambda densities: max(densities.range_after.values())),
    "density-larger-in-b": _of_densities(_larger_at_one_edge),
    "flattened-without-middle-peaks": lambda runs: (runs[0].middle_peaks, runs[1].middle_peaks),
    "scaled-middle-peaks-merge": lambda runs: (runs[0].middle_peaks, runs[2].middle_peaks),
}


def _straightness(runs: Runs) -> float:
    """Return the lower coefficient of determination of straight lines through two times over friction."""
    lines = [np.corrcoef(_FRICTIONS, _times(runs, event))[0, 1] ** 2 for event in ("incipient", "overall")]
    return round(float(np.min(lines)), 12)


def _flattening(runs: Runs) -> Floats:
    first, _, third, last = _times(runs, "latency")
    return _ratio(last - third, (third - first) / 2.0)


#: Those of the runs with four friction coefficients, in their order.
FRICTION_CHECKS: Mapping[str, Callable[[Runs], Number]] = {
    "linear-in-friction": _straightness,
    "latency-grows-with-friction": lambda runs: _ratio(*_times(runs, "latency")[[2, 0]]),
    "latency-flattens-with-friction": _flattening,
    "low-friction-vibrates": lambda runs: _ratio(*_numbers(runs, "rms_after")[[0, 2]]),
    "high-friction-loses-middle-peaks": lambda runs: (runs[2].middle_peaks, runs[3].middle_peaks),
    "high-friction-smaller-peaks": lambda runs: _ratio(*_heights(runs)[[3, 2]]),
}


def _flattened_over_others(ripples: Runs, _: Runs) -> Floats:
    original, flattened, scaled = _heights(ripples)
    return _ratio(flattened, np.maximum(original, scaled))


def _hidden_peaks(*runs: Runs) -> tuple[int, int]:
    after, before = (sum(run.incipient_peak is not None for run in some) for some in runs)
    return before, after


def _scaled_vibration(*runs: Runs) -> float:
    return float(_ratio(*(_numbers(some, "rms_after") for some in runs))[VARIANTS.index("scaled")])


#: Those of the three phalanges under a fingerprint, and without one.
FINGERPRINT_CHECKS: Mapping[str, Callable[[Runs, Runs], Number]] = {
    "fingerprint-adds-noise": lambda *runs: _ratio(*([run.peaks.noise_floor for run in some] for some in runs)).min(),
    "fingerprint-hides-incipient": _hidden_peaks,
    "fingerprint-leaves-overall": lambda ripples, _: float(np.isfinite(_heights(ripples)).sum()),
    "fingerprint-flattened-peak": _flattened_over_others,
    "fingerprint-scaled-vibrates": _scaled_vibration,
}
