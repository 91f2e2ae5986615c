"""The folder of a study's results: runs, reduced bases, a row for each run, what made them, how they converge."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import io
import logging
import platform
import subprocess
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from types import MappingProxyType
from typing import Any, NotRequired

import numpy as np
import pydantic
from typing_extensions import TypedDict

from fingerslip.arrays import Floats
from fingerslip.errors import DamagedError, ResultError
from fingerslip.history import write_history
from fingerslip.libraries import xr
from fingerslip.parameters.dotted import flatten
from fingerslip.react.results import read_reactions
from fingerslip.report.tables.runs import summary_table
from fingerslip.report.tables.samples import sensitivity_rows
from fingerslip.results import (
    HISTORY,
    RUN,
    Quantity,
    RefusedRun,
    RunResult,
    StudyResult,
    result_of,
    stored_result,
    without_results,
    write_result,
)
from fingerslip.sampling.sensitivity import fits_of
from fingerslip.slip import measures
from fingerslip.slip.front import edge_warning
from fingerslip.slip.measures import resolution_warnings
from fingerslip.snapshot import read_snapshot
from fingerslip.storage.files import alone, digest, read_json, write_bytes, write_json, write_text, writing
from fingerslip.study.definition.file import REPEATS, read_mapping, write_mapping
from fingerslip.study.definition.runs import Run
from fingerslip.tables.table import to_csv
from fingerslip.uncertainty import Convergence, Series

_logger = logging.getLogger("fingerslip.study")
_warn_once = functools.cache(_logger.warning)

_PACKAGES = (
    *("fingerslip", "scikit-fem", "gmsh", "pygmsh", "meshio"),
    *("numpy", "scipy", "numba", "pypardiso", "mkl", "xarray", "h5netcdf"),
)
_CHECKSUM = 64
_MADE_AGAIN = "%s: cannot be used (%s); the basis is made again"
# Bases that are kept: those of the bodies of one sweep. One of the paper's fingertip in 3D takes 0.5 GB.
_MOST_BASES = 8


def mesh_hash(mesh: Any) -> str:
    """Return a hash of the points and cells of a mesh, in which the last digits of the points do not count.

    Points count in steps of 1/(sqrt(3) 10^7) of the mesh's size, between which regular meshes have none.
    """
    step = np.ptp(mesh.p) / (np.sqrt(3.0) * 1e7)
    return digest(np.rint(np.asarray(mesh.p) / step).astype(np.int64), np.asarray(mesh.t))


def write_run(
    folder: Path,
    run: Run,
    history: xr.Dataset,
    *,
    inputs: str,
    mesh: Any,
    seconds: float,
    doubts: tuple[str, ...] = (),
) -> RunResult:
    """Write the files of a run that took so many seconds, log its measures, and return its result."""
    result = dataclasses.replace(
        result_of(history, run.name, run.swept),
        identity=inputs,
        doubts=(*doubts, *filter(None, [history.attrs.get("doubt")])),
        mesh_hash=mesh_hash(mesh),
        mesh_size=float(mesh.t.shape[1] ** (-1.0 / mesh.dim())),  # for the ratio of two meshes of a body
        seconds=seconds,
        versions=versions(),
        sampled=run.sampled,
        reaction=read_reactions(folder).times if run.study.reaction else {},
    )
    for name, value in history.attrs.items():
        _logger.info("%s: %s", name, value)
    for measure in measures.MEASURES:
        _logger.info("%s: %s", measure.label, measure.text(result.numbers[measure.key]))
    for warning in (edge_warning({result.name: result.edge}), *resolution_warnings({result.name: result.numbers})):
        if warning:
            _logger.warning("%s", warning)
    write_history(history, folder / HISTORY)
    with writing(folder):
        write_mapping(run.written_values, folder / RUN, comment=REPEATS)
        write_snapshots(history, folder)
    write_result(result, folder)
    return result


def read_run(folder: Path) -> RunResult:
    """Read a finished run back, with all its values."""
    return dataclasses.replace(stored_result(folder), values=flatten(read_mapping(folder / RUN)))


def write_snapshots(history: xr.Dataset, folder: Path) -> None:
    """Write ``snapshots.pvd`` and a ``.vtu`` file for each snapshot, if there are any, at reference positions."""
    from fingerslip.export.paraview import write_series

    if count := history.sizes.get("snapshot_time", 0):
        write_series(folder, "snapshots", (read_snapshot(history, number) for number in range(count)))


@functools.cache
def versions() -> Mapping[str, str]:
    """Return the versions of Python and of the packages that decide a result, those that are installed."""
    versions = {"python": platform.python_version(), "platform": platform.platform()}
    for name in _PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            versions[name] = metadata.version(name)
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
    most: int = _MOST_BASES  # how many are kept

    def load(self, key: str) -> Mapping[str, Floats] | None:
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

    def save(self, key: str, arrays: Mapping[str, Floats]) -> None:
        """Keep the arrays of a basis and remove the oldest of too many; the log says where that is not possible."""
        file = io.BytesIO()
        np.savez(file, **arrays)  # type: ignore[arg-type]
        content = file.getvalue()
        try:
            with writing(self.folder):
                self.folder.mkdir(parents=True, exist_ok=True)
                write_bytes(self.folder / f"{key}.basis", digest(content).encode() + content)
                for old in sorted(self.folder.glob("*.basis"), key=lambda path: path.stat().st_mtime)[: -self.most]:
                    old.unlink(missing_ok=True)
        except ResultError as error:
            _logger.warning("the basis is not kept: %s", error)

    def alone(self, key: str) -> AbstractContextManager[None]:
        """Let one process at a time into a block that looks for a basis and makes it where there is none."""
        return alone(self.folder / f".{key}.lock")


#: Files in the folder of a study.
MANIFEST, SUMMARY, SENSITIVITY = "manifest.json", "summary.csv", "sensitivity.csv"

#: Name of the folder in a study's results that holds the refined runs, their tables and figures.
CONVERGENCE = "convergence"
_CONVERGENCE_FILE = "convergence.json"

_REPAIR = "run the study again"


class _Run(TypedDict):
    identity: str
    mesh_hash: str
    wall_time_s: pydantic.FiniteFloat
    versions: dict[str, str]


class _Refused(TypedDict):
    swept: dict[str, Any]
    sampled: dict[str, Any]
    reason: str


class _Stored(TypedDict):
    """What the manifest of a study holds."""

    study: str
    title: str
    description: NotRequired[str]
    compare: list[str]
    given: list[str]
    ranges: NotRequired[dict[str, list[Any]]]
    design: NotRequired[dict[str, Any]]
    refused: NotRequired[dict[str, _Refused]]
    versions: dict[str, str]
    commit: str | None
    wall_time_s: pydantic.FiniteFloat
    report: str
    derived: dict[str, dict[str, tuple[pydantic.FiniteFloat | None, str]]]
    runs: dict[str, _Run]


_STORED: pydantic.TypeAdapter[Any] = pydantic.TypeAdapter(_Stored)


def write_results(source: Path, study: StudyResult, report: str, given: Sequence[str] = ()) -> None:
    """Write a row for each run, what each sampled value does to each slip time, and what made the results."""
    write_text(study.folder / SUMMARY, to_csv(summary_table(study.runs, study.refused)))
    samples = {}
    if study.ranges:
        write_text(study.folder / SENSITIVITY, to_csv(sensitivity_rows(fits_of(study))))
        refused = {
            run.name: {"swept": dict(run.swept), "sampled": dict(run.sampled), "reason": run.reason}
            for run in study.refused
        }
        samples = {"ranges": dict(study.ranges), "design": dict(study.design), "refused": refused}
    manifest: dict[str, Any] = {
        "study": source.name,
        "title": study.title,
        **({"description": study.description} if study.description else {}),
        "compare": list(study.compare),
        "given": list(given),
        **samples,
        "versions": dict(versions()),
        "commit": commit(),
        "wall_time_s": round(sum(run.seconds for run in study.runs), 3),
        "report": report,
        "derived": {},
        "runs": {},
    }
    for run in study.runs:
        if run.derived:
            numbers = {name: [quantity.value, quantity.unit] for name, quantity in run.derived.items()}
            manifest["derived"][run.name] = numbers
        about = {"identity": run.identity, "mesh_hash": run.mesh_hash, "wall_time_s": round(run.seconds, 3)}
        manifest["runs"][run.name] = about | {"versions": dict(run.versions)}
    write_json(study.folder / MANIFEST, manifest)


def refused_in(manifest: Mapping[str, Any]) -> tuple[RefusedRun, ...]:
    """Return the samples that were not computed."""
    return tuple(RefusedRun(name, **values) for name, values in manifest.get("refused", {}).items())


def stored_study(folder: Path, read: Callable[[Path], RunResult]) -> StudyResult:
    """Read the results of a study back, each run by `read` from its folder."""
    manifest = stored_manifest(folder)
    convergences = read_convergences(folder, identities(manifest))
    runs = []
    for name in manifest["runs"]:
        quantities = manifest["derived"].get(name, {})
        derived = {label: Quantity(label, unit, value) for label, (value, unit) in quantities.items()}
        run = with_convergence(read(folder / name), convergences.get(name))
        runs.append(dataclasses.replace(run, derived=derived))
    return StudyResult(
        folder,
        tuple(manifest["compare"]),
        tuple(runs),
        unchanged=tuple(manifest["runs"]),
        title=manifest["title"],
        description=manifest.get("description", ""),
        ranges={path: tuple(ends) for path, ends in manifest.get("ranges", {}).items()},
        refused=refused_in(manifest),
        design=dict(manifest.get("design", {})),
    )


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return what made the results of a study; empty where there are none, or where the file is damaged."""
    try:
        return stored_manifest(folder)
    except ResultError:
        return {}


