"""Measures: the numbers that sum up a history, in one list.

Every entry of :data:`MEASURES` appears under ``numbers`` in ``events.json``, as a column of ``summary.csv``, in the
log, in the tables of a run and of a study's report and, if it is a number of mechanics, in the convergence tables.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fingerslip.contact.rows import nodes_along
from fingerslip.contact.states import OPEN, STICK
from fingerslip.history import phase_times
from fingerslip.libraries import xr
from fingerslip.model.timing import LARGEST_SHARE, LEAST_ACROSS, LEAST_STEPS
from fingerslip.slip import front, windows
from fingerslip.slip.events import Found, find_slip
from fingerslip.slip.settings import EventSettings
from fingerslip.slip.windows import ContactForces, SlideWindow, contact_area, contact_forces, slide_window
from fingerslip.units import Unit

Number = float | int | None

#: Keys of measures, and attributes of a history, that judge small strain; key of how soft the contact is.
INVERTED, LARGEST_STRAIN, PENETRATION = "inverted_cells", "largest_strain", "penetration_over_approach"
_SAME = 1e-9  # displacements that differ by less are the same [m]
_SUFFIXES = str.maketrans({"^": "", "/": "_per_"})


@dataclass(frozen=True)
class Measure:
    """A number that sums up a history."""

    name: str  # in files, without its unit
    label: str  # in words
    # gets a history, and with `reading` also its `Found`; the number is in SI units, None where it does not exist
    read: Callable[..., Number]
    unit: Unit | None = None  # none for a pure number
    mechanical: bool = True  # whether it is one of mechanics, whose convergence is studied; others say how a run went
    reading: str = ""  # the reading of the slip events that it is a number of, as in ``READINGS``
    needs: tuple[str, ...] = ()  # dimensions of a history without which it does not exist, such as ``contact_node``

    @property
    def key(self) -> str:
        """Its key in files: the name with the SI unit.

        Examples
        --------
        >>> Measure("contact_area_max", "largest contact area", lambda _: None, Unit("m^2", "mm^2")).key
        'contact_area_max_m2'
        """
        return f"{self.name}_{self.unit.si.translate(_SUFFIXES)}" if self.unit else self.name

    def text(self, value: Number) -> str:
        """Write a value of it [SI] for people, with its unit."""
        if value is None:
            return "does not exist"
        displayed = self.unit.to_display(value) if self.unit else value
        return f"{displayed:.4g} {self.unit.shown}" if self.unit else f"{displayed:.6g}"


def read_measures(
    history: xr.Dataset, measures: Sequence[Measure] | None = None, slip: Found | None = None
) -> dict[str, Number]:
    """Return measures of a history [SI] by key, such as ``normal_force_max_N``; None for one that does not exist.

    They are :data:`MEASURES` without others; slip events and acceleration peaks are found where they are not given.
    """
    chosen = MEASURES if measures is None else measures
    if slip is None and any(measure.reading for measure in chosen):
        slip = find_slip(history) if _has(history, _CONTACT) else Found()

    def value(measure: Measure) -> Number:
        if not _has(history, measure.needs):
            return None
        number = measure.read(history, *([slip] if measure.reading else []))
        plain: Number = None if number is None else np.asarray(number).item()
        return plain

    return {measure.key: value(measure) for measure in chosen}


def measure_of(key: str) -> Measure | None:
    """Return the measure with a key; None for the key of a measure that is no longer read."""
    return next((measure for measure in MEASURES if measure.key == key), None)


def _has(history: xr.Dataset, dimensions: Sequence[str]) -> bool:
    return all(history.sizes.get(name, 0) > 0 for name in dimensions)


def _friction_ratio_end_of_slide(history: xr.Dataset) -> Number:
    slides, forces = phase_times(history, "slide"), contact_forces(history)
    if not slides:
        return None
    last = int(np.searchsorted(history["time"].values, slides[-1][1] * (1 + 1e-9), side="right")) - 1
    return forces.friction[last] / forces.normal[last] if forces.normal[last] > 0.0 else None


def _slip_margin(history: xr.Dataset, slip: Found) -> Number:
    """Return 1 - q(incipient) / max q over the slide, with q the friction over the normal force.

    The largest q of the slide stands for the limit of the contact: with friction that falls or that differs between
    nodes the whole contact never reaches a limit that its friction coefficient gives.
    """
    window, incipient = slide_window(history), slip.events.incipient
    if window is None:
        return None
    ratio = contact_forces(history).ratio()[window.records]
    if incipient is None or not np.nanmax(ratio, initial=0.0) > 0.0:
        return None
    touching = np.isfinite(ratio)
    used = np.interp(incipient, history["time"].values[window.records][touching], ratio[touching])
    return float(1.0 - used / ratio[touching].max())


def _overall_travel(history: xr.Dataset, slip: Found) -> Number:
    window = slide_window(history)
    return None if window is None else _travel(history, window.start, slip.events.overall)


def _sticking_at_overall(history: xr.Dataset, slip: Found) -> Number:
    """Return how many nodes that came into contact since the slide began stick at overall slip."""
    window, overall = slide_window(history), slip.events.overall
    if window is None or overall is None:
        return None
    states = history["contact_state"].values
    at = min(int(np.searchsorted(history["time"].values, overall)), len(states) - 1)
    return int(((states[at] == STICK) & (states[window.first] == OPEN)).sum())


def _travel(history: xr.Dataset, start: float | None, end: float | None) -> Number:
    """Return how far the first counterface travels along its surface between two times [m]."""
    if start is None or end is None:
        return None
    travel, times = history["counterface_displacement"].values[:, 0], history["time"].values
    before, after = (np.array([np.interp(at, times, component) for component in travel.T]) for at in (start, end))
    return float(np.linalg.norm(windows.split_along(after - before, windows.counterface_normal(history))[1]))


def _front_arrival_median(history: xr.Dataset) -> Number:
    """Return the median arrival of the slip front at FA-I; None where it does not arrive at half of them."""
    ordered = np.sort(np.nan_to_num(front.front_arrivals(history).values, nan=np.inf))
    median = float(np.median(ordered)) if ordered.size else np.inf
    return median if np.isfinite(median) else None


def _penetration_over_approach(history: xr.Dataset) -> Number:
    """Return the mean penetration over the approach of the first counterface from its first touch, when it is deepest.

    What penetrates does not indent: force over approach is too small by about this share.
    """
    nodes, normal = history["contact_counterface"].values == 0, windows.counterface_normal(history)
    along, _ = windows.split_along(history["counterface_displacement"].values[:, 0], normal)
    deepest = int(np.argmax(along >= along.max() - _SAME))
    first, gaps = (history["gap"].values[record, nodes] for record in (0, deepest))
    areas = history["contact_area"].values[nodes] * (history["contact_state"].values[deepest, nodes] != OPEN)
    approach = along[deepest] - max(first.min(initial=np.inf), 0.0)
    return -(areas @ gaps) / areas.sum() / approach if approach > _SAME and areas.any() else None


def _elastic_slip_max(history: xr.Dataset) -> Number:
    traction = history["tangential_traction"].values
    # Sums along short rows take numpy's ``norm`` several times as long.
    largest = np.sqrt(np.einsum("...c,...c->...", traction, traction).max())
    return float(largest / history.attrs.get("tangential_penalty", np.inf))


def _overall_peak_height(_history: xr.Dataset, slip: Found) -> Number:
    overall = slip.events.acceleration.overall
    return next((peak.height for peak in slip.peaks.peaks if peak.time == overall), None)


def _peaks_before_overall(_history: xr.Dataset, slip: Found) -> Number:
    overall = slip.events.acceleration.overall
    return None if overall is None else sum(peak.time < overall for peak in slip.peaks.peaks)


def _nodes_across(history: xr.Dataset, window: SlideWindow) -> Number:
    """Return how many nodes lie across the contact when the slide begins: in 3D along the slide, of one counterface."""
    touching = history["contact_state"].values[window.first] != OPEN
    if history.sizes["component"] == 2:
        return float(touching.sum())
    touching &= history["contact_counterface"].values == 0
    return float(nodes_along(history["contact_position"].values[touching], windows.slide_tangent(history)))


def _largest_step_share(history: xr.Dataset, window: SlideWindow) -> Number:
    """Return the largest share of the contact area that slips for the first time from one record to the next [-]."""
    fractions = windows.slipped_fraction(history, window, EventSettings().slip_tolerance).values
    return float(np.nanmax(np.diff(fractions), initial=0.0))


def _energy_imbalance_over_work(history: xr.Dataset) -> Number:
    """Return the largest imbalance over the largest external work, as far as both are recorded."""
    if not {"external_work", "energy_imbalance"} <= set(history):
        return None
    work, imbalance = (float(np.abs(history[name].values).max()) for name in ("external_work", "energy_imbalance"))
    return imbalance / work if work > 0.0 else None


_COUNTERFACE, _NODES, _CONTACT = ("counterface",), ("contact_node",), ("contact_node", "counterface")
_LENGTH, _TRAVEL, _AREA = Unit("m", "um"), Unit("m", "mm"), Unit("m^2", "mm^2")


# Measures of what is found of slip, of the contact nodes, and of how a run was computed.
_of_events = functools.partial(Measure, reading="slip", needs=_CONTACT)
_of_nodes = functools.partial(Measure, needs=_NODES)
_of_run = functools.partial(Measure, mechanical=False)


def _of_force(name: str, label: str, read: Callable[[ContactForces], Number]) -> Measure:
    """Return a measure [N] of the forces of the first counterface."""
    return Measure(name, label, lambda history: read(contact_forces(history)), Unit("N"), needs=_COUNTERFACE)


def _of_slide(
    name: str, label: str, read: Callable[[xr.Dataset, SlideWindow], Number], unit: Unit | None = None
) -> Measure:
    """Return a measure that says how the first slide was computed, where there is one."""

    def of_history(history: xr.Dataset) -> Number:
        window = slide_window(history)
        return None if window is None else read(history, window)

    return _of_run(name, label, of_history, unit, needs=_CONTACT)


def _force_ratio(name: str, label: str, share: float) -> Measure:
    """Return the measure [s] of when the friction force reaches a share of its limit."""
    return Measure(name, label, lambda history: front.force_ratio_times(history, (share,))[0], Unit("s"))


def _of_iterations(name: str, label: str, combine: Callable[[Any], Number]) -> Measure:
    """Return a measure of the contact iterations of the steps, where they are recorded."""
    counts = "contact_iterations"
    return _of_run(name, label, lambda history: combine(history[counts].values) if counts in history else None)


#: All measures, in the order of files and tables. Forces are those of the first counterface.
MEASURES: tuple[Measure, ...] = (
    _of_force("normal_force_max", "largest normal force", lambda forces: forces.normal.max()),
    _of_force("normal_force_end", "normal force at the end", lambda forces: forces.normal[-1]),
    _of_force("friction_force_max", "largest friction force", lambda forces: forces.friction.max()),
    Measure(
        "friction_force_ratio_end_of_slide",
        "friction over normal force at the end of the slide",
        _friction_ratio_end_of_slide,
        needs=_COUNTERFACE,
    ),
    _of_events("slip_margin_incipient", "slip margin left at incipient slip", _slip_margin),
    _of_events("overall_travel", "travel of the plate to overall slip", _overall_travel, _TRAVEL),
    _of_events(
        "latency_travel",
        "travel of the plate from incipient to overall slip",
        lambda history, slip: _travel(history, slip.events.incipient, slip.events.overall),
        _TRAVEL,
    ),
    _of_events(
        "sticking_at_overall",
        "nodes in contact since the slide that stick at overall slip",
        _sticking_at_overall,
        mechanical=False,
    ),
    _of_nodes("front_arrival_median", "median arrival of the slip front at FA-I", _front_arrival_median, Unit("s")),
    _force_ratio("force_ratio_half", "friction force reaches half of its limit", 0.5),
    _force_ratio("force_ratio_nine_tenths", "friction force reaches 0.9 of its limit", 0.9),
    _of_nodes("contact_area_max", "largest contact area", lambda history: float(contact_area(history).max()), _AREA),
    _of_nodes(
        "normal_traction_max",
        "largest contact pressure",
        lambda history: history["normal_traction"].values.max(),
        Unit("Pa", "kPa"),
    ),
    _of_nodes(
        "slip_distance_max", "largest slip distance", lambda history: history["slip_distance"].values.max(), _TRAVEL
    ),
    _of_events(
        "overall_peak_height",
        "height of the acceleration peak of overall slip",
        _overall_peak_height,
        Unit("m/s^2"),
        reading="acceleration",
    ),
    _of_events(
        "peaks_before_overall", "acceleration peaks before overall slip", _peaks_before_overall, reading="acceleration"
    ),
    Measure("stick_slip_cycles", "cycles of stick and slip in the slide", front.stick_slip_cycles),
    Measure(
        "outer_markers_before_centre",
        "share of touching skin markers that slip before the central one",
        front.share_before_centre,
    ),
    _of_run("edge_distance_min", "smallest distance from the contact to a free edge", front.edge_distance, _TRAVEL),
    _of_nodes(
        "penetration_max",
        "largest penetration",
        lambda history: max(-history["gap"].values.min(), 0.0),
        _LENGTH,
        mechanical=False,
    ),
    _of_run(PENETRATION, "mean penetration over approach, at the deepest", _penetration_over_approach, needs=_CONTACT),
    _of_nodes("elastic_slip_max", "largest elastic slip", _elastic_slip_max, _LENGTH, mechanical=False),
    _of_run("records", "records", lambda history: history.sizes["time"]),
    _of_slide("slide_records", "records in the slide", lambda _, slide: slide.last - slide.first),
    _of_slide(
        "slide_step",
        "longest step in the slide",
        lambda history, slide: np.diff(history["time"].values[slide.records]).max(),
        Unit("s", "ms"),
    ),
    _of_slide("nodes_across_contact", "nodes across the contact", _nodes_across),
    _of_slide("slipped_share_of_one_step", "largest share of the contact that slips in one step", _largest_step_share),
    _of_run(LARGEST_STRAIN, "largest strain", lambda history: history.attrs.get(LARGEST_STRAIN)),
    _of_run(INVERTED, "cells turned inside out", lambda history: history.attrs.get(INVERTED, 0)),
    _of_iterations("contact_iterations_max", "most contact iterations in a step", lambda counts: counts.max()),
    _of_iterations("contact_iterations_mean", "mean contact iterations", lambda counts: round(float(counts.mean()), 2)),
    _of_run("energy_imbalance_over_work", "energy imbalance over external work", _energy_imbalance_over_work),
)

# Penetration over approach, by which force over approach is too small: of a block in 3D 1.9 %, and with sixteen times
# the penalty its force is 1.9 % larger. Above 1 % contact errs as much as what else is coarse.
_PENETRATES = 0.01
# Largest strain of cells at their centres. The section of Table 2 has 0.47 to 0.52, and large strain presses it 34 to
# 40 % harder and makes latencies 27 to 84 % longer: in proportion, 14 and 11 % at this strain.
_LARGE_STRAIN = 0.2
# What is wrong, and what mends it.
_INVALID = "Small strain does not hold, and neither do forces and times of slip"
_STRAINED = "Strains are large for kinematics: small"
_TOO_COARSE, _SMALLER = "Too coarse for the times of slip", "take smaller elements at the contact"
_FINER, _LESS = "take a smaller step, unless all of it slips at once", "write kinematics: finite, or load the body less"
_SOFT, _STIFFER = (
    "Contact is soft, its force over approach too small by as much",
    f"{_SMALLER} or a larger normal_penalty",
)
# Keys of measures, the least and the most that is fine, what is wrong beyond, what they are in words, what mends it.
_LIMITS: tuple[tuple[str, float, float, str, str, str], ...] = (
    (INVERTED, 0, 0, _INVALID, "{:.0f} cells turned inside out", _LESS),
    (LARGEST_STRAIN, 0.0, _LARGE_STRAIN, _STRAINED, "up to {:.2f}", "compare with kinematics: finite"),
    ("slide_records", LEAST_STEPS, np.inf, _TOO_COARSE, "{:.0f} steps in the slide", "take a smaller step"),
    ("slipped_share_of_one_step", 0.0, LARGEST_SHARE, _TOO_COARSE, "{:.0%} of the contact slips in one step", _FINER),
    ("nodes_across_contact", LEAST_ACROSS, np.inf, _TOO_COARSE, "{:.0f} nodes across the contact", _SMALLER),
    (PENETRATION, -1.0, _PENETRATES, _SOFT, "{:.1%} of the approach is penetration", _STIFFER),
)


def caveats(numbers: Mapping[str, Mapping[str, float | int | None]]) -> tuple[str, ...]:
    """Return what to know beside the times of slip, from the measures of runs by their titles."""
    late = [count for values in numbers.values() if (count := values.get("sticking_at_overall"))]
    warnings = resolution_warnings(numbers)
    if not late:
        return warnings
    where = f" in {len(late)} of {len(numbers)} runs" if len(numbers) > 1 else ""
    most = f"up to {max(late)}" if len(late) > 1 else f"{late[0]}"
    said = f"Overall slip is that of the contact at the start of the slide: of the nodes that touch since then, {most}"
    return (f"{said} still stick{'s' if most == '1' else ''}{where}.", *warnings)


def resolution_warnings(numbers: Mapping[str, Mapping[str, float | int | None]]) -> tuple[str, ...]:
    """Return what spoils the times of slip, such as too coarse steps, from the measures of runs by their titles."""
    warnings = []
    for key, least, most, fault, words, repair in _LIMITS:
        coarse = [
            f"{title} ({words.format(value).replace('%', ' %')})"
            for title, values in numbers.items()
            if (value := values.get(key)) and not least <= value <= most
        ]
        if coarse:
            listed = "; ".join(coarse[:3]) + f" and {len(coarse) - 3} more" * (len(coarse) > 3)
            warnings.append(f"{fault}: {listed}: {repair}.")
    return tuple(warnings)
