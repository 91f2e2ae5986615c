"""The numerical uncertainties of a study's results, as ``fingerslip converge`` leaves them beside the runs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingerslip.files import json_text, write_text, writing
from fingerslip.uncertainty import Convergence, Series

__all__ = [
    "FOLDER",
    "RunConvergence",
    "read_convergences",
    "read_uncertainties",
    "stored_numbers",
    "write_convergences",
]

#: Name of the folder in a study's results that holds the refined runs and what came of them.
FOLDER = "convergence"
_FILE = "convergence.json"

_WAYS = {"slip": "accumulated slip", "displacement": "displacement", "acceleration": "acceleration peaks"}
_EVENTS = {
    "incipient": "incipient slip",
    "noticed": "48 % slip",
    "three_quarter": "three-quarter slip",
    "overall": "overall slip",
    "latency": "latency",
}
_NUMBERS = {
    "normal_force_max_N": ("largest normal force", "N"),
    "friction_force_max_N": ("largest friction force", "N"),
    "contact_area_max_m2": ("largest contact area", "m^2"),
    "normal_traction_max_Pa": ("largest contact pressure", "Pa"),
}
_PEAK = ("height of the acceleration peak of overall slip", "m/s^2")
_PEAK_COUNT = ("acceleration peaks before overall slip", "")


@dataclass(frozen=True)
class RunConvergence:
    """The convergence of every number of one run.

    Parameters
    ----------
    run : str
        Its name.
    identity : str
        Hash of its inputs.
    quantities : mapping of str to Convergence
        By key: way and event, as in `slip.overall`, or the name of a key number.
    """

    run: str
    identity: str
    quantities: Mapping[str, Convergence]


def stored_numbers(result: Mapping[str, Any]) -> dict[str, tuple[str, str, float | None]]:
    """Return the numbers of a stored run whose convergence is looked at: name, unit and value by key."""
    events = result["events_s"]
    numbers: dict[str, tuple[str, str, float | None]] = {}
    for way, said in _WAYS.items():
        for event, name in _EVENTS.items():
            if way == "acceleration" and event == "noticed":
                continue  # no peak belongs to it
            numbers[f"{way}.{event}"] = (f"{name} ({said})", "s", events[way][event])
    for key, (name, unit) in _NUMBERS.items():
        numbers[key] = (name, unit, result["numbers"][key])
    height, count = _peaks(result, events["acceleration"]["overall"])
    return numbers | {"peak_height": (*_PEAK, height), "peak_count": (*_PEAK_COUNT, count)}


def write_convergences(folder: Path, convergences: Mapping[str, RunConvergence]) -> None:
    """Write what the refined runs of a study gave into its results.

    Parameters
    ----------
    folder : Path
        Folder of the results of the study.
    convergences : mapping of str to RunConvergence
        By name of the run.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    values = {name: _run_mapping(found) for name, found in convergences.items()}
    with writing(folder):
        (folder / FOLDER).mkdir(exist_ok=True)
    write_text(folder / FOLDER / _FILE, json_text(values))


def read_convergences(folder: Path, identities: Mapping[str, str]) -> dict[str, RunConvergence]:
    """Read back what is known of the runs with these inputs.

    Parameters
    ----------
    folder : Path
        Folder of the results of the study.
    identities : mapping of str to str
        Hash of the inputs of every run, by its name.
    """
    try:
        stored = json.loads((folder / FOLDER / _FILE).read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        return {}
    current = {name: found for name, found in stored.items() if found["identity"] == identities.get(name)}
    return {name: _run_from(name, found) for name, found in current.items()}


def read_uncertainties(folder: Path, identities: Mapping[str, str]) -> dict[str, dict[str, float]]:
    """Return the known uncertainties of the runs with these inputs: run, then key, to the number [SI]."""
    return {
        name: {key: one.uncertainty for key, one in found.quantities.items() if one.uncertainty is not None}
        for name, found in read_convergences(folder, identities).items()
    }


def _peaks(result: Mapping[str, Any], overall: float | None) -> tuple[float | None, float | None]:
    """Return the height of the peak of overall slip and the number of peaks before it."""
    if overall is None:
        return None, None
    peaks = result["acceleration_peaks"]
    height = next((peak["height_m_per_s2"] for peak in peaks if peak["time_s"] == overall), None)
    return height, float(sum(peak["time_s"] < overall for peak in peaks))


def _run_mapping(found: RunConvergence) -> dict[str, Any]:
    return {
        "identity": found.identity,
        "quantities": {key: _quantity_mapping(one) for key, one in found.quantities.items()},
    }


def _quantity_mapping(one: Convergence) -> dict[str, Any]:
    refinements = one.refinements
    return {
        "name": one.quantity,
        "unit": one.unit,
        "value": one.value,
        "uncertainty": one.uncertainty,
        "converges": not one.unsettled,
        "sources": {
            setting: {
                "sizes": list(series.sizes),
                "values": list(series.values),
                "behaviour": refinements[setting].behaviour,
                "order": refinements[setting].order,
                "limit": refinements[setting].limit,
                "uncertainty": refinements[setting].uncertainty,
            }
            for setting, series in one.sources.items()
        },
    }


def _run_from(name: str, stored: Mapping[str, Any]) -> RunConvergence:
    quantities = {
        key: Convergence(
            one["name"],
            one["unit"],
            one["value"],
            {
                setting: Series(setting, tuple(found["sizes"]), tuple(found["values"]))
                for setting, found in one["sources"].items()
            },
        )
        for key, one in stored["quantities"].items()
    }
    return RunConvergence(name, stored["identity"], quantities)
