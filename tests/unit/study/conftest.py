"""A small study that reads a block as its mesh, and a simulation that needs no solving."""

from __future__ import annotations

import functools
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
import yaml

from fingerslip.dynamics import simulation
from fingerslip.errors import ConvergenceError
from fingerslip.mesh.io import write_mesh
from fingerslip.model.model import Model
from fingerslip.study.inspection.check import kinds_to_compile
from fingerslip.study.running import compute, runner
from fingerslip.study.storage import store
from unit import synthetic
from unit.study.block import block_mesh, block_values


def all_is_compiled(patch: pytest.MonkeyPatch) -> None:
    """Leave out what a fresh clone does first, with a simulation that may be replaced."""
    patch.setitem(kinds_to_compile.__globals__, "_has_cache", lambda _: True)


def draw_nothing(patch: pytest.MonkeyPatch, write_report: Callable[..., None] = lambda *_: None) -> None:
    """Have no picture drawn of a run, and another writer of reports."""
    patch.setattr(compute, "drawings_of", lambda *_: {})
    patch.setattr(runner, "write_report", write_report)


@pytest.fixture(scope="session")
def finished_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a study and its results, without a report; tests copy it."""
    folder = tmp_path_factory.mktemp("finished")
    write_mesh(block_mesh(), folder / "block.msh")
    path = folder / "block.yaml"
    path.write_text(yaml.safe_dump(block_values() | {"compare": ["wang2014-table2"]}, sort_keys=False))
    with pytest.MonkeyPatch.context() as patch:
        all_is_compiled(patch)
        patch.setattr("fingerslip.dynamics.simulation.simulate", known_history)
        draw_nothing(patch)
        runner.run_study(path, results_dir=folder / "results", workers=1)
    return folder


@pytest.fixture
def finished(finished_once: Path, tmp_path: Path) -> Path:
    """Return the results of a study of three runs, without a report, which a test may change."""
    shutil.copytree(finished_once, tmp_path, dirs_exist_ok=True)
    return tmp_path / "results" / "block"


def known_history(model: Model, *, progress: Callable[[float], None], threads: int | None, bases: Any) -> xr.Dataset:
    """Return a history of which the friction coefficient alone says when there is slip."""
    progress(0.5)
    return _history_of(model.contacts[0].friction.coefficient).copy()


@functools.cache
def _history_of(friction: float) -> xr.Dataset:
    return synthetic.with_mesh(synthetic.make(synthetic.Process(friction=friction, centre=1.4 + 0.5 * friction)))


@pytest.fixture
def write_study(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes a study beside its mesh and returns the study's path."""

    def write(values: dict[str, Any] | None = None, *, curvature: float = 0.0, name: str = "block") -> Path:
        write_mesh(block_mesh(curvature), tmp_path / "block.msh")
        path = tmp_path / f"{name}.yaml"
        path.write_text(yaml.safe_dump(values or block_values(), sort_keys=False))
        return path

    return write


commit = functools.cache(store.commit)
NOT_SOLVED = ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step")


@pytest.fixture(autouse=True)
def settled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let all be compiled already, and ask git but once."""
    all_is_compiled(monkeypatch)
    monkeypatch.setattr(store, "commit", commit)


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Replace the simulation by a known history; the list holds the friction coefficients it was called with."""
    calls: list[float] = []

    def fake(model: Model, *, progress: Callable[[float], None], threads: int | None, bases: Any) -> xr.Dataset:
        calls.append(model.contacts[0].friction.coefficient)
        return known_history(model, progress=progress, threads=threads, bases=bases)

    monkeypatch.setattr("fingerslip.dynamics.simulation.simulate", fake)
    return calls


@pytest.fixture
def fails(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Return a function that lets all runs, or those with a friction coefficient, end in an error."""

    def fail(error: BaseException = NOT_SOLVED, friction: float | None = None) -> None:
        whole = simulation.simulate

        def failing(model: Model, **options: Any) -> xr.Dataset:
            if friction in {None, model.contacts[0].friction.coefficient}:
                raise error
            return whole(model, **options)

        monkeypatch.setattr("fingerslip.dynamics.simulation.simulate", failing)

    return fail


@pytest.fixture
def reports(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """Replace the report by a stub; the list holds the runs that each report was made of."""
    made: list[tuple[str, ...]] = []

    def fake(stored: Any, _: Any) -> None:
        made.append(tuple(run.name for run in stored.runs))
        (stored.folder / "report.html").write_text("report")

    draw_nothing(monkeypatch, fake)
    return made
