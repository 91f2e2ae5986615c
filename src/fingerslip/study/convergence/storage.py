"""The convergence of a study's results on disk, as ``fingerslip converge`` writes it beside the runs."""

from __future__ import annotations

import functools
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingerslip.errors import DamagedError
from fingerslip.storage.files import read_json, write_json, writing
from fingerslip.uncertainty import Convergence, Series

__all__ = [
    "FOLDER",
    "RunConvergence",
    "read_convergences",
    "read_uncertainties",
    "write_convergences",
]

#: Name of the folder in a study's results that holds the refined runs, their tables and figures.
FOLDER = "convergence"
_FILE = "convergence.json"

_logger = logging.getLogger("fingerslip.study")


@dataclass(frozen=True)
class RunConvergence:
    """The convergence of every number of one run."""

    run: str  # its name
    identity: str  # hash of its inputs
    quantities: Mapping[str, Convergence]  # by key, see :func:`fingerslip.results.quantities`


def write_convergences(folder: Path, convergences: Mapping[str, RunConvergence]) -> None:
    """Write the convergence of the runs of a study into its results."""
    values = {name: _run_mapping(convergence) for name, convergence in convergences.items()}
    with writing(folder):
        (folder / FOLDER).mkdir(exist_ok=True)
    write_json(folder / FOLDER / _FILE, values)


def read_convergences(folder: Path, identities: Mapping[str, str]) -> dict[str, RunConvergence]:
    """Read back the convergence of the runs with these inputs."""
    try:
        stored = read_json(folder / FOLDER / _FILE, "run fingerslip converge again")
    except (FileNotFoundError, NotADirectoryError):
        return {}
    except DamagedError as error:
        _warn(f"{error}; without it no uncertainties are known")
        return {}
    current = {
        name: convergence for name, convergence in stored.items() if convergence["identity"] == identities.get(name)
    }
    return {name: _run_from(name, convergence) for name, convergence in current.items()}


@functools.cache
def _warn(message: str) -> None:
    """Warn once, however often the file is read."""
    _logger.warning("%s", message)


def read_uncertainties(folder: Path, identities: Mapping[str, str]) -> dict[str, dict[str, float]]:
    """Return the known uncertainties of the runs with these inputs: run, then key, to the number [SI]."""
    return {
        name: {
            key: quantity.uncertainty
            for key, quantity in convergence.quantities.items()
            if quantity.uncertainty is not None
        }
        for name, convergence in read_convergences(folder, identities).items()
    }


def _run_mapping(convergence: RunConvergence) -> dict[str, Any]:
    return {
        "identity": convergence.identity,
        "quantities": {key: _quantity_mapping(quantity) for key, quantity in convergence.quantities.items()},
    }


def _quantity_mapping(convergence: Convergence) -> dict[str, Any]:
    refinements = convergence.refinements
    return {
        "name": convergence.quantity,
        "unit": convergence.unit,
        "value": convergence.value,
        "uncertainty": convergence.uncertainty,
        "converges": not convergence.unsettled_settings,
        "sources": {
            setting: {
                "sizes": list(series.sizes),
                "values": list(series.values),
                "behaviour": refinements[setting].behaviour,
                "order": refinements[setting].order,
                "limit": refinements[setting].limit,
                "uncertainty": refinements[setting].uncertainty,
            }
            for setting, series in convergence.sources.items()
        },
    }


def _run_from(name: str, stored: Mapping[str, Any]) -> RunConvergence:
    quantities = {
        key: Convergence(
            quantity["name"],
            quantity["unit"],
            quantity["value"],
            {
                setting: Series(setting, tuple(source["sizes"]), tuple(source["values"]))
                for setting, source in quantity["sources"].items()
            },
        )
        for key, quantity in stored["quantities"].items()
    }
    return RunConvergence(name, stored["identity"], quantities)
