"""Processor time of slip detection at the size of the published data set: 320 trials of 200 samples.

Trials are analytic ones, at 67 frames a second as filmed, with slides of 1 mm/s: no result, but the size of one.
`--trials` takes a data set that is there instead, sampled as published. `--live` measures instead how many frames of a
video of 640 x 480 px with 81 markers go through tracker and forest.
"""

import argparse
import itertools
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fingerslip.detect.classifiers import CLASSIFIERS, union_of_sets
from fingerslip.detect.evaluation.crossval import Evaluation
from fingerslip.detect.features import FeatureSettings, MotionSettings
from fingerslip.detect.live import LiveDetector
from fingerslip.detect.samples import Sampling, grouped_folds, samples_of
from fingerslip.detect.synthetic import SyntheticSensor, film_trials, synthetic_slides
from fingerslip.detect.training import train
from fingerslip.detect.trials import Trial, open_trials, write_trials
from fingerslip.vision.tracking.tracker import MarkerTracker
from fingerslip.vision.video import read_frames

SENSOR = SyntheticSensor(frame_rate=67.0, rest_frames=100)


def timed(label, work):
    """Do some work and print how long it took."""
    processor, wall = time.process_time(), time.perf_counter()
    found = work()
    spent = time.process_time() - processor
    print(f"{label:40} {spent:8.1f} s processor, {time.perf_counter() - wall:8.1f} s", flush=True)  # noqa: T201
    return found


def inside(trial):
    """Return a trial with its internal markers alone, numbered as the tracker numbers them."""
    chosen = trial.tracks.isel(marker=np.flatnonzero(trial.tracks["kind"].values == "internal"))
    return Trial(trial.name, chosen.assign_coords(marker=np.arange(chosen.sizes["marker"])), trial.labels)


def live(folder, frames):
    """Print how many frames a second of a video are tracked and classified on one core."""
    sensor = SyntheticSensor(frame_rate=67.0, rest_frames=100)
    slides = list(synthetic_slides((3e-3, 4e-3), 2, 2, sensor=sensor, travel=8e-3))
    trials = write_trials(map(inside, slides), folder / "trials", "Benchmark of speed")
    detector = train(trials, trials.onsets(), "forest", sampling=Sampling(least=0.0))
    film_trials(slides[:1], folder / "films", size=(640, 480))
    with threadpool_limits(1):
        tracker, times, taker = MarkerTracker(n_markers=81, rest_frames=100), [], None
        for number, frame in enumerate(itertools.islice(read_frames(folder / "films" / "slide-0000.mkv"), frames)):
            for seen in tracker.take(frame, number / sensor.frame_rate):
                taker = taker or LiveDetector(detector, tracker.reference.ring)
                taker.take(seen)
            times.append(time.process_time())
    # The first findings come at once, when rest is over; they hold the compilation of what is compiled.
    spent = np.diff(times)[150:]
    rate, median = len(spent) / spent.sum(), 1e3 * float(np.median(spent))
    print(f"{len(spent)} frames: {rate:.0f} frames a processor second, median {median:.1f} ms")  # noqa: T201


def analytic(folder, repeats):
    """Return analytic trials of the size of the published ones."""
    slides = synthetic_slides(repeats=repeats, sensor=SENSOR, travel=14e-3)
    return timed("trials written", lambda: write_trials(slides, folder / "trials", "Benchmark of speed"))


def measure(trials, sampling, workers):
    """Print the processor time of each part."""
    onsets, motion = trials.onsets(), MotionSettings()
    settings = FeatureSettings(union_of_sets(tuple(CLASSIFIERS.values())), motion)
    samples = timed("samples with features", lambda: samples_of(trials, onsets, settings, sampling))
    print(f"{samples.values.shape[0]} samples of {samples.values.shape[1]} features")  # noqa: T201
    run, tests = Evaluation(trials, onsets, samples, motion, workers=workers), grouped_folds(trials.names, 5, 0)

    def fit_folds(candidate):
        return [run.fit(candidate, test) for test in tests]

    def folded():
        found = [timed(f"{name}, 5 folds", partial(fit_folds, one)) for name, one in CLASSIFIERS.items()]
        return list(itertools.chain.from_iterable(found))

    results = timed("all classifiers, 5 folds", folded)
    for name, one in CLASSIFIERS.items():
        timed(f"{name}, by sample", partial(run.by_sample, one))
    timed("events of all frames, all classifiers", lambda: run.events(results))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=10, help="10 for the 320 trials of the paper")
    parser.add_argument("--trials", type=Path, metavar="FOLDER", help="a data set in their place")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--live", type=int, metavar="FRAMES", help="measure live detection on so many frames instead")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        if options.live:
            live(Path(temporary), options.live)
        elif options.trials:
            measure(open_trials(options.trials), Sampling(), options.workers)
        else:
            # Short trials have fewer frames of a class; twice the later incipient ones make up for them.
            measure(analytic(Path(temporary), options.repeats), Sampling(more_incipient=70, least=0.0), options.workers)
