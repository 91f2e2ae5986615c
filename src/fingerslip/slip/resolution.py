"""How well the records of a slide, and the nodes of its contact, resolve slip; and warnings where they do not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fingerslip.contact.states import OPEN
from fingerslip.model.timing import LARGEST_SHARE, LEAST_ACROSS, LEAST_STEPS
from fingerslip.slip.settings import EventSettings
from fingerslip.slip.windows import slide_window, slipped_fraction

if TYPE_CHECKING:
    import xarray as xr

# Keys of measures with the least and the most that is fine, what they are in words, and what mends it.
_LIMITS: tuple[tuple[str, float, float, str, str], ...] = (
    ("slide_records", LEAST_STEPS, np.inf, "{:.0f} steps in the slide", "take a smaller step"),
    (
        "slipped_share_of_one_step",
        0.0,
        LARGEST_SHARE,
        "{:.0%} of the contact slips in one step",
        "take a smaller step, unless all of it slips at once",
    ),
    (
        "nodes_across_contact",
        LEAST_ACROSS,
        np.inf,
        "{:.0f} nodes across the contact",
        "take smaller elements at the contact",
    ),
)


def slide_records(history: xr.Dataset) -> int | None:
    """Return how many records follow the start of the slide; None where nothing slides."""
    window = slide_window(history)
    return None if window is None else window.last - window.first


def record_interval(history: xr.Dataset) -> float | None:
    """Return the longest time between two records of the slide [s]; None where nothing slides."""
    window = slide_window(history)
    return None if window is None else float(np.diff(history["time"].values[window.records]).max())


def nodes_across(history: xr.Dataset) -> float | None:
    """Return how many nodes lie across the contact when the slide begins: in 3D across a disk of as many."""
    window = slide_window(history)
    if window is None:
        return None
    nodes = float((history["contact_state"].values[window.first] != OPEN).sum())
    return nodes if history.sizes["component"] == 2 else float(2.0 * np.sqrt(nodes / np.pi))


def largest_step_share(history: xr.Dataset) -> float | None:
    """Return the largest share of the contact area that slips for the first time from one record to the next [-]."""
    window = slide_window(history)
    if window is None:
        return None
    fractions = slipped_fraction(history, window, EventSettings().slip_tolerance).values
    return float(np.nanmax(np.diff(fractions), initial=0.0))


def resolution_warnings(numbers: Mapping[str, Mapping[str, float | int | None]]) -> tuple[str, ...]:
    """Return what is too coarse for the times of slip, from the measures of runs by their titles."""
    warnings = []
    for key, least, most, words, repair in _LIMITS:
        values = {title: value for title, number in numbers.items() if (value := number.get(key))}
        coarse = [
            f"{title} ({words.format(value).replace('%', ' %')})"
            for title, value in values.items()
            if not least <= value <= most
        ]
        if coarse:
            listed = "; ".join(coarse[:3]) + f" and {len(coarse) - 3} more" * (len(coarse) > 3)
            warnings.append(f"Too coarse for the times of slip: {listed}: {repair}.")
    return tuple(warnings)
