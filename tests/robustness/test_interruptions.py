"""Runs that are ended at any moment, or run twice at once, come to whole results when they are run again."""

import os
import random
import shutil
import signal
import time

import pytest

from robustness.block import TWO_RUNS, write_block
from robustness.cases import SEED, unfinished
from robustness.interruptions import begin, differences

_KILLS, _PARTS, _IN_A_ROW = 200, 8, 5
_ENDINGS = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return write_block(tmp_path_factory.mktemp("study"), **TWO_RUNS)


@pytest.fixture(scope="module")
def undisturbed(study):
    """Return the results of a run that nothing disturbs, and the seconds that it takes."""
    folder = study.parent / "undisturbed"
    finish(study, folder)  # compiles
    started = time.perf_counter()
    finish(study, study.parent / "again")
    return folder, time.perf_counter() - started


def finish(study, results):
    """Run a study to its end."""
    errors = results.with_name(f"{results.name} errors")
    process = begin(study, results, errors)
    process.join(120)
    assert (process.exitcode, errors.read_text() if errors.exists() else "") == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize("part", range(_PARTS))
def test_runs_that_are_ended_go_on_to_the_same_results(study, undisturbed, tmp_path, part):
    whole, seconds = undisturbed
    chance = random.Random(SEED + part)
    for number in range(_KILLS // _PARTS // _IN_A_ROW):
        results = tmp_path / f"results {number}"
        ended = 0
        while ended < _IN_A_ROW:
            started = time.perf_counter()
            process = begin(study, results, tmp_path / "errors")
            process.join(chance.uniform(0.0, 1.1) * seconds)
            if process.exitcode is None:
                os.kill(process.pid or 0, chance.choice(_ENDINGS))
                ended += 1
            process.join(120)
            if process.exitcode == 0:  # finished before: there is nothing left to end in these results
                seconds = min(seconds, time.perf_counter() - started)
                shutil.rmtree(results)
        finish(study, results)
        assert differences(results, whole) == []
        assert unfinished(results) == []


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.0, 0.02, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9])
def test_two_processes_on_one_folder_leave_whole_results(study, undisturbed, tmp_path, delay):
    whole, seconds = undisturbed
    results, errors = tmp_path / "results", [tmp_path / name for name in ("one", "other")]
    processes = [begin(study, results, errors[0])]
    time.sleep(delay * seconds)
    processes.append(begin(study, results, errors[1]))
    for process in processes:
        process.join(120)
    texts = [path.read_text() for path in errors if path.exists()]
    # The slower one may find the place taken, and says so; no other error may end it.
    assert [text for text in texts if not text.splitlines()[-1].startswith("fingerslip.errors.")] == []
    finish(study, results)
    assert differences(results, whole) == []
    assert unfinished(results) == []
