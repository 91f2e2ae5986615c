"""A benchmark that anyone can enter: fixed test trials, and a file of onset times as the submission."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fingerslip.detect.evaluation.scores import EventScores, event_scores_of
from fingerslip.detect.labels import Onsets, read_onsets
from fingerslip.detect.samples import benchmark_test_trials
from fingerslip.detect.trial_set import TrialSet, check_labels
from fingerslip.errors import InputError, Mistakes

__all__ = ["check_submission", "rest_ends", "score_submission"]


def score_submission(
    trials: TrialSet,
    submission: str | Path,
    *,
    labels: Mapping[str, Onsets] | None = None,
    seed: int = 0,
    rest_frames: int = 100,
) -> EventScores:
    """Return the scores of a submission on the test trials of a data set.

    Parameters
    ----------
    trials : TrialSet
        The data set.
    submission : path
        CSV file with the columns ``trial``, ``incipient_s`` and ``gross_s``, a row for each test trial; a cell is empty
        where no such slip was found.
    labels : mapping of str to Onsets, optional
        What is true; the labels from external markers without it.
    seed : int, optional
        Seed of the split: :func:`fingerslip.detect.samples.benchmark_test_trials`.
    rest_frames : int, optional
        Frames at rest at the start of each trial.

    Raises
    ------
    InputError
        Where the file is no such table, its trials are not the test trials, or one of these has no label.
    """
    tests = benchmark_test_trials(trials.names, seed)
    onsets_submitted = check_submission(read_onsets(submission), tests, str(submission))
    true = trials.onsets() if labels is None else labels
    check_labels(true, tests, needed=())
    ends, frame = rest_ends(trials, tests, rest_frames)
    return event_scores_of(onsets_submitted, true, ends, frame=frame, seed=seed)


def check_submission(submission: Mapping[str, Onsets], tests: tuple[str, ...], where: str) -> dict[str, Onsets]:
    """Return a submission in the order of the test trials."""
    mistakes = Mistakes()
    for name in sorted(set(tests) ^ set(submission)):
        problem = f"has no row for the test trial {name}" if name in tests else f"has a row for {name}, no test trial"
        mistakes.found.append(InputError(where, problem, f"needs the {len(tests)} test trials, each once"))
    for name in sorted(set(tests) & set(submission)):
        incipient, gross = submission[name].incipient, submission[name].gross
        if incipient is not None and gross is not None and gross < incipient:
            problem = f"has gross slip of {name} at {gross:g} s, incipient slip at {incipient:g} s"
            mistakes.found.append(InputError(where, problem, "needs gross slip last", "look for swapped columns"))
    mistakes.raise_all()
    return {name: submission[name] for name in tests}


def rest_ends(trials: TrialSet, names: tuple[str, ...], rest_frames: int) -> tuple[dict[str, float], float]:
    """Return until when each trial is at rest [s], and the median time between frames [s]."""
    ends, intervals = {}, []
    for name in names:
        time = trials.tracks(name)["time"].values
        if len(time) <= rest_frames:
            raise InputError(f"trial {name}", f"has {len(time)} frames", f"needs more than the {rest_frames} at rest")
        ends[name] = float(time[rest_frames - 1])
        intervals.append(np.median(np.diff(time)))
    return ends, float(np.median(intervals))
