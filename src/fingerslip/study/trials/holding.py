"""Held objects as trials for detectors, and what a detector's alarms are worth: does the alarm save the object?

A trial is a run of a study with the block `reaction` on a sensor from its start on: the grip comes, then the load.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np

from fingerslip.detect.evaluation.scores import check_submission
from fingerslip.detect.labels import Onsets, read_onsets
from fingerslip.detect.trials import Trial, TrialSet, write_trials
from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.marker_tracks import marker_tracks
from fingerslip.react.loop import Grasp, MemoryBases, Outcome
from fingerslip.react.results import read_reactions
from fingerslip.react.scenario import HeldObject
from fingerslip.react.settings import ReactionSettings
from fingerslip.results import HISTORY, RUN
from fingerslip.study.definition.runs import Run
from fingerslip.study.running.build import build_model
from fingerslip.study.running.compute import BASES
from fingerslip.study.storage.reporting import read_results, read_run_values
from fingerslip.study.storage.store import BasisFolder
from fingerslip.tables.table import Column, Table

#: A run in which an object is held, how it reacts, and the object.
_HeldRun: TypeAlias = tuple[Run, ReactionSettings, HeldObject]


def held_runs(folder: Path) -> dict[str, _HeldRun]:
    """Return the finished runs of a study with the block `reaction`, by name."""
    runs = {result.name: read_run_values(folder / result.name / RUN) for result in read_results(folder).runs}
    held_runs = {
        name: (run, run.study.reaction, run.study.held_object)
        for name, run in runs.items()
        if run.study.reaction is not None and run.study.held_object is not None
    }
    if not held_runs:
        raise InputError(str(folder), "holds no object", "needs results of a study with the block reaction")
    return held_runs


def held_trials(folder: Path, output: Path, frame_rate: float, *, lost: bool = False) -> TrialSet:
    """Write the data set of a study's runs: pins of the sensor [m] at a frame rate [1/s], labels by their detectors.

    The label of each detector of the study is its alarm; gross slip begins when nothing sticks any more. With `lost`
    there are only the objects that are lost without a reaction: detectors learn from trials with both onsets.
    """
    notes = "Simulated. Objects are held; time is that of the run: grip and weight come first, then the load grows."
    return write_trials(_trials(folder, frame_rate, lost), output, "Held objects", notes)


def _trials(folder: Path, frame_rate: float, lost: bool) -> Iterator[Trial]:
    for name, (_, _, held) in held_runs(folder).items():
        result = read_reactions(folder / name)
        if lost and result.lost is None:
            continue
        tracks = marker_tracks(read_history(folder / name / HISTORY), ("internal",))
        every = max(round(1.0 / (frame_rate * held.step)), 1)

        def at(time: float | None, begins: float = held.begins) -> float | None:
            return None if time is None else begins + time

        labels = {label: Onsets(at(alarm), at(result.gross)) for label, alarm in result.alarms.items()}
        rate = {} if result.load_rate is None else {"load_rate": result.load_rate}
        conditions = {"task": "hold", "friction_coefficient": result.friction, **rate}
        yield Trial(name, tracks.isel(time=slice(0, None, every)), labels, conditions, {"source": "simulation"})


def score_alarms(folder: Path, submission: Path) -> Table:
    """Return what comes of a submission's alarms under the study's own reflex, beside none, the earliest and the truth.

    The submission is that of the detection benchmark: `trial`, `incipient_s` and `gross_s`, a row for each run. The
    first of both onsets is the alarm; its time is that of the run.
    """
    runs = held_runs(folder)
    onsets = check_submission(read_onsets(submission), tuple(runs), str(submission))
    bases = MemoryBases(BasisFolder(folder / BASES))
    outcomes: dict[str, list[Outcome]] = {}
    early = 0
    for name, (run, settings, held) in runs.items():
        first = onsets[name].first
        alarm = None if first is None else first - held.begins
        early += alarm is not None and alarm < 0.0
        with Grasp(held, build_model(run), settings.detectors, bases=bases) as grasp:
            of_run = {
                "none": grasp.branch(None),
                **{each: grasp.react(settings.rise, each) for each in settings.detectors},
            }
            for label, time in {"at once": 0.0, submission.name: alarm}.items():
                start = None if time is None else max(time, 0.0) + settings.rise.delay
                response = None if start is None else settings.rise.response(start, held.first_grip)
                of_run[label] = grasp.branch(response)
        for label, outcome in of_run.items():
            outcomes.setdefault(label, []).append(outcome)
    return _table(outcomes, {submission.name: early}, next(iter(runs.values()))[1])


def _table(outcomes: Mapping[str, list[Outcome]], early: Mapping[str, int], settings: ReactionSettings) -> Table:
    """Return a row for each source of alarms; `early` says how many came before the load."""
    lost = np.array([not outcome.saved for outcome in outcomes["none"]])
    rows = []
    for name, results in outcomes.items():
        saved = np.array([outcome.saved for outcome in results])
        false = sum(outcome.start is not None and outcome.false_grip for outcome in results)
        share = 100.0 * float(saved[lost].mean()) if lost.any() else None
        force = float(np.mean([outcome.grip_added for outcome in results]))
        travel = 1e3 * float(np.median([outcome.travel for outcome in results]))
        rows.append((name, share, false, early.get(name, 0), force, travel))
    columns = (
        *(Column("alarm"), Column("saved", "%", 0), Column("false grips"), Column("before the load")),
        *(Column("force spent", "N", 2), Column("median travel", "mm", 1)),
    )
    delay, rate = 1e3 * settings.rise.delay, settings.actuator.force_rate
    note = (
        f"{lost.size} objects, {int(lost.sum())} of which are lost without a reaction; shares are of these. A false "
        f"grip is one for an object that is held anyway. The grip rises {delay:.0f} ms after an alarm, at {rate:g} N/s."
    )
    return Table("Does the alarm save the object?", columns, tuple(rows), note)
