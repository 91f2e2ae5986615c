"""The folder of a run: what tells its inputs apart, which programs made it, how it is written and read back.

Beside the runs of a study are their reduced bases, made once for each body, whatever run needs it first.
"""

from __future__ import annotations

import dataclasses
import functools
import io
import logging
import platform
import subprocess
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import ResultError
from fingerslip.history import write_history
from fingerslip.parameters.dotted import flatten
from fingerslip.results import HISTORY, RUN, RunResult, result_of, stored_result, write_result
from fingerslip.slip import measures
from fingerslip.slip.front import edge_warning
from fingerslip.slip.measures import resolution_warnings
from fingerslip.storage.files import alone, digest, write_bytes, writing
from fingerslip.study.definition.file import read_mapping, write_mapping
from fingerslip.study.definition.runs import Run
from fingerslip.study.running.build import mesh_key

if TYPE_CHECKING:
    import xarray as xr

#: Raised whenever the numerics or the files of a run change, so that older runs are computed again.
RESULT_FORMAT = 9

_logger = logging.getLogger("fingerslip.study")

_PACKAGES = (
    *("fingerslip", "scikit-fem", "gmsh", "pygmsh", "meshio"),
    *("numpy", "scipy", "numba", "pypardiso", "mkl", "xarray", "h5netcdf"),
)
_CHECKSUM = 64
_MADE_AGAIN = "%s: cannot be used (%s); the basis is made again"
# Bases that are kept: those of the bodies of one sweep. One of the paper's fingertip in 3D takes 0.5 GB.
_MOST_BASES = 8


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


def write_snapshots(history: xr.Dataset, folder: Path) -> None:
    """Write ``snapshots.pvd`` and one ``.vtu`` file per snapshot; nothing where there are no snapshots.

    The points are reference positions. The field ``displacement`` [m] has three components, so that *Warp By Vector*
    shows the deformed body, to scale or exaggerated.
    """
    from fingerslip.export.paraview import snapshot_mesh, write_series

    times = history["snapshot_time"].values.tolist() if "snapshot_time" in history.coords else []
    if times:
        write_series(folder, "snapshots", ((time, snapshot_mesh(history, number)) for number, time in enumerate(times)))


@functools.cache
def versions() -> Mapping[str, str]:
    """Return the versions of Python and of the packages that decide a result, those that are installed."""
    versions = {"python": platform.python_version(), "platform": platform.platform()}
    for name in _PACKAGES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return MappingProxyType(versions)


def commit() -> str | None:
    """Return the git commit of the source, with '-dirty' after changes; None outside a checkout."""
    source = Path(__file__).resolve().parents[4]
    if not (source / ".git").exists():
        return None
    command = ["git", "-C", str(source), "describe", "--always", "--abbrev=40", "--dirty", "--match="]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() or None


@dataclass(frozen=True)
class BasisFolder:
    """A folder of bases: a :class:`fingerslip.dynamics.reduced.basis.BasisStore`.

    Each file is the checksum of its arrays, then the arrays in NumPy's format. It has the key as its name.
    """

    folder: Path  # the folder, which is made when the first basis is kept

    def load(self, key: str) -> Mapping[str, NDArray[np.float64]] | None:
        """Return the arrays of a basis; None where there is none, or where its file is damaged, which the log says."""
        path = self.folder / f"{key}.basis"
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            _logger.warning(_MADE_AGAIN, path, error.strerror or str(error))
            return None
        if content[:_CHECKSUM] != digest(content[_CHECKSUM:]).encode():
            _logger.warning(_MADE_AGAIN, path, "its checksum is another")
            return None
        with np.load(io.BytesIO(content[_CHECKSUM:]), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}

    def save(self, key: str, arrays: Mapping[str, NDArray[np.float64]]) -> None:
        """Keep the arrays of a basis and remove the oldest of too many; the log says where that is not possible."""
        file = io.BytesIO()
        np.savez(file, **arrays)  # type: ignore[arg-type]
        content = file.getvalue()
        try:
            with writing(self.folder):
                self.folder.mkdir(parents=True, exist_ok=True)
                write_bytes(self.folder / f"{key}.basis", digest(content).encode() + content)
                for old in sorted(self.folder.glob("*.basis"), key=lambda path: path.stat().st_mtime)[:-_MOST_BASES]:
                    old.unlink(missing_ok=True)
        except ResultError as error:
            _logger.warning("the basis is not kept: %s", error)

    def alone(self, key: str) -> AbstractContextManager[None]:
        """Let one process at a time into a block that looks for a basis and makes it where there is none."""
        return alone(self.folder / f".{key}.lock")