def stored_manifest(folder: Path) -> dict[str, Any]:
    """Return what made the results of a study."""
    said = without_results(folder, "holds no results of a study; needs a folder that fingerslip run wrote")
    try:
        return read_json(folder / MANIFEST, _REPAIR, _STORED)
    except FileNotFoundError:
        raise ResultError(f"{folder}: {said}") from None
    except DamagedError as error:
        raise ResultError(f"{folder}: {said}: {error}") from None


def identities(manifest: Mapping[str, Any]) -> dict[str, str]:
    """Return the hash of the inputs of every run in a manifest, by its name."""
    return {name: str(run["identity"]) for name, run in manifest["runs"].items()}


@dataclass(frozen=True)
class RunConvergence:
    """The convergence of every number of one run."""

    run: str  # its name
    identity: str  # hash of its inputs
    quantities: Mapping[str, Convergence]  # by key, see :func:`fingerslip.results.quantities`

    @property
    def uncertainties(self) -> dict[str, float]:
        """The uncertainties that are known, by key [SI]."""
        bars = {key: quantity.uncertainty for key, quantity in self.quantities.items()}
        return {key: bar for key, bar in bars.items() if bar is not None}


def write_convergences(folder: Path, convergences: Mapping[str, RunConvergence]) -> None:
    """Write the convergence of the runs of a study into its results."""
    values = {}
    for name, convergence in convergences.items():
        quantities = {key: _quantity_mapping(quantity) for key, quantity in convergence.quantities.items()}
        values[name] = {"identity": convergence.identity, "quantities": quantities}
    with writing(folder):
        (folder / CONVERGENCE).mkdir(exist_ok=True)
    write_json(folder / CONVERGENCE / _CONVERGENCE_FILE, values)


