"""Numerical uncertainty from refinement: observed order of convergence, limit and uncertainty of a number.

A number f computed with three element sizes (or steps, or contact compliances) h behaves as f(h) = f0 + a h^p. Where
the three values approach a limit, p is solved from them and f0 follows (Richardson's extrapolation); the uncertainty
of the value in use is ``F |f - f0|`` with the factor of safety F = 1.25, the grid convergence index of Roache
(1998) and of Celik et al. (2008). Slip times do not always converge with an order, because contact nodes let go one by
one. By Eca & Hoekstra (2014), F is 3 and p the order of the method where the values approach faster than that by more
than 0.1; where they oscillate, diverge, or approach with less than half an order, they give no limit, and the
uncertainty is three times their range. A time is known no better than half a step (JCGM 100:2008, F.2.2.1).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Behaviour = Literal["monotone", "fast", "slow", "oscillatory", "divergent", "unchanged", "missing"]


@dataclass(frozen=True)
class Setting:
    """A numerical setting that is varied to find the uncertainty of a number."""

    name: str  # its name in files and tables
    label: str  # what its sizes are, for axes
    words: str  # what is varied, in sentences
    order: float | None  # largest order of convergence


#: The settings in the order of tables. Bilinear elements and the HHT scheme are of second order, the penalties of first
#: order in the contact compliance.
SETTINGS = (
    Setting("mesh", "element size / that in use", "element sizes", 2.0),
    Setting("bulk", "element size / that in use", "element sizes (not at every level those of the contact)", 2.0),
    Setting("step", "time step / that in use", "time steps", 2.0),
    Setting("penalty", "contact compliance / that in use", "contact stiffness", 1.0),
    Setting("alpha", "numerical damping alpha", "numerical damping", None),
)
#: Largest order by the name of the setting, of those that have a limit.
ORDERS: Mapping[str, float] = MappingProxyType({one.name: one.order for one in SETTINGS if one.order is not None})

_LEVELS = 3
_SAFETY, _SAFETY_WITHOUT_ORDER = 1.25, 3.0
_LEAST_ORDER, _ORDER_SURPLUS = 0.5, 0.1
_ORDER_LIMITS = (1e-6, 40.0)
_ROUNDING = 1e-12
# A number that changes by no more than this share has settled.
_SETTLED = 2e-3


@dataclass(frozen=True)
class Series:
    """One number computed with several values of one setting."""

    setting: str  # what was varied
    sizes: tuple[float, ...]  # element size, time step or contact compliance of each computation, in any unit
    values: tuple[float | None, ...]  # the number from each computation


@dataclass(frozen=True)
class Refinement:
    """How a number depends on one setting."""

    behaviour: Behaviour  # approaches a limit
    uncertainty: float | None = None  # of the value in use, in its unit
    order: float | None = None  # observed order of convergence, where the values approach a limit
    limit: float | None = None  # extrapolated value, where an order of at least one half was observed
    settled: bool = False  # whether the number moves by no more than 0.2 % of itself over all levels

    @property
    def converges(self) -> bool:
        """Whether the values approach a limit, or have settled."""
        return self.settled or self.behaviour in {"monotone", "fast", "unchanged"}


@dataclass(frozen=True)
class Convergence:
    """Everything known about the numerical uncertainty of one number."""

    quantity: str  # its name
    unit: str  # its unit
    value: float | None  # the value in use
    sources: Mapping[str, Series]  # the computations by what was varied
    resolution: float = 0.0  # what the step in use resolves; 0 where it does not matter

    @property
    def refinements(self) -> dict[str, Refinement]:
        """How the number depends on each setting."""
        return {name: refine(series, ORDERS.get(name)) for name, series in self.sources.items()}

    @property
    def uncertainty(self) -> float | None:
        """Root of the sum of squares over all settings, at least the resolution; None if one is missing or it is 0."""
        error = combine([refinement.uncertainty for refinement in self.refinements.values()])
        return None if error is None else max(error, self.resolution) or None

    @property
    def unsettled_settings(self) -> tuple[str, ...]:
        """The settings with which the number does not converge."""
        return tuple(name for name, refinement in self.refinements.items() if not refinement.converges)


def varied_settings(convergences: Iterable[Convergence]) -> tuple[str, ...]:
    """Return the settings that were varied for any of some numbers, in the order of tables."""
    varied = {name for convergence in convergences for name in convergence.sources}
    return tuple(setting.name for setting in SETTINGS if setting.name in varied)


def studied_settings(convergences: Iterable[Convergence]) -> str:
    """Return in words what was varied for some numbers, and that element sizes were not where that is so."""
    names = varied_settings(convergences)
    return settings_in_words(names) + (", not element sizes" if names and not {"mesh", "bulk"} & {*names} else "")


def settings_in_words(names: Iterable[str]) -> str:
    """Return settings as a list in a sentence.

    Examples
    --------
    >>> settings_in_words(["mesh", "step", "alpha"])
    'element sizes, time steps and numerical damping'
    """
    words = {setting.name: setting.words for setting in SETTINGS}
    *first, last = [words[name] for name in names] or [""]
    return f"{', '.join(first)} and {last}" if first else last


def refine(series: Series, formal_order: float | None) -> Refinement:
    """Find the behaviour of a number under refinement."""
    values = [value for value in series.values if value is not None]
    if len(values) < len(series.values):
        return Refinement("missing")
    span, size = max(values) - min(values), max(abs(value) for value in values)
    settled = span <= _SETTLED * size
    if span <= _ROUNDING * size:
        return Refinement("unchanged", 0.0, settled=True)
    if formal_order is None:
        largest = max(abs(value - values[0]) for value in values)
        return Refinement("monotone" if settled else "divergent", largest, settled=settled)
    return _refine(series.sizes, values, formal_order, settled)


def combine(values: Sequence[float | None]) -> float | None:
    """Combine independent uncertainties; None where one of them is None, or there is none."""
    finite = [part for part in values if part is not None]
    return math.hypot(*finite) if finite and len(finite) == len(values) else None


def _refine(sizes: Sequence[float], values: Sequence[float], formal_order: float, settled: bool) -> Refinement:
    if len(values) != _LEVELS:
        raise ValueError(f"needs {_LEVELS} levels, got {len(values)}")
    (coarse, first), (middle, second), (fine, third) = sorted(zip(sizes, values, strict=True), reverse=True)
    without_order = _SAFETY_WITHOUT_ORDER * (max(values) - min(values))
    change, last_change = second - first, third - second
    if change * last_change <= 0.0:
        return Refinement("oscillatory", without_order, settled=settled)
    order = _observed_order((coarse, middle, fine), change / last_change)
    if order is None or order < _LEAST_ORDER:
        return Refinement("divergent" if order is None else "slow", without_order, order, settled=settled)
    is_fast = order > formal_order + _ORDER_SURPLUS
    used, safety = min(order, formal_order), _SAFETY_WITHOUT_ORDER if is_fast else _SAFETY
    slope = (first - third) / (coarse**used - fine**used)
    limit = third - slope * fine**used
    misfit = abs(second - (limit + slope * middle**used))
    error = safety * abs(values[0] - limit) + misfit
    return Refinement("fast" if is_fast else "monotone", error, order, limit, settled)


def _observed_order(sizes: tuple[float, float, float], ratio: float) -> float | None:
    """Solve (h1^p - h2^p) / (h2^p - h3^p) = ratio for p; None where no positive order does it."""
    from scipy.optimize import brentq

    coarse, middle, fine = (math.log(size / sizes[0]) for size in sizes)

    def excess(order: float) -> float:
        # Divided by the larger power, so that nothing overflows.
        rise = -math.expm1(order * (middle - coarse))
        return rise - ratio * math.exp(order * (middle - coarse)) * -math.expm1(order * (fine - middle))

    low, high = _ORDER_LIMITS
    if ratio <= (coarse - middle) / (middle - fine):
        return None
    if excess(high) < 0.0:
        return high
    return float(brentq(excess, low, high)) if excess(low) < 0.0 else None
