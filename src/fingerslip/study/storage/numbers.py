"""Key numbers of a run: a few values that say at a glance what happened and how well it was solved."""

from __future__ import annotations

import numpy as np
import xarray as xr

from fingerslip.history import phase_times
from fingerslip.slip import contact_area

__all__ = ["key_numbers"]

_FORCES = ("normal_force_max_N", "normal_force_end_N", "friction_force_max_N", "friction_force_ratio_end_of_slide")
_CONTACT = (
    "contact_area_max_m2",
    "penetration_max_m",
    "elastic_slip_max_m",
    "normal_traction_max_Pa",
    "slip_distance_max_m",
)


def key_numbers(history: xr.Dataset) -> dict[str, float | int | None]:
    """Return the key numbers of a history; None for one that does not apply.

    Parameters
    ----------
    history : xarray.Dataset
        What ``simulate`` returned.

    Returns
    -------
    dict
        Names that end in their units, to values.
    """
    return {**_forces(history), **_contact(history), **_solution(history)}


def _forces(history: xr.Dataset) -> dict[str, float | int | None]:
    """Largest and last normal force, largest friction force, and friction over normal force at the end of the slide."""
    if history.sizes.get("counterface", 0) == 0:
        return dict.fromkeys(_FORCES)
    force, unit = history["counterface_force"].values[:, 0, :], history["counterface_normal"].values[0]
    normal = force @ unit
    tangential = np.linalg.norm(force - normal[:, None] * unit, axis=1)
    slides = phase_times(history, "slide")
    ratio = None
    if slides:
        last = int(np.searchsorted(history["time"].values, slides[-1][1] * (1 + 1e-9), side="right")) - 1
        ratio = float(tangential[last] / normal[last]) if normal[last] > 0 else None
    return {
        "normal_force_max_N": float(normal.max()),
        "normal_force_end_N": float(normal[-1]),
        "friction_force_max_N": float(tangential.max()),
        "friction_force_ratio_end_of_slide": ratio,
    }


def _contact(history: xr.Dataset) -> dict[str, float | int | None]:
    """Largest area in contact, and the largest penetration, elastic slip, traction and slip of a contact node."""
    if history.sizes.get("contact_node", 0) == 0:
        return dict.fromkeys(_CONTACT)
    penalty = history.attrs.get("tangential_penalty", np.inf)
    return {
        "contact_area_max_m2": float(contact_area(history).max()),
        "penetration_max_m": float(max(-history["gap"].values.min(), 0.0)),
        "elastic_slip_max_m": float(np.linalg.norm(history["tangential_traction"].values, axis=-1).max() / penalty),
        "normal_traction_max_Pa": float(history["normal_traction"].values.max()),
        "slip_distance_max_m": float(history["slip_distance"].values.max()),
    }


def _solution(history: xr.Dataset) -> dict[str, float | int | None]:
    """How much work the solver had, and how well energy was kept."""
    work = float(np.abs(history["external_work"].values).max()) if "external_work" in history else 0.0
    imbalance = float(np.abs(history["energy_imbalance"].values).max()) if "energy_imbalance" in history else None
    iterations = history["contact_iterations"].values if "contact_iterations" in history else np.zeros(1)
    return {
        "records": int(history.sizes["time"]),
        "contact_iterations_max": int(iterations.max()),
        "contact_iterations_mean": round(float(iterations.mean()), 2),
        "energy_imbalance_over_work": imbalance / work if imbalance is not None and work > 0 else None,
    }
