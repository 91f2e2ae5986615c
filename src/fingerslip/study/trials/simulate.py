"""The trials of a study side by side, each whole or not at all; what is there already is not computed again."""

from __future__ import annotations

import contextlib
import multiprocessing
import shutil
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fingerslip.detect.trials import FILES, MANIFEST, TrialSet, open_trials, write_trial, write_trials
from fingerslip.errors import FingerslipError, InputError, ResultError
from fingerslip.parameters import as_mapping
from fingerslip.storage.files import alone, check_replaceable, clean_stale, digest, holds, new_folder
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.definition.settings import TrialSettings
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.storage.store import commit

if TYPE_CHECKING:
    from fingerslip.study.trials.bodies import BodyPlan
    from fingerslip.study.trials.trials import TrialPlan

_VERSION = 2
# Folder of the bodies beside a data set, which other data sets may need.
_BODIES = ".bodies"


class TrialsFailedError(FingerslipError):
    """Some trials failed; the others are kept."""

    def __init__(self, errors: Mapping[str, FingerslipError], total: int) -> None:
        self.errors, self.total = dict(errors), total
        super().__init__(self.errors, total)

    def __str__(self) -> str:
        # A sensor that cannot be pressed fails many trials for one reason.
        names: dict[str, list[str]] = {}
        for name, error in self.errors.items():
            names.setdefault(str(error), []).append(name)
        lines = [f"{first}{f' and {len(rest)} more' * bool(rest)}: {text}" for text, (first, *rest) in names.items()]
        text = f"{len(self.errors)} of {self.total} trials failed, the others are kept; no data set is written"
        return "\n".join([*lines, text])


def simulate_trials(
    path: str | Path, output: str | Path, *, workers: int = 2, progress: StudyProgress | None = None
) -> TrialSet:
    """Make the data set of a study, or read it back where it is whole: simulate its runs, film them, label them.

    Finished trials are kept beside the data set, in ``OUTPUT.unfinished``, until it is whole: an interrupted call goes
    on where it stopped. The condensed sensor is kept in ``.bodies`` there, for the next data set, too.
    """
    source, final = Path(path), Path(output)
    check_replaceable(final, MANIFEST)
    runs_of_study = read_runs(source)
    study, runs = runs_of_study.study, runs_of_study.runs
    if study.trials is None:
        raise InputError(f"{source}: trials", "is missing", "needs directions and cameras", "write trials: {}")
    if study.repeats is not None:
        repair = "write a sample whose count is directions times repeats"
        raise InputError(f"{source}: repeats", "is given with trials", "needs samples in their place", repair)
    settings = study.trials
    # What simulates and films is slow to load: what is wrong with a study is said before.
    from fingerslip.study.running.build import name_errors
    from fingerslip.study.trials.bodies import shared_bodies
    from fingerslip.study.trials.trials import card_notes, check_plan, trial_plans

    plans = trial_plans(runs, settings, study.sample.count if study.sample else None)
    for plan in plans:
        with name_errors(plan.run):
            check_plan(plan, settings)
    bodies = shared_bodies(runs, settings)
    keys = {}
    for plan in plans:
        values = {name: value for name, value in plan.run.plain_values.items() if name != "title"}
        body = bodies[plan.run.name].key
        keys[plan.name] = digest([_VERSION, body, plan.number, plan.direction, as_mapping(settings), values])
    work = final.with_name(f"{final.name}.unfinished")
    # Who makes the same data set beside waits, and finds it whole: this folder is removed at the end.
    with alone(work / ".lock"):
        if whole := _whole_trials(final, keys):
            return whole
        clean_stale(work)
        origin = {"study": source.name, "commit": commit() or ""}
        missing = [plan for plan in plans if not holds(work / plan.name / FILES[3], "inputs", keys[plan.name])]
        with progress or StudyProgress() as reporter:
            failed = _make_bodies([bodies[plan.run.name] for plan in missing], final.with_name(_BODIES), reporter)
            bodies_of_plans = {plan.name: bodies[plan.run.name].key for plan in plans}
            _compute(missing, _Shared(settings, bodies_of_plans, origin, keys, work, failed), workers, reporter)
        notes = card_notes(study, settings)
        trials = write_trials([work / plan.name for plan in plans], final, study.title, notes)
        shutil.rmtree(work, ignore_errors=True)
        return trials


