"""Processor time of slip detection at the size of the published data set: 320 trials of 200 samples.

Trials are analytic ones, at 67 frames a second as filmed, with slides of 1 mm/s: no result, but the size of one.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from fingerslip.detect.classifiers import CLASSIFIERS, union_of_sets
from fingerslip.detect.evaluation.crossval import events_by_trial, frames_by_sample, frames_by_trial
from fingerslip.detect.features import FeatureSettings
from fingerslip.detect.motion import MotionSettings
from fingerslip.detect.samples import Sampling, samples_of
from fingerslip.detect.splits import grouped_folds
from fingerslip.detect.synthetic import SyntheticSensor, synthetic_slides
from fingerslip.detect.trial_set import write_trials

SENSOR = SyntheticSensor(frame_rate=67.0, rest_frames=100)


def timed(label: str, work: Callable[[], Any]) -> Any:
    """Do some work and print how long it took."""
    processor, wall = time.process_time(), time.perf_counter()
    found = work()
    spent = time.process_time() - processor
    print(f"{label:40} {spent:8.1f} s processor, {time.perf_counter() - wall:8.1f} s", flush=True)  # noqa: T201
    return found


def measure(folder: Path, repeats: int, workers: int) -> None:
    """Print the processor time of each part."""
    slides = synthetic_slides(repeats=repeats, sensor=SENSOR, travel=14e-3)
    trials = timed("trials written", lambda: write_trials(slides, folder / "trials", "Benchmark of speed"))
    onsets, motion = trials.onsets(), MotionSettings()
    settings = FeatureSettings(union_of_sets(tuple(CLASSIFIERS.values())), motion)
    # Short trials have fewer frames of a class; twice the later incipient ones make up for them.
    sampling = Sampling(more_incipient=70, least=0.0)
    samples = timed("samples with features", lambda: samples_of(trials, onsets, settings, sampling))
    print(f"{samples.values.shape[0]} samples of {samples.values.shape[1]} features")  # noqa: T201
    tests, results, total = grouped_folds(trials.names, 5, 0), [], time.process_time()
    for name, one in CLASSIFIERS.items():
        folded = partial(frames_by_trial, samples, onsets, one, tests, window=motion.window, workers=workers)
        results.append(timed(f"{name}, 5 folds", folded))
        timed(f"{name}, by sample", partial(frames_by_sample, samples, one, workers=workers))
    timed("events of all frames, all classifiers", lambda: events_by_trial(trials, onsets, results, motion))
    print(f"all classifiers: {time.process_time() - total:.1f} s processor")  # noqa: T201


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=10, help="10 for the 320 trials of the paper")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        measure(Path(temporary), options.repeats, options.workers)
