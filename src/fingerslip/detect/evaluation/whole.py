"""Whole trials as a task of their own: is there slip in it, or none?"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fingerslip.arrays import Flags, Floats
from fingerslip.detect.classifiers import CLASSIFIERS, optional
from fingerslip.detect.evaluation.figures import Judged, write_evaluation
from fingerslip.detect.evaluation.scores import INTERVALS, ratio_estimate, table_of
from fingerslip.detect.features import FeatureSettings, MotionSettings, features_of, motion_of
from fingerslip.detect.labels import Onsets
from fingerslip.detect.recordings import NO_SLIP_WORD, SLIP, SLIP_WORD
from fingerslip.detect.residual import ResidualSettings, detect_residual
from fingerslip.detect.samples import grouped_folds
from fingerslip.detect.session import Choices, groups_of
from fingerslip.detect.trials import TrialSet, open_trials
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.tables.table import Column, Table

#: What says of a trial whether there is slip in it: the classifier, and the columns of features that it sees.
_SEEN = {
    "forest": ("forest", "field"),
    "logistic": ("logistic", "field"),
    "length of the clip alone": ("time_threshold", "length"),
}
#: Name of the detector that ships, which learns nothing.
SHIPS = "the detector that ships"


def evaluate_whole(
    dataset: Path, choices: Choices, *, folds: int = 5, group: str | None = None, output: Path | None = None
) -> list[Table]:
    """Return how well it is told whether there is slip in whole trials, after learning from the others, as tables."""
    trials, seed = open_trials(dataset), choices.seed
    has_all = all(SLIP in trials.conditions[name] for name in trials.names)
    slips = slips_of(trials, {} if has_all else choices.onsets(trials))
    tests = grouped_folds(trials.names, folds, seed, groups_of(trials, group))
    true = np.array(list(slips.values()))
    fold = np.array([next(number for number, test in enumerate(tests) if name in test) for name in slips])
    for number, test in enumerate(tests):
        if len(np.unique(true[fold != number])) < 2:
            fault = f"the fold that leaves out trial {test[0]} has one kind of trial to learn from"
            raise InputError("folds", fault, "needs trials with slip and without", "take fewer folds")
    selection, metrics, judged = optional("sklearn.model_selection"), optional("sklearn.metrics"), {}
    with threadpool_limits(choices.workers):
        columns = [_columns(trials.tracks(name), choices.motion) for name in slips]
        for name, (classifier, seen) in _SEEN.items():
            estimator, values = CLASSIFIERS[classifier].make(seed), np.stack([column[seen] for column in columns])
            split = selection.PredefinedSplit(fold)
            chances = selection.cross_val_predict(estimator, values, true, cv=split, method="predict_proba")
            judged[name] = _verdicts(true, chances[:, 1])
    judged[SHIPS] = _verdicts(true, np.array([column["ships"][0] for column in columns]))
    rows = [
        (name, *_shares(true, entry.slip > 0.5, seed), float(metrics.roc_auc_score(true, entry.slip)))
        for name, entry in judged.items()
    ]
    names = ("classifier", "accuracy", "slip found", "false alarm", Column("area below the curve", digits=3))
    majority = max(true.mean(), 1.0 - true.mean())
    note = f"{len(true)} trials, {true.sum()} with slip; to say the commoner always is right in {majority:.3f}."
    tables = [
        table_of("Slip in whole trials, not seen", names, rows, f"{note} {INTERVALS}"),
        _trial_table(slips, judged),
    ]
    if output is not None:
        labels = dict.fromkeys(slips, Onsets(None, None))
        write_evaluation(tables, judged, labels, output, f"Evaluation: {trials.title}")
    return tables


def _verdicts(true: Flags, chances: Floats) -> Judged:
    """Return what is said of trials, whose matrix has two classes, as they have no times of slip."""
    matrix = np.bincount(2 * true + (chances > 0.5), minlength=4).reshape(2, 2)
    return Judged(matrix, chances, true, {})


def _trial_table(slips: Mapping[str, bool], judged: Mapping[str, Judged]) -> Table:
    """Return what is said of each trial."""
    chances = (entry.slip.tolist() for entry in judged.values())
    words = (SLIP_WORD if slip else NO_SLIP_WORD for slip in slips.values())
    columns = [Column(name, digits=2) for name in judged]
    note = "Probability of slip, after learning from other trials; the detector that ships says 1 or 0."
    return table_of("Trials", ("trial", SLIP, *columns), list(zip(slips, words, *chances, strict=True)), note)


def slips_of(trials: TrialSet, onsets: Mapping[str, Onsets]) -> dict[str, bool]:
    """Return whether there is slip in each trial: by its condition 'slip', else by its onsets."""
    result = {}
    for name in trials.names:
        stated = trials.conditions[name].get(SLIP)
        if stated is None and name not in onsets:
            raise InputError(f"trial {name}", "has no label", "needs a condition 'slip' or onsets")
        result[name] = onsets[name].first is not None if stated is None else stated != NO_SLIP_WORD
    if len(set(result.values())) < 2:
        word = "slip" if all(result.values()) else "no slip"
        raise InputError(str(trials.folder), f"has {word} in all trials", "needs trials with and without", "add some")
    return result


def _columns(tracks: xr.Dataset, motion: MotionSettings) -> dict[str, Floats]:
    """Return what is known of a trial: statistics of features over its frames, its length, and what ships says."""
    moved = motion_of(tracks, motion)
    frames = features_of(moved, FeatureSettings(("field",), motion)).astype(np.float64)
    statistics = [frames.mean(axis=0), frames.std(axis=0), np.quantile(frames, 0.95, axis=0), frames[-1]]
    onsets = detect_residual(tracks, ResidualSettings(rest_frames=motion.rest_frames))[-1].onsets
    ships = np.array([float(onsets.first is not None)])
    return {"field": np.concatenate(statistics), "length": moved.time[[-1]] - moved.time[[0]], "ships": ships}


def _shares(true: Flags, said: Flags, seed: int) -> list[object]:
    """Return the shares of trials that are right, of those with slip that are found, and of the others said to slip."""
    pairs = ((true == said, np.ones(len(true))), (true & said, true), (~true & said, ~true))
    return [ratio_estimate(part.astype(float), whole.astype(float), seed) for part, whole in pairs]
