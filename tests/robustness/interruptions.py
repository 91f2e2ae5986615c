"""A study run as a user runs it, in processes that are ended at any moment."""

import multiprocessing
import sys
import traceback
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from fingerslip.commands.shared import stop_on_termination
from fingerslip.history import read_history
from fingerslip.results import stored_result
from fingerslip.study.running import compute, runner

# The server has the modules loaded, so that a process that it forks takes a fraction of a second.
_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload(["fingerslip.study.running.runner", "fingerslip.linear.solvers.pardiso"])


def begin(study: Path, results: Path, errors: Path) -> BaseProcess:
    """Begin to run a study in a process of its own, which writes what goes wrong to a file."""
    process = _CONTEXT.Process(target=_run, args=(study, results, errors))
    with compute.without_main_module():
        process.start()
    return process


def _run(study: Path, results: Path, errors: Path) -> None:
    """Run a study as ``fingerslip run`` does, but draw nothing, which would take longer than the runs."""
    stop_on_termination()
    try:
        with patch.object(runner, "write_report", _write_report), patch.object(compute, "drawings_of", lambda *_: {}):
            runner.run_study(study, results_dir=results, workers=1)
    except BaseException:  # noqa: BLE001  what it was is for the test to judge
        errors.write_text(traceback.format_exc())
        sys.exit(1)


def _write_report(study: Any, _: Any) -> None:
    (study.folder / "report.html").write_text("report")


def differences(folder: Path, undisturbed: Path) -> list[str]:
    """Return in what the results of a study differ from those of an undisturbed run of it."""
    found = []
    files, expected = (
        {path.relative_to(one) for path in one.rglob("*") if path.is_file()} for one in (folder, undisturbed)
    )
    found += [f"files: {sorted(map(str, files ^ expected))}"] * (files != expected)
    for run in sorted(path.parent for path in undisturbed.rglob("events.json")):
        one, other = folder / run.relative_to(undisturbed), run
        mine, whole = stored_result(one), stored_result(other)
        is_same = (mine.events, mine.peaks, mine.identity) == (whole.events, whole.peaks, whole.identity)
        histories = [read_history(place / "history.nc") for place in (one, other)]
        is_same &= all(np.array_equal(histories[0][name], histories[1][name]) for name in histories[1])
        found += [f"{one.name}: other results"] * (not is_same)
    return found
