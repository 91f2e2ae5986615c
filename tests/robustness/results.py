"""Cases of stored results: a study of two runs, one of whose files is damaged before a verb reads it."""

import contextlib
import json
import random
import shutil
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import xarray as xr
import yaml

from fingerslip.errors import DamagedError
from fingerslip.history import read_history, write_history
from fingerslip.report.figures import study as convergence
from fingerslip.report.figures import style as save
from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.scene.scene import check_options
from fingerslip.results import HISTORY, RESULT, RUN, read_result
from fingerslip.snapshot import read_snapshot
from fingerslip.storage.files import file_digest, read_json, write_json, write_text
from fingerslip.study import convergence as refining
from fingerslip.study.inspection.show import diff_runs, show
from fingerslip.study.inspection.views import _stored_history
from fingerslip.study.running import compute, runner
from fingerslip.study.storage import reporting
from fingerslip.study.storage.store import read_run
from fingerslip.validation.evidence import measure_folder
from fingerslip.validation.measures import measure
from robustness.block import TWO_RUNS, write_block
from robustness.mutants import changed_bytes, changed_data

_NAMES = ("friction_coefficient-0.2", "friction_coefficient-0.6")
_IN_STUDY = ("manifest.json", "summary.csv", "convergence/convergence.json", "report.html")
_IN_RUN = ("events.json", "run.yaml", "history.nc")
_REPORTS = 0.004
_STUDY = TWO_RUNS | {
    "converge": {"mesh": [], "step": [0.5, 0.25], "penalty": [], "alpha": []},
    "record": {"snapshots_every": "20 ms"},
    "compare": ["wang2014-table2"],
}


def result_cases(folder: Path) -> Callable[[random.Random], None]:
    """Return what runs a case: one file of the results is damaged, a verb uses them, and all is put back."""
    path, whole, results = _computed(folder)
    files = {one.relative_to(whole) for one in whole.rglob("*") if one.is_file()}
    study = results / path.stem
    targets = [study / name for name in _IN_STUDY] + 2 * [study / run / name for run in _NAMES for name in _IN_RUN]
    verbs = _readers(study) | {
        "run": lambda: runner.run_study(path, results_dir=results, workers=1),
        "converge": lambda: refining.converge(path, results_dir=results, workers=1),
    }

    def case(chance: random.Random) -> None:
        shutil.rmtree(results, ignore_errors=True)
        shutil.copytree(whole, results)
        target, verb = chance.choice(targets), chance.choice(sorted(verbs))
        was = target.read_bytes()
        _damage(target, chance)
        is_changed = not target.is_file() or target.read_bytes() != was
        with ExitStack() as stack:
            if verb != "report" or chance.random() > _REPORTS:
                stack.enter_context(_nothing_drawn())
            verbs[verb]()
        if verb in ("run", "converge"):
            _check_repaired(results, whole, study)
        new = {one.relative_to(results) for one in results.rglob("*") if one.is_file()} - files
        assert not new, f"{verb} left {new}"
        readers = ("report", "diff", "validate", *(("show run", "view") if target.parent.name == _NAMES[0] else ()))
        if is_changed and target.name in ("history.nc", "run.yaml") and verb in readers:
            raise AssertionError(f"{verb} trusts a damaged {target.name}")

    return case


def forged_cases(folder: Path) -> Callable[[random.Random], None]:
    """Return what runs a case: values of a run are changed, the checksums are made to fit, and a verb reads them."""
    path, whole, results = _computed(folder)
    study = results / path.stem
    run, verbs = study / _NAMES[0], _readers(study)

    def case(chance: random.Random) -> None:
        shutil.rmtree(results, ignore_errors=True)
        shutil.copytree(whole, results)
        match chance.choice((HISTORY, HISTORY, RUN, RESULT, "manifest.json")):
            case "history.nc":
                write_history(_other_history(read_history(run / HISTORY), chance), run / HISTORY)
            case "run.yaml":
                (run / RUN).write_text(yaml.safe_dump(changed_data(yaml.safe_load((run / RUN).read_text()), chance)))
            case name:
                target = run / RESULT if name == RESULT else study / name
                values = changed_data(read_json(target, ""), chance)
                write_json(target, values)
        with contextlib.suppress(DamagedError, AttributeError, KeyError, TypeError):
            values = read_json(run / RESULT, "")
            values["files"] |= {name: file_digest(run / name) for name in (HISTORY, RUN)}
            write_json(run / RESULT, values)
        with _nothing_drawn():
            verbs[chance.choice(sorted(verbs))]()

    return case