def _whole_trials(folder: Path, keys: Mapping[str, str]) -> TrialSet | None:
    """Return a data set of these trials with the same inputs; None where none is there, or it is damaged."""
    with contextlib.suppress(ResultError):
        trials = open_trials(folder) if (folder / MANIFEST).is_file() else None
        same = all(holds(folder / name / FILES[3], "inputs", key) for name, key in keys.items())
        return trials if trials and same and set(trials.names) == set(keys) else None
    return None


@dataclass(frozen=True)
class _Shared:
    """What all trials of a data set share."""

    settings: TrialSettings
    bodies: Mapping[str, str]  # key of the body of each trial
    origin: Mapping[str, Any]  # what the provenance of each says
    keys: Mapping[str, str]  # what each is made of, hashed
    work: Path  # folder of unfinished data
    failed: Mapping[str, FingerslipError]  # why some bodies are not there, by their keys


def _make_bodies(plans: Sequence[BodyPlan], folder: Path, progress: StudyProgress) -> dict[str, FingerslipError]:
    """Make the bodies of trials, each once; return the error of those that are not there, by their keys."""
    from fingerslip.study.trials.bodies import make_bodies

    waiting = {plan.key: plan for plan in plans}
    progress.begin([plan.name for plan in waiting.values()])
    try:
        for plan in make_bodies(tuple(waiting.values()), folder, progress.advance) if waiting else ():
            progress.finish(waiting.pop(plan.key).name, "done")
    except FingerslipError as error:
        for plan in waiting.values():
            progress.finish(plan.name, "failed")
        return dict.fromkeys(waiting, error)
    return {}


def _compute(plans: Sequence[TrialPlan], shared: _Shared, workers: int, progress: StudyProgress) -> None:
    """Compute trials; those that fail are told at the end."""
    progress.begin([plan.name for plan in plans])
    keys = {plan.name: shared.bodies[plan.name] for plan in plans}
    errors = {name: shared.failed[key] for name, key in keys.items() if key in shared.failed}
    for name, error in _outcomes([plan for plan in plans if plan.name not in errors], shared, workers):
        progress.finish(name, "failed" if error else "done")
        if error:
            errors[name] = error
    if errors:
        raise TrialsFailedError(dict(sorted(errors.items())), len(shared.keys))


def _outcomes(
    plans: Sequence[TrialPlan], shared: _Shared, workers: int
) -> Iterator[tuple[str, FingerslipError | None]]:
    """Yield the name of each trial when it is done, with its error."""
    if workers == 1 or len(plans) < 2:
        yield from (_simulate(plan, shared) for plan in plans)
        return
    from fingerslip.study.running.compute import end_with_parent, without_main_module

    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, initializer=end_with_parent) as pool:
        try:
            with without_main_module():
                futures = [pool.submit(_simulate, plan, shared) for plan in plans]
            for future in as_completed(futures):
                yield future.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _simulate(plan: TrialPlan, shared: _Shared) -> tuple[str, FingerslipError | None]:
    """Simulate a trial and write its folder."""
    from fingerslip.linear.resources import limited_threads
    from fingerslip.study.trials.bodies import stored_body
    from fingerslip.study.trials.trials import simulated_trial

    key = shared.bodies[plan.name]
    origin = {**shared.origin, "body": key, "inputs": shared.keys[plan.name]}
    try:
        with limited_threads(1), new_folder(shared.work / plan.name) as folder:
            body = stored_body(key, shared.work.with_name(_BODIES))
            write_trial(simulated_trial(plan, shared.settings, body, origin), folder)
    except FingerslipError as error:
        return plan.name, error
    return plan.name, None
