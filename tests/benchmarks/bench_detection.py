"""Processor time of slip detection at the size of the published data set: 320 trials of 200 samples.

Trials are analytic ones, at 67 frames a second as filmed, with slides of 1 mm/s: no result, but the size of one.
`--trials` takes a data set that is there instead, sampled as published. `--live` measures instead how many frames of a
video of 640 x 480 px with 81 markers go through tracker and forest.
"""

import itertools
import tempfile
import time
from pathlib import Path

import numpy as np
from setups import Figures, line, options_of, seconds, table
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


def inside(trial):
    """Return a trial with its internal markers alone, numbered as the tracker numbers them."""
    chosen = trial.tracks.isel(marker=np.flatnonzero(trial.tracks["kind"].values == "internal"))
    return Trial(trial.name, chosen.assign_coords(marker=np.arange(chosen.sizes["marker"])), trial.labels)


def live(folder, frames):
    """Print how many frames a second of a video are tracked and classified on one core."""
    slides = list(synthetic_slides((3e-3, 4e-3), 2, 2, sensor=SENSOR, travel=8e-3))
    trials = write_trials(map(inside, slides), folder / "trials", "Benchmark of speed")
    detector = train(trials, trials.onsets(), "forest", sampling=Sampling(least=0.0))
    film_trials(slides[:1], folder / "films", size=(640, 480))
    with threadpool_limits(1):
        tracker, times, taker = MarkerTracker(n_markers=81, rest_frames=100), [], None
        for number, frame in enumerate(itertools.islice(read_frames(folder / "films" / "slide-0000.mkv"), frames)):
            for seen in tracker.take(frame, number / SENSOR.frame_rate):
                taker = taker or LiveDetector(detector, tracker.reference.ring)
                taker.take(seen)
            times.append(time.process_time())
    # The first findings come at once, when rest is over; they hold the compilation of what is compiled.
    spent = np.diff(times)[150:]
    table("frames", "frames a CPU second", "median [CPU ms]")
    line(len(spent), float(len(spent) / spent.sum()), 1e3 * float(np.median(spent)))


def measure(folder, trials, workers):
    """Print the seconds of each part, of a data set or else of analytic trials of the size of the published ones."""
    figures, sampling = Figures(), Sampling()
    if trials is None:
        slides = synthetic_slides(repeats=10, sensor=SENSOR, travel=14e-3)
        with seconds(figures, "trials written"):
            trials = write_trials(slides, folder / "trials", "Benchmark of speed")
        # Short trials have fewer frames of a class; twice the later incipient ones make up for them.
        sampling = Sampling(more_incipient=70, least=0.0)
    onsets, motion = trials.onsets(), MotionSettings()
    with seconds(figures, "samples with features"):
        settings = FeatureSettings(union_of_sets(tuple(CLASSIFIERS.values())), motion)
        samples = samples_of(trials, onsets, settings, sampling)
    run, tests = Evaluation(trials, onsets, samples, motion, workers=workers), grouped_folds(trials.names, 5, 0)
    results = []
    for name, classifier in CLASSIFIERS.items():
        with seconds(figures, f"{name}, 5 folds"):
            results += [run.fit(classifier, test) for test in tests]
        with seconds(figures, f"{name}, by sample"):
            run.by_sample(classifier)
    with seconds(figures, "events of all frames, all classifiers"):
        run.events(results)
    table(f"{samples.values.shape[0]} samples of {samples.values.shape[1]} features", "CPU [s]", "clock [s]")
    for name in (each for each in figures if not each.endswith(", clock")):
        line(name, figures[name], figures[f"{name}, clock"])


if __name__ == "__main__":
    parser = options_of(__doc__)
    parser.add_argument("--trials", type=Path, metavar="FOLDER", help="a data set in their place")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--live", type=int, metavar="FRAMES", help="measure live detection on so many frames instead")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        if options.live:
            live(Path(temporary), options.live)
        else:
            measure(Path(temporary), options.trials and open_trials(options.trials), options.workers)
