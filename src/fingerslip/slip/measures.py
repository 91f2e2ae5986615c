"""Measures: the numbers that sum up a history, in one list.

Every entry of :data:`MEASURES` appears under ``numbers`` in ``events.json``, as a column of ``summary.csv``, in the
log, in the tables of a run and of a study's report and, if it is a number of mechanics, in the convergence tables.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fingerslip.history import phase_times
from fingerslip.slip.events import Found, find_slip
from fingerslip.slip.front import edge_distance, force_ratio_times, front_arrivals
from fingerslip.slip.resolution import largest_step_share, nodes_across, record_interval, slide_records
from fingerslip.slip.skin_markers import share_before_centre, skin_marker_slips, stick_slip_cycles
from fingerslip.slip.windows import contact_area, contact_forces, counterface_normal, slide_window, split_along
from fingerslip.units import Unit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MEASURES", "Measure", "Number", "measure_of", "read_measures"]

Number = float | int | None

_SUFFIXES = str.maketrans({"^": "", "/": "_per_"})


@dataclass(frozen=True)
class Measure:
    """A number that sums up a history.

    Parameters
    ----------
    name : str
        Its name in files, without its unit.
    label : str
        Its name in words.
    read : callable
        Gets a history, and with `reading` also its :class:`~fingerslip.slip.events.Found`, and returns the number in
        SI units; None where it does not exist in that history.
    unit : Unit, optional
        Its unit; none for a pure number.
    mechanical : bool, optional
        Whether it is a number of mechanics, whose convergence is studied; the others say how the run was computed.
    reading : str, optional
        The reading of the slip events that it is a number of, as in :data:`~fingerslip.slip.windows.READINGS`.
    """

    name: str
    label: str
    read: Callable[..., Number]
    unit: Unit | None = None
    mechanical: bool = True
    reading: str = ""

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
    history: xr.Dataset, measures: Sequence[Measure] | None = None, found: Found | None = None
) -> dict[str, Number]:
    """Read measures off a history.

    Parameters
    ----------
    history : xarray.Dataset
        What ``simulate`` returned.
    measures : sequence of Measure, optional
        Which; :data:`MEASURES` without it.
    found : Found, optional
        The slip events of the history and its acceleration peaks; found here without it.

    Returns
    -------
    dict
        The values [SI] by key, such as ``normal_force_max_N``; None for one that does not exist.
    """
    chosen = MEASURES if measures is None else measures
    if found is None and any(measure.reading for measure in chosen):
        found = find_slip(history) if _has_candidates(history) and _has_counterface(history) else Found()
    return {measure.key: measure.read(history, *([found] if measure.reading else [])) for measure in chosen}


def measure_of(key: str) -> Measure | None:
    """Return the measure with a key; None for the key of a measure that is no longer read."""
    return next((measure for measure in MEASURES if measure.key == key), None)


def _normal_force_max(history: xr.Dataset) -> Number:
    return float(contact_forces(history).normal.max()) if _has_counterface(history) else None


def _normal_force_end(history: xr.Dataset) -> Number:
    return float(contact_forces(history).normal[-1]) if _has_counterface(history) else None


def _friction_force_max(history: xr.Dataset) -> Number:
    return float(contact_forces(history).friction.max()) if _has_counterface(history) else None


def _friction_ratio_end_of_slide(history: xr.Dataset) -> Number:
    slides = phase_times(history, "slide")
    if not slides or not _has_counterface(history):
        return None
    forces = contact_forces(history)
    last = int(np.searchsorted(history["time"].values, slides[-1][1] * (1 + 1e-9), side="right")) - 1
    return float(forces.friction[last] / forces.normal[last]) if forces.normal[last] > 0.0 else None


def _slip_margin_incipient(history: xr.Dataset, slip: Found) -> Number:
    """Return 1 - q(incipient) / max q over the slide, with q the friction over the normal force.

    The largest q of the slide stands for the limit of the contact: with friction that falls or that differs between
    nodes the whole contact never reaches a limit that its friction coefficient gives.
    """
    window = slide_window(history)
    if window is None or not (_has_candidates(history) and _has_counterface(history)):
        return None
    incipient = slip.events.incipient
    ratio = contact_forces(history).ratio()[window.records]
    if incipient is None or not np.nanmax(ratio, initial=0.0) > 0.0:
        return None
    touching = np.isfinite(ratio)
    used = np.interp(incipient, history["time"].values[window.records][touching], ratio[touching])
    return float(1.0 - used / ratio[touching].max())


def _overall_travel(history: xr.Dataset, slip: Found) -> Number:
    window = slide_window(history)
    return None if window is None else _travel(history, window.start, slip.events.overall)


def _latency_travel(history: xr.Dataset, slip: Found) -> Number:
    return _travel(history, slip.events.incipient, slip.events.overall)


def _travel(history: xr.Dataset, start: float | None, end: float | None) -> Number:
    """Return how far the first counterface travels along its surface between two times [m]."""
    if start is None or end is None or not _has_counterface(history):
        return None
    moved = history["counterface_displacement"].values[:, 0]
    before, after = (
        np.array([np.interp(moment, history["time"].values, component) for component in moved.T])
        for moment in (start, end)
    )
    return float(np.linalg.norm(split_along(after - before, counterface_normal(history))[1]))


def _resolution(read: Callable[[xr.Dataset], Number]) -> Callable[[xr.Dataset], Number]:
    """Return a reading that does not exist without contact."""
    return lambda history: read(history) if _has_candidates(history) and _has_counterface(history) else None


def _front_arrival_median(history: xr.Dataset) -> Number:
    """Return the median arrival of the slip front at FA-I; None where it does not arrive at half of them."""
    arrivals = front_arrivals(history).values if _has_candidates(history) else np.empty(0)
    ordered = np.sort(np.nan_to_num(arrivals, nan=np.inf))
    median = float(np.median(ordered)) if ordered.size else np.inf
    return median if np.isfinite(median) else None


def _half_of_friction(history: xr.Dataset) -> Number:
    return force_ratio_times(history, (0.5,))[0]


def _nine_tenths_of_friction(history: xr.Dataset) -> Number:
    return force_ratio_times(history, (0.9,))[0]


def _contact_area_max(history: xr.Dataset) -> Number:
    return float(contact_area(history).max()) if _has_candidates(history) else None


def _normal_traction_max(history: xr.Dataset) -> Number:
    return float(history["normal_traction"].values.max()) if _has_candidates(history) else None


def _slip_distance_max(history: xr.Dataset) -> Number:
    return float(history["slip_distance"].values.max()) if _has_candidates(history) else None


def _penetration_max(history: xr.Dataset) -> Number:
    return float(max(-history["gap"].values.min(), 0.0)) if _has_candidates(history) else None


def _elastic_slip_max(history: xr.Dataset) -> Number:
    if not _has_candidates(history):
        return None
    penalty = history.attrs.get("tangential_penalty", np.inf)
    traction = history["tangential_traction"].values
    # Sums along short rows take numpy's ``norm`` several times as long.
    return float(np.sqrt(np.einsum("...c,...c->...", traction, traction).max()) / penalty)


def _overall_peak_height(history: xr.Dataset, slip: Found) -> Number:
    overall = _overall_by_peaks(history, slip)
    return next((peak.height for peak in slip.peaks.peaks if peak.time == overall), None)


def _peaks_before_overall(history: xr.Dataset, slip: Found) -> Number:
    overall = _overall_by_peaks(history, slip)
    return None if overall is None else sum(peak.time < overall for peak in slip.peaks.peaks)


def _overall_by_peaks(history: xr.Dataset, slip: Found) -> float | None:
    return slip.events.acceleration.overall if _has_candidates(history) else None


def _outer_markers_first(history: xr.Dataset) -> Number:
    slips = skin_marker_slips(history)
    return None if slips is None else share_before_centre(slips)


def _records(history: xr.Dataset) -> Number:
    return int(history.sizes["time"])


def _contact_iterations_max(history: xr.Dataset) -> Number:
    return int(history["contact_iterations"].values.max()) if "contact_iterations" in history else None


def _contact_iterations_mean(history: xr.Dataset) -> Number:
    return round(float(history["contact_iterations"].values.mean()), 2) if "contact_iterations" in history else None


def _energy_imbalance_over_work(history: xr.Dataset) -> Number:
    """Return the largest imbalance over the largest external work, as far as both are recorded."""
    if not {"external_work", "energy_imbalance"} <= set(history):
        return None
    work, imbalance = (float(np.abs(history[name].values).max()) for name in ("external_work", "energy_imbalance"))
    return imbalance / work if work > 0.0 else None


def _has_counterface(history: xr.Dataset) -> bool:
    return history.sizes.get("counterface", 0) > 0


def _has_candidates(history: xr.Dataset) -> bool:
    return history.sizes.get("contact_node", 0) > 0


_NEWTON, _LENGTH = Unit("N"), Unit("m", "um")

#: All measures, in the order of files and tables. Forces are those of the first counterface.
MEASURES: tuple[Measure, ...] = (
    Measure("normal_force_max", "largest normal force", _normal_force_max, _NEWTON),
    Measure("normal_force_end", "normal force at the end", _normal_force_end, _NEWTON),
    Measure("friction_force_max", "largest friction force", _friction_force_max, _NEWTON),
    Measure(
        "friction_force_ratio_end_of_slide",
        "friction over normal force at the end of the slide",
        _friction_ratio_end_of_slide,
    ),
    Measure(
        "slip_margin_incipient",
        "slip margin left at incipient slip",
        _slip_margin_incipient,
        reading="slip",
    ),
    Measure("overall_travel", "travel of the plate to overall slip", _overall_travel, Unit("m", "mm"), reading="slip"),
    Measure(
        "latency_travel",
        "travel of the plate from incipient to overall slip",
        _latency_travel,
        Unit("m", "mm"),
        reading="slip",
    ),
    Measure("front_arrival_median", "median arrival of the slip front at FA-I", _front_arrival_median, Unit("s")),
    Measure("force_ratio_half", "friction force reaches half of its limit", _half_of_friction, Unit("s")),
    Measure("force_ratio_nine_tenths", "friction force reaches 0.9 of its limit", _nine_tenths_of_friction, Unit("s")),
    Measure("contact_area_max", "largest contact area", _contact_area_max, Unit("m^2", "mm^2")),
    Measure("normal_traction_max", "largest contact pressure", _normal_traction_max, Unit("Pa", "kPa")),
    Measure("slip_distance_max", "largest slip distance", _slip_distance_max, Unit("m", "mm")),
    Measure(
        "overall_peak_height",
        "height of the acceleration peak of overall slip",
        _overall_peak_height,
        Unit("m/s^2"),
        reading="acceleration",
    ),
    Measure(
        "peaks_before_overall",
        "acceleration peaks before overall slip",
        _peaks_before_overall,
        reading="acceleration",
    ),
    Measure("stick_slip_cycles", "cycles of stick and slip in the slide", stick_slip_cycles),
    Measure(
        "outer_markers_before_centre",
        "share of touching skin markers that slip before the central one",
        _outer_markers_first,
    ),
    Measure(
        "edge_distance_min",
        "smallest distance from the contact to a free edge",
        edge_distance,
        Unit("m", "mm"),
        mechanical=False,
    ),
    Measure("penetration_max", "largest penetration", _penetration_max, _LENGTH, mechanical=False),
    Measure("elastic_slip_max", "largest elastic slip", _elastic_slip_max, _LENGTH, mechanical=False),
    Measure("records", "records", _records, mechanical=False),
    Measure("slide_records", "records in the slide", _resolution(slide_records), mechanical=False),
    Measure("slide_step", "longest step in the slide", _resolution(record_interval), Unit("s", "ms"), mechanical=False),
    Measure("nodes_across_contact", "nodes across the contact", _resolution(nodes_across), mechanical=False),
    Measure(
        "slipped_share_of_one_step",
        "largest share of the contact that slips in one step",
        _resolution(largest_step_share),
        mechanical=False,
    ),
    Measure("contact_iterations_max", "most contact iterations in a step", _contact_iterations_max, mechanical=False),
    Measure("contact_iterations_mean", "mean contact iterations", _contact_iterations_mean, mechanical=False),
    Measure(
        "energy_imbalance_over_work",
        "energy imbalance over external work",
        _energy_imbalance_over_work,
        mechanical=False,
    ),
)