def _computed(folder: Path) -> tuple[Path, Path, Path]:
    """Return the file of a study, the folder of its whole results, and that of the results to damage."""
    path, whole = write_block(folder, **_STUDY), folder / "whole"
    with _nothing_drawn():
        refining.converge(path, results_dir=whole, workers=1)
    return path, whole, folder / "results"


def _readers(study: Path) -> dict[str, Callable[[], Any]]:
    """Return what reads the results of a study, by its verb."""
    return {
        "report": lambda: reporting._content(reporting.read_results(study), {}),
        "show": lambda: show(str(study)),
        "show run": lambda: show(str(study / _NAMES[0])),
        "diff": lambda: diff_runs(*(study / name for name in _NAMES)),
        "view": lambda: _view(study / _NAMES[0]),
        "validate": lambda: [measure_folder(study / name, read_run(study / name), measure) for name in _NAMES],
    }


def _other_history(history: xr.Dataset, chance: random.Random) -> xr.Dataset:
    """Return a history with one variable missing, or of other values, units, type or length."""
    name = chance.choice(sorted(map(str, history.variables)))
    variable = history[name]
    match chance.randrange(6):
        case 0:
            return history.drop_vars(name)
        case 1:
            if variable.dtype.kind == "f":
                history[name] = variable * chance.choice((0, -1, np.nan, np.inf, 1e300, 1e-300))
        case 2:
            history[name].attrs["units"] = chance.choice(("ms", "mm", "", "furlong", "deg"))
        case 3:
            history[name] = variable.astype(str)
        case 4:
            name = chance.choice(sorted(history.attrs) or ["x"])
            history.attrs[name] = chance.choice(("", "x", 3, -1.0, "{", "1" * 400))
        case _:
            name = chance.choice(sorted(map(str, history.sizes)))
            return history.isel({name: slice(0, chance.choice((0, 1, 2)))})
    return history


def _damage(target: Path, chance: random.Random) -> None:
    """Change a file's bytes or values, remove it, or put a folder or another file in its place."""
    kind = chance.random()
    if kind < 0.05:
        target.unlink()
    elif kind < 0.1:
        target.unlink()
        target.mkdir()
    elif kind < 0.15:
        target.write_bytes(chance.choice([one for one in target.parent.iterdir() if one.is_file()]).read_bytes())
    elif kind < 0.6 and target.suffix in (".json", ".yaml"):
        # JSON as PyYAML writes it in its flow style reads back as either.
        values = changed_data(yaml.safe_load(target.read_text()), chance)
        style = {"default_flow_style": True, "default_style": '"'} if chance.random() < 0.1 else {"sort_keys": False}
        target.write_text(json.dumps(values) if target.suffix == ".json" else yaml.safe_dump(values, **style))
    else:
        target.write_bytes(changed_bytes(target.read_bytes(), chance))


def _view(folder: Path) -> None:
    history = _stored_history(folder)
    check_options(history, SceneOptions())
    read_snapshot(history, history.sizes["snapshot_time"] - 1)


def _check_repaired(results: Path, whole: Path, study: Path) -> None:
    """Hold that after a run all results are those of undamaged runs."""
    for name in _NAMES:
        mine, original = (read_result(folder / study.name / name) for folder in (results, whole))
        assert mine is not None, f"{name} is not finished"
        assert original is not None
        assert (mine.events, mine.numbers, mine.peaks) == (original.events, original.numbers, original.peaks)
        for one, other in zip(*(_slips(folder / study.name / name) for folder in (results, whole)), strict=True):
            np.testing.assert_array_equal(one, other)


def _slips(folder: Path) -> tuple[Any, ...]:
    history = read_history(folder / "history.nc")
    return tuple(history[name].values for name in ("slip_distance", "gap", "counterface_force", "time"))


@contextmanager
def _nothing_drawn() -> Iterator[None]:
    """Read all that a report shows, and draw nothing."""

    def write_report(study: Any, pictures: Any) -> None:
        reporting._content(study, pictures or {})
        write_text(study.folder / "report.html", "report")

    with (
        patch.object(runner, "write_report", write_report),
        patch.object(compute, "drawings_of", lambda *_: {}),
        patch.object(save, "save_figure", lambda *_: None),
        patch.object(convergence, "convergence_figure", lambda *_: None),
        warnings.catch_warnings(),
    ):
        yield
