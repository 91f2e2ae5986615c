"""A check for each published statement: one number from our runs, and whether the statement holds.

The thresholds are written beside the statements in ``data/published/wang2014.yaml``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.validation.evidence import FINGERPRINT, FRICTION, TABLE2, VARIANTS, Evidence
from fingerslip.validation.measures import Densities, Measures

__all__ = ["CHECKS", "PHALANX_CHECKS", "Finding", "determination"]

_FRICTION, _FINGERPRINT = "wang2014_friction", "wang2014_fingerprint"
_FRICTIONS = (0.2, 0.4, 0.6, 0.8)
_LINEAR_FROM = 0.99
_STRONG_GROWTH = 1.5
_LITTLE_GROWTH = 0.5
_CONSTANT = 0.1
_LARGER_IN_B = ("FA-I", "FA-II", "SA-II")


@dataclass(frozen=True)
class Finding:
    """What a check found."""

    number: float | None = None  # the number that the statement is compared with
    holds: bool | None = None  # whether the statement holds
    comparable: bool = True  # whether the number is of the same quantity as the statement


def overall_order(evidence: Evidence) -> Finding:
    """Order of overall slip over the phalanges."""
    return _above(_smallest_step([phalanx.run.events.slip.overall for phalanx in evidence.phalanges(TABLE2)]), 0.0)


def latency_order(evidence: Evidence) -> Finding:
    """Order of latency over the phalanges."""
    return _by_area(
        _above(_smallest_step([phalanx.run.events.slip.latency for phalanx in evidence.phalanges(TABLE2)]), 0.0)
    )


def overall_peak_order(evidence: Evidence) -> Finding:
    """Order of the heights of the peak of overall slip over the phalanges."""
    heights = [_overall_height(phalanx) for phalanx in evidence.phalanges(TABLE2)]
    return _above(_smallest_step([None if height is None else -height for height in heights]), 0.0)


def linear_in_friction(evidence: Evidence) -> Finding:
    """Straightness of incipient and overall slip against friction."""
    runs = _frictions(evidence)
    fits = [
        determination(_FRICTIONS, [getattr(run.run.events.slip, event) for run in runs])
        for event in ("incipient", "overall")
    ]
    number = _combine(min, fits)
    return Finding(number, None if number is None else number >= _LINEAR_FROM)


def latency_grows_with_friction(evidence: Evidence) -> Finding:
    """Latency at a friction of 0.6 over that at 0.2."""
    latencies = [row.run.events.slip.latency for row in _frictions(evidence)]
    return _by_area(_above(_ratio(latencies[2], latencies[0]), _STRONG_GROWTH))


def latency_flattens_with_friction(evidence: Evidence) -> Finding:
    """Growth of latency from 0.6 to 0.8 over its mean growth before."""
    first, _, third, last = (row.run.events.slip.latency for row in _frictions(evidence))
    if first is None or third is None or last is None:
        return _by_area(Finding())
    return _by_area(_below(_ratio(last - third, (third - first) / 2.0), _LITTLE_GROWTH))


def surface_receptors_feel_more(evidence: Evidence) -> Finding:
    """Largest accelerations of type I over those of type II receptors."""
    largest = evidence.phalanges(TABLE2)[0].largest_acceleration
    if not set(RECEPTOR_KINDS) <= set(largest):
        return Finding()
    return _above(_ratio(min(largest["FA-I"], largest["SA-I"]), max(largest["FA-II"], largest["SA-II"])), 1.0)


def edges_first(evidence: Evidence) -> Finding:
    """How much later the centre of the contact slips than its edges."""
    return _above(_combine(min, [phalanx.centre_after_edge for phalanx in evidence.phalanges(TABLE2)]), 0.0)


def density_rises(evidence: Evidence) -> Finding:
    """Growth of strain energy density during the slide."""
    densities = _original_densities(evidence)
    return Finding() if densities is None else _above(min(densities.growth.values()), 1.0)


def density_then_stays(evidence: Evidence) -> Finding:
    """Range of strain energy density after overall slip."""
    densities = _original_densities(evidence)
    if densities is None:
        return Finding()
    number = max(densities.range_after.values())
    return Finding(number, number <= _CONSTANT)


def density_larger_in_b(evidence: Evidence) -> Finding:
    """Strain energy density of one area over that of the other, the same one for all types."""
    densities = _original_densities(evidence)
    if densities is None:
        return Finding()
    least = [_combine(min, _density_ratios(densities, *areas)) for areas in (("B", "A"), ("A", "B"))]
    return _above(_combine(max, least), 1.0)


def _density_ratios(densities: Densities, first: str, other: str) -> list[float | None]:
    mean = densities.mean_after
    return [_ratio(mean.get((kind, first)), mean.get((kind, other))) for kind in _LARGER_IN_B]


def flattened_without_middle_peaks(evidence: Evidence) -> Finding:
    """Middle peaks of the original and the flattened phalanx."""
    original, flattened, _ = evidence.phalanges(TABLE2)
    return _lost(original.middle_peaks, flattened.middle_peaks)


def scaled_middle_peaks_merge(evidence: Evidence) -> Finding:
    """Middle peaks of the original and the scaled phalanx."""
    original, _, scaled = evidence.phalanges(TABLE2)
    return _lost(original.middle_peaks, scaled.middle_peaks)


def fingerprint_adds_noise(evidence: Evidence) -> Finding:
    """Noise floor with ripples over that without."""
    pairs = zip(_printed_measures(evidence, True), _printed_measures(evidence, False), strict=True)
    return _above(_combine(min, [_ratio(on.peaks.noise_floor, off.peaks.noise_floor) for on, off in pairs]), 1.0)


def fingerprint_hides_incipient(evidence: Evidence) -> Finding:
    """Phalanges with a peak of incipient slip, without and with ripples."""
    without, with_them = (
        sum(run.incipient_peak is not None for run in _printed_measures(evidence, state)) for state in (False, True)
    )
    return _lost(without, with_them)


def fingerprint_leaves_overall(evidence: Evidence) -> Finding:
    """Phalanges whose peak of overall slip is found with ripples."""
    count = sum(run.overall_peak is not None for run in _printed_measures(evidence, True))
    return Finding(float(count), count == len(VARIANTS))


def fingerprint_flattened_peak(evidence: Evidence) -> Finding:
    """Height of the peak of overall slip with ripples, flattened over the others."""
    original, flattened, scaled = (_overall_height(run) for run in _printed_measures(evidence, True))
    return _above(_ratio(flattened, _combine(max, [original, scaled])), 1.0)


def fingerprint_scaled_vibrates(evidence: Evidence) -> Finding:
    """Vibration after overall slip of the scaled phalanx, with over without ripples."""
    return _above(
        _ratio(_printed_measures(evidence, True)[2].rms_after, _printed_measures(evidence, False)[2].rms_after), 1.0
    )


def low_friction_vibrates(evidence: Evidence) -> Finding:
    """Vibration after overall slip at a friction of 0.2 over that at 0.6."""
    low, _, middle, _ = _frictions(evidence)
    return _above(_ratio(low.rms_after, middle.rms_after), 1.0)


def high_friction_loses_middle_peaks(evidence: Evidence) -> Finding:
    """Middle peaks at a friction of 0.6 and 0.8."""
    _, _, middle, high = _frictions(evidence)
    return _lost(middle.middle_peaks, high.middle_peaks)


def high_friction_smaller_peaks(evidence: Evidence) -> Finding:
    """Height of the peak of overall slip at a friction of 0.8 over that at 0.6."""
    _, _, middle, high = _frictions(evidence)
    return _below(_ratio(_overall_height(high), _overall_height(middle)), 1.0)


def _by_id(*checks: Callable[[Evidence], Finding]) -> Mapping[str, Callable[[Evidence], Finding]]:
    return MappingProxyType({check.__name__.replace("_", "-"): check for check in checks})


#: The checks that look at the three phalanges only, by id of the published statement.
PHALANX_CHECKS = _by_id(
    overall_order,
    latency_order,
    overall_peak_order,
    surface_receptors_feel_more,
    edges_first,
    density_rises,
    density_then_stays,
    density_larger_in_b,
    flattened_without_middle_peaks,
    scaled_middle_peaks_merge,
)

#: All checks by id of the published statement.
CHECKS: Mapping[str, Callable[[Evidence], Finding]] = MappingProxyType(
    {
        **PHALANX_CHECKS,
        **_by_id(
            linear_in_friction,
            latency_grows_with_friction,
            latency_flattens_with_friction,
            fingerprint_adds_noise,
            fingerprint_hides_incipient,
            fingerprint_leaves_overall,
            fingerprint_flattened_peak,
            fingerprint_scaled_vibrates,
            low_friction_vibrates,
            high_friction_loses_middle_peaks,
            high_friction_smaller_peaks,
        ),
    }
)


def determination(positions: Sequence[float], values: Sequence[float | None]) -> float | None:
    """Return the coefficient of determination of a straight line; None where a value is missing or all are the same.

    Examples
    --------
    >>> determination([0.0, 1.0, 2.0], [1.0, 3.0, 5.0])
    1.0
    """
    numbers = np.array([value for value in values if value is not None])
    if numbers.size < len(values) or not np.ptp(numbers):
        return None
    left_over = numbers - np.polyval(np.polyfit(positions, numbers, 1), positions)
    total = numbers - numbers.mean()
    return round(float(1.0 - left_over @ left_over / (total @ total)), 12)


def _frictions(evidence: Evidence) -> tuple[Measures, ...]:
    return tuple(evidence.one(_FRICTION, {FRICTION: friction}) for friction in _FRICTIONS)


def _printed_measures(evidence: Evidence, enabled: bool) -> tuple[Measures, ...]:
    return evidence.phalanges(_FINGERPRINT, {FINGERPRINT: enabled})


def _original_densities(evidence: Evidence) -> Densities | None:
    return evidence.phalanges(TABLE2)[0].densities


def _overall_height(measures: Measures) -> float | None:
    peak = measures.overall_peak
    return None if peak is None else peak.height


def _smallest_step(values: Sequence[float | None]) -> float | None:
    """Return the smallest rise between neighbours, None where a value is missing."""
    pairs = list(pairwise(values))
    return _combine(min, [None if a is None or b is None else b - a for a, b in pairs])


def _combine(combine: Callable[[list[float]], float], values: Sequence[float | None]) -> float | None:
    numbers = [value for value in values if value is not None]
    return combine(numbers) if numbers and len(numbers) == len(values) else None


def _ratio(part: float | None, whole: float | None) -> float | None:
    return None if part is None or not whole else part / whole


def _above(number: float | None, threshold: float) -> Finding:
    return Finding() if number is None else Finding(number, number > threshold)


def _below(number: float | None, threshold: float) -> Finding:
    return Finding() if number is None else Finding(number, number < threshold)


def _by_area(finding: Finding) -> Finding:
    """Mark a latency that begins with a slipped share of the area, where the paper's begins with a peak."""
    return dataclasses.replace(finding, comparable=False)


def _lost(before: int, after: int) -> Finding:
    """Find whether something was there before and is absent after."""
    return Finding(float(before - after), before > 0 and after == 0)
