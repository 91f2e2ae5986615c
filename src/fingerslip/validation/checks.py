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

Check = Callable[[Evidence], Floats | float | tuple[int, int]]

_FRICTIONS = (0.2, 0.4, 0.6, 0.8)
_LARGER_IN_B = ("FA-I", "FA-II", "SA-II")


def outcome_of(name: str, evidence: Evidence) -> Outcome:
    """Return the number of a check, counts of what is lost, or None where an event did not happen."""
    with np.errstate(all="ignore"):
        outcome = CHECKS[name](evidence)
    return outcome if isinstance(outcome, tuple) else float(outcome) if np.isfinite(outcome) else None


def determination(positions: Sequence[float], values: Sequence[float | None]) -> float | None:
    """Return the coefficient of determination of a straight line; None where a value is missing or all are the same."""
    numbers = np.array([value for value in values if value is not None])
    if numbers.size < len(values) or not np.ptp(numbers):
        return None
    left_over = numbers - np.polyval(np.polyfit(positions, numbers, 1), positions)
    total = numbers - numbers.mean()
    return round(float(1.0 - left_over @ left_over / (total @ total)), 12)


def _frictions(evidence: Evidence) -> tuple[Measures, ...]:
    return tuple(evidence.one("wang2014_friction", {FRICTION: friction}) for friction in _FRICTIONS)


def _fingerprint(evidence: Evidence, enabled: bool) -> tuple[Measures, ...]:
    return evidence.phalanges("wang2014_fingerprint", {FINGERPRINT: enabled})


def _times(runs: Sequence[Measures], event: str) -> Floats:
    return np.array([run.run.events.slip.time(event) for run in runs], dtype=np.float64)


def _heights(runs: Sequence[Measures]) -> Floats:
    """Return the heights of the peaks of overall slip [m/s^2]."""
    return np.array([np.nan if run.overall_peak is None else run.overall_peak.height for run in runs])


def _numbers(runs: Sequence[Measures], name: str) -> Floats:
    return np.array([getattr(run, name) for run in runs], dtype=np.float64)


def _ratio(part: ArrayLike, whole: ArrayLike) -> Floats:
    return np.asarray(part) / np.where(np.asarray(whole) == 0.0, np.nan, whole)


def _phalanges(evidence: Evidence) -> tuple[Measures, ...]:
    return evidence.phalanges(TABLE2)


def _straightness(evidence: Evidence) -> float:
    runs = _frictions(evidence)
    times = ([run.run.events.slip.time(event) for run in runs] for event in ("incipient", "overall"))
    return float(np.array([determination(_FRICTIONS, moments) for moments in times], dtype=np.float64).min())


def _flattening(evidence: Evidence) -> Floats:
    first, _, third, last = _times(_frictions(evidence), "latency")
    return _ratio(last - third, (third - first) / 2.0)


def _surface_over_deep(evidence: Evidence) -> Floats:
    largest = [_phalanges(evidence)[0].largest_acceleration.get(kind) for kind in ("FA-I", "SA-I", "FA-II", "SA-II")]
    values = np.array(largest, dtype=np.float64)
    return _ratio(values[:2].min(), values[2:].max())


def _of_densities(combine: Callable[[Densities], float]) -> Callable[[Evidence], float]:
    """Return a number of the densities of the original phalanx."""

    def number(evidence: Evidence) -> float:
        densities = _phalanges(evidence)[0].densities
        return np.nan if densities is None else combine(densities)

    return number


def _larger_at_one_edge(densities: Densities) -> float:
    means = np.array([[densities.mean_after.get((kind, area)) for kind in _LARGER_IN_B] for area in "AB"], dtype=float)
    return float(np.max([_ratio(means[1], means[0]).min(), _ratio(means[0], means[1]).min()]))


def _lost_peaks(first: int, second: int) -> Callable[[Evidence], tuple[int, int]]:
    """Return the middle peaks of two phalanges."""
    return lambda evidence: tuple(_phalanges(evidence)[which].middle_peaks for which in (first, second))  # type: ignore[return-value]


#: The checks that look at the three phalanges only, by id of the published statement.
PHALANX_CHECKS: Mapping[str, Check] = {
    "overall-order": lambda evidence: np.diff(_times(_phalanges(evidence), "overall")).min(),
    "latency-order": lambda evidence: np.diff(_times(_phalanges(evidence), "latency")).min(),
    "overall-peak-order": lambda evidence: np.diff(_heights(_phalanges(evidence))[::-1]).min(),
    "surface-receptors-feel-more": _surface_over_deep,
    "edges-first": lambda evidence: _numbers(_phalanges(evidence), "centre_after_edge").min(),
    "density-rises": _of_densities(lambda densities: min(densities.growth.values())),
    "density-then-stays": _of_densities(lambda densities: max(densities.range_after.values())),
    "density-larger-in-b": _of_densities(_larger_at_one_edge),
    "flattened-without-middle-peaks": _lost_peaks(0, 1),
    "scaled-middle-peaks-merge": _lost_peaks(0, 2),
}


def _noise(evidence: Evidence) -> float:
    floors = [np.array([run.peaks.noise_floor for run in _fingerprint(evidence, on)]) for on in (True, False)]
    return float(_ratio(*floors).min())


def _flattened_over_others(evidence: Evidence) -> Floats:
    original, flattened, scaled = _heights(_fingerprint(evidence, True))
    return _ratio(flattened, np.maximum(original, scaled))


def _hidden_peaks(evidence: Evidence) -> tuple[int, int]:
    before, after = (sum(run.incipient_peak is not None for run in _fingerprint(evidence, on)) for on in (False, True))
    return before, after


def _scaled_vibration(evidence: Evidence) -> float:
    with_ripples, without = (_numbers(_fingerprint(evidence, enabled), "rms_after") for enabled in (True, False))
    return float(_ratio(with_ripples, without)[VARIANTS.index("scaled")])


def _friction_ratio(
    numbers: Callable[[Sequence[Measures]], Floats], first: float, second: float
) -> Callable[[Evidence], Floats]:
    """Return a number at one friction over that at another."""
    rows = [_FRICTIONS.index(first), _FRICTIONS.index(second)]
    return lambda evidence: _ratio(*numbers(_frictions(evidence))[rows])


#: All checks by id of the published statement.
CHECKS: Mapping[str, Check] = {
    **PHALANX_CHECKS,
    "linear-in-friction": _straightness,
    "latency-grows-with-friction": _friction_ratio(lambda runs: _times(runs, "latency"), 0.6, 0.2),
    "latency-flattens-with-friction": _flattening,
    "fingerprint-adds-noise": _noise,
    "fingerprint-hides-incipient": _hidden_peaks,
    "fingerprint-leaves-overall": lambda evidence: float(np.isfinite(_heights(_fingerprint(evidence, True))).sum()),
    "fingerprint-flattened-peak": _flattened_over_others,
    "fingerprint-scaled-vibrates": _scaled_vibration,
    "low-friction-vibrates": _friction_ratio(lambda runs: _numbers(runs, "rms_after"), 0.2, 0.6),
    "high-friction-loses-middle-peaks": lambda evidence: (
        _frictions(evidence)[2].middle_peaks,
        _frictions(evidence)[3].middle_peaks,
    ),
    "high-friction-smaller-peaks": _friction_ratio(_heights, 0.8, 0.6),
}
