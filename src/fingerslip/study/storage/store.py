"""The folder of a run: what tells its inputs apart, how it is written with its snapshots, and how it is read back."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerslip.history import write_history
from fingerslip.parameters.dotted import flatten
from fingerslip.results import HISTORY, RUN, RunResult, result_of, stored_result, write_result
from fingerslip.slip import measures
from fingerslip.slip.front import edge_warning
from fingerslip.slip.resolution import resolution_warnings
from fingerslip.storage.files import digest, writing
from fingerslip.study.definition.file import read_mapping, write_mapping
from fingerslip.study.definition.runs import Run
from fingerslip.study.running.build import mesh_key
from fingerslip.study.storage.provenance import versions

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "RESULT_FORMAT",
    "RUN",
    "identity",
    "mesh_hash",
    "mesh_size",
    "read_run",
    "write_run",
    "write_snapshots",
]


def write_snapshots(history: xr.Dataset, folder: Path) -> None:
    """Write ``snapshots.pvd`` and one ``.vtu`` file per snapshot; nothing where there are no snapshots.

    The points are reference positions. The field ``displacement`` [m] has three components, so that *Warp By Vector*
    shows the deformed body, to scale or exaggerated.
    """
    from fingerslip.export.paraview import snapshot_mesh, write_series

    times = history["snapshot_time"].values.tolist() if "snapshot_time" in history.coords else []
    if times:
        write_series(folder, "snapshots", ((time, snapshot_mesh(history, number)) for number, time in enumerate(times)))


#: Raised whenever the numerics or the files of a run change, so that older runs are computed again.
RESULT_FORMAT = 9

_logger = logging.getLogger("fingerslip.study")


def identity(run: Run) -> str:
    """Return the hash of everything that decides the result of a run: its values, its mesh files, the program."""
    values = {key: value for key, value in run.plain_values().items() if key != "title"}
    values["mesh"] = {"hash": mesh_key(run)}
    made_by = {"format": RESULT_FORMAT, "version": metadata.version("fingerslip")}
    return digest([made_by, values])


def mesh_hash(mesh: Any) -> str:
    """Return a hash of the points and cells of a mesh, in which the last digits of the points do not count.

    Points count in steps of 1/(sqrt(3) 10^7) of the mesh's size, between which regular meshes have none.
    """
    step = np.ptp(mesh.p) / (np.sqrt(3.0) * 1e7)
    return digest(np.rint(np.asarray(mesh.p) / step).astype(np.int64), np.asarray(mesh.t))


def mesh_size(mesh: Any) -> float:
    """Return the representative element size N^(-1/dim) of a mesh of N cells, for the ratio of two meshes of a body."""
    return float(mesh.t.shape[1] ** (-1.0 / mesh.dim()))


def write_run(folder: Path, run: Run, history: xr.Dataset, *, inputs: str, mesh: Any, seconds: float) -> None:
    """Write the files of a run, and log its measures.

    Units: seconds [s].
    """
    result = dataclasses.replace(
        result_of(history, run.name, run.swept),
        identity=inputs,
        mesh_hash=mesh_hash(mesh),
        mesh_size=mesh_size(mesh),
        seconds=seconds,
        versions=versions(),
        sampled=run.sampled,
    )
    _log_result(result, history.attrs)
    write_history(history, folder / HISTORY)
    with writing(folder):
        write_mapping(run.plain_values(), folder / RUN, comment="fingerslip run run.yaml repeats this run")
        write_snapshots(history, folder)
    write_result(result, folder)


def read_run(folder: Path, uncertainty: Mapping[str, float]) -> RunResult:
    """Read a finished run back, with all its values."""
    result = stored_result(folder)
    return dataclasses.replace(result, values=flatten(read_mapping(folder / RUN)), uncertainty=uncertainty)


def _log_result(result: RunResult, attributes: Mapping[Any, Any]) -> None:
    for name, value in attributes.items():
        _logger.info("%s: %s", name, value)
    for measure in measures.MEASURES:
        _logger.info("%s: %s", measure.label, measure.text(result.numbers[measure.key]))
    for warning in (edge_warning({result.name: result.edge}), *resolution_warnings({result.name: result.numbers})):
        if warning:
            _logger.warning("%s", warning)