def read_convergences(folder: Path, identities: Mapping[str, str]) -> dict[str, RunConvergence]:
    """Read back the convergence of the runs with these inputs."""
    try:
        stored = read_json(folder / CONVERGENCE / _CONVERGENCE_FILE, "run fingerslip converge again")
    except FileNotFoundError:
        return {}
    except DamagedError as error:
        _warn_once("%s; without it no uncertainties are known", str(error))
        return {}
    return {
        name: RunConvergence(
            name, run["identity"], {key: _quantity(of_run) for key, of_run in run["quantities"].items()}
        )
        for name, run in stored.items()
        if run["identity"] == identities.get(name)
    }


def _quantity(stored: Mapping[str, Any]) -> Convergence:
    series = {key: Series(key, tuple(of["sizes"]), tuple(of["values"])) for key, of in stored["sources"].items()}
    return Convergence(stored["name"], stored["unit"], stored["value"], series, stored.get("resolution", 0.0))


def with_convergence(run: RunResult, convergence: RunConvergence | None) -> RunResult:
    """Return a run with its numerical uncertainties and where they are from; without them where none are known."""
    uncertainty, quantities = (convergence.uncertainties, convergence.quantities) if convergence else ({}, {})
    return dataclasses.replace(run, uncertainty=uncertainty, convergence=quantities)


def _quantity_mapping(convergence: Convergence) -> dict[str, Any]:
    """Return how a number converges as plain data, with what follows from its values."""
    sources = {}
    for setting, refinement in convergence.refinements.items():
        series = convergence.sources[setting]
        sources[setting] = {"sizes": list(series.sizes), "values": list(series.values)} | {
            name: getattr(refinement, name) for name in ("behaviour", "order", "limit", "uncertainty")
        }
    return {
        "name": convergence.quantity,
        "unit": convergence.unit,
        "value": convergence.value,
        "uncertainty": convergence.uncertainty,
        "resolution": convergence.resolution,
        "converges": not convergence.unsettled_settings,
        "sources": sources,
    }
