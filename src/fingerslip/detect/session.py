"""What the command line asks for: data sets, detectors, and evaluations as tables."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from threadpoolctl import threadpool_limits

from fingerslip.detect.classifiers import CLASSIFIERS, Candidate
from fingerslip.detect.evaluation.crossval import READINGS, Evaluation, FoldFrames, Unseen, begin_evaluation, on_unseen
from fingerslip.detect.evaluation.scores import (
    accuracy_table,
    event_scores_of,
    event_table,
    frame_scores_of,
    frame_tables,
    reliability_of,
    rest_ends,
    score_submission,
    table_of,
)
from fingerslip.detect.features import MotionSettings, markers_of
from fingerslip.detect.folders import TRACK_FILES, origin_of
from fingerslip.detect.labels import Onsets, read_onsets
from fingerslip.detect.model_file import detector_table, read_detector, write_detector
from fingerslip.detect.recordings import read_any_tracks, recorded_trials
from fingerslip.detect.samples import Sampling, benchmark_test_trials, grouped_folds, left_out
from fingerslip.detect.training import (
    TIME_ERROR,
    UNLIKE,
    Detector,
    calibration_count,
    candidate_of_name,
    check_rate_fits,
    check_tracks_fit,
    frame_rate_of,
    rate_fault,
    strange_shares,
    train,
    with_test_results,
)
from fingerslip.detect.trials import TrialSet, condition_text, open_trials, write_trials
from fingerslip.errors import InputError, shorten
from fingerslip.libraries import xr
from fingerslip.storage.files import check_replaceable, folder_beside
from fingerslip.tables.table import Table
from fingerslip.vision.video import dropped_frames, frames_text, live_frames, open_frames

if TYPE_CHECKING:
    from fingerslip.detect.live import Finding, LiveDetector
    from fingerslip.detect.residual import ResidualDetector
    from fingerslip.vision.tracking.tracker import MarkerTracker


#: Name of the detector that ships, where one is chosen.
RESIDUAL = "residual"
_EPOCH = 1e6  # no recording lasts so long [s]: times that begin later count from a date
_CALIBRATION = "Expected calibration error of the probability of slip in ten bins; Brier score over the three classes."


@dataclass(frozen=True)
class Choices:
    """What may be chosen for training and evaluation."""

    labels: str = "external_markers"  # source of the labels in the trials, or a CSV file of onset times
    rest_frames: int = 100
    window: int = 11  # frames in a velocity
    samples: str = "50,50,50,50"  # frames a trial: no slip, first and more incipient ones, gross, with commas
    seed: int = 0
    workers: int = 1
    least: float = 1.0  # share of these frames that a trial needs at least

    @property
    def motion(self) -> MotionSettings:
        """How motion is read."""
        return MotionSettings(self.rest_frames, self.window)

    @property
    def options(self) -> dict[str, int]:
        """Seed and number of cores."""
        return {"seed": self.seed, "workers": self.workers}

    @property
    def sampling(self) -> Sampling:
        """How frames are sampled."""
        words = self.samples.split(",")
        if len(words) != 4 or not all(word.strip().isdecimal() for word in words):
            raise InputError("--samples", f"got {shorten(self.samples)!r}", "needs four numbers", "write 50,50,50,50")
        no_slip, first, more, gross = map(int, words)
        return Sampling(no_slip, first, more, gross, self.least, self.seed)

    def onsets(self, trials: TrialSet) -> dict[str, Onsets]:
        """Return the labels of all trials."""
        return read_onsets(self.labels) if self.labels.endswith(".csv") else trials.onsets(self.labels)

    def train(self, trials: TrialSet, classifier: str) -> Detector:
        """Return a detector that learned from what is no test trial of the benchmark."""
        tests = set(benchmark_test_trials(trials.names, self.seed))
        names = [name for name in trials.names if name not in tests]
        choices: dict[str, Any] = {"motion": self.motion, "sampling": self.sampling, "names": names, **self.options}
        with threadpool_limits(self.workers):
            return train(trials, self.onsets(trials), classifier, **choices)


def collect_trials(
    folder: Path,
    conditions: Path,
    output: Path,
    *,
    labels: Path | None,
    title: str,
    tracking: Mapping[str, Any] | None = None,
    external_markers: int | None = None,
) -> str:
    """Write a data set of recordings and return what was done, and what is wrong with videos.

    `tracking` has options of :func:`fingerslip.vision.tracking.track.track_markers` for the inner camera; rest frames,
    channel and frame rate are those of the outer one, too.
    """
    inside = tracking or {}
    # Of the outer markers, which are numbered by rows, only the middle one counts by itself.
    outside: dict[str, Any] = {"n_markers": external_markers, "layout": "free"}
    outside |= {name: inside[name] for name in ("rest_frames", "channel", "frame_rate") if name in inside}
    onsets = {} if labels is None else read_onsets(labels)
    instead = ", in the place of those that were there" if any(output.glob("*")) else ""
    trials = recorded_trials(folder, conditions, onsets, tracking=inside, external_tracking=outside)
    result = write_trials(trials, output, title)
    complaints = [
        f"{name}: {line}"
        for name in result.names
        for line in str(result.trial(name).provenance.get("warnings", "")).splitlines()
    ]
    return "\n".join([f"{output}: {len(result.names)} trials{instead}", *complaints])


def train_detector(dataset: Path, output: Path, classifier: str, choices: Choices) -> str:
    """Train a detector on what is no test trial of the benchmark, write it, and return what was done."""
    folder = open_trials(dataset)
    tests, onsets = benchmark_test_trials(folder.names, choices.seed), choices.onsets(folder)
    with threadpool_limits(choices.workers):
        detector = choices.train(folder, classifier)
        detector = with_test_results(detector, folder, onsets, [name for name in tests if name in onsets])
    write_detector(detector, output)
    promise = "no guarantee on false alarms: too few trials"
    calibration = detector.calibration
    if calibration.trials:
        promise = f"false alarms <= {100 * calibration.share:g} % by {calibration.trials} trials"
    trials, samples = detector.provenance["trials"], detector.provenance["samples"]
    learned = f"{output}: {classifier}, {trials} trials, {samples} samples, {promise}"
    fault = _rest_fault(detector.provenance["shortest rest"], choices.rest_frames)
    return "\n".join([*filter(None, [fault]), learned, f"test trials, not seen: {', '.join(tests)}"])


def _rest_fault(shortest: int, rest_frames: int) -> str:
    """Say that markers move in the frames that are taken for rest, where the shortest rest of a trial has fewer."""
    fault = f"Warning: in a trial markers move within the {rest_frames} frames taken for rest"
    return f"{fault}; the shortest rest is {shortest}: give fewer --rest" if shortest < rest_frames else ""


def evaluate_classifiers(
    dataset: Path,
    classifiers: Sequence[str],
    choices: Choices,
    *,
    folds: int = 5,
    group: str | None = None,
    leave_out: Sequence[str] = (),
    output: Path | None = None,
) -> list[Table]:
    """Return the tables of an evaluation: frames, calibration, events, and accuracies with a condition left out.

    Trials with one value of the condition `group` are in the same fold.
    """
    trials = open_trials(dataset)
    onsets = choices.onsets(trials)
    # A clock stands beside all: who does not beat it has learned no slip.
    candidates = [candidate_of_name(name) for name in dict.fromkeys([*(classifiers or CLASSIFIERS), "time_threshold"])]
    tests = grouped_folds(trials.names, folds, choices.seed, groups_of(trials, group))
    groups = {key: left_out(trials.conditions, key) for key in leave_out}
    options: dict[str, Any] = {"output": output, **choices.options}
    run = begin_evaluation(trials, onsets, candidates, choices.motion, choices.sampling, **options)
    # What a fold lacks to learn from is told before anything is fitted.
    for test in (*tests, *(names for entry in groups.values() for names in entry.values())):
        run.rows_to_learn(test)
    frames, events = run.by_fold(candidates, tests)
    scores = {name: run.scores(pieces) for name, pieces in frames.items()}
    mixed = {entry.name: frame_scores_of(run.by_sample(entry), seed=choices.seed).accuracy for entry in candidates}
    samples, all_frames = run.samples, {name: FoldFrames.of(pieces) for name, pieces in frames.items()}
    calibration = [
        (name, *reliability_of(entry.chances, samples.classes[entry.rows])) for name, entry in all_frames.items()
    ]
    note = (
        f"{len(samples.trials)} trials, {len(samples.classes)} samples; {samples.filled} positions were not seen and "
        f"filled, {samples.unusable} frames had too few markers. {_rest_fault(samples.rest.min(), choices.rest_frames)}"
    ).rstrip()
    tables = [
        accuracy_table(scores, mixed, note),
        *frame_tables(scores),
        table_of("Calibration", ("classifier", "calibration error", "Brier score"), calibration, _CALIBRATION),
        _event_table(run, events, choices, folds),
        *(_left_out_table(run, key, group, candidates) for key, group in groups.items()),
    ]
    if output is not None:
        from fingerslip.detect.evaluation.figures import Judged, write_evaluation

        judged = {
            name: Judged(scores[name].matrix, 1.0 - entry.chances[:, 0], samples.classes[entry.rows] > 0, events[name])
            for name, entry in all_frames.items()
        }
        labels = {name: onsets[name] for name in trials.names}
        write_evaluation(tables, judged, labels, output, f"Evaluation: {trials.title}")
    run.parts.remove()
    return tables


def groups_of(trials: TrialSet, condition: str | None) -> dict[str, str] | None:
    """Return the value of a condition in each trial; none without a condition."""
    if condition is None:
        return None
    for name in trials.names:
        if condition not in trials.conditions[name]:
            raise InputError(f"trial {name}", f"has no condition {condition!r}", "needs it to be grouped by")
    return {name: str(trials.conditions[name][condition]) for name in trials.names}


def _event_table(run: Evaluation, events: Mapping[str, Mapping[str, Onsets]], choices: Choices, folds: int) -> Table:
    names = run.trials.names
    ends, frame = rest_ends(run.trials, names, choices.rest_frames)
    options: dict[str, Any] = {"frame": frame, "seed": choices.seed}
    scores = {name: event_scores_of(onsets, run.onsets, ends, **options) for name, onsets in events.items()}
    note = "Too few trials for a guaranteed threshold: slip as likely as not."
    if count := calibration_count(len(names) - len(names) // folds, 0.05):
        note = f"Thresholds from {count} other trials of each fold, for at most 5 % that raise an alarm before slip."
    return event_table(scores, note)


def _left_out_table(
    run: Evaluation, key: str, groups: Mapping[str, tuple[str, ...]], candidates: Sequence[Candidate]
) -> Table:
    """Return accuracies on the trials of each value of a condition that was not seen, and on all of them together."""
    rows = []
    for candidate in candidates:
        frames = run.by_group(candidate, list(groups.values()))
        for (value, names), piece in zip(groups.items(), frames, strict=True):
            rows.append((candidate.name, value, len(names), run.scores([piece]).accuracy))
        rows.append((candidate.name, "all", sum(map(len, groups.values())), run.scores(frames).accuracy))
    names = ("classifier", f"{key} left out", "trials", "accuracy")
    return table_of(f"Accuracy where {key} was not seen", names, rows)


def film_runs(results: Path, output: Path, title: str, seed: int) -> str:
    """Write the data set of the runs of a study of a sensor and return what was done."""
    from fingerslip.detect.simulated import film_results

    notes = "Simulated; labels and cameras as fingerslip.detect.simulated has them."
    folder = write_trials(film_results(results, seed=seed), output, title, notes)
    return f"{output}: {len(folder.names)} trials"


def score_onsets(dataset: Path, submission: Path, choices: Choices) -> Table:
    """Return the scores of a submission."""
    trials = open_trials(dataset)
    options: dict[str, Any] = {"seed": choices.seed, "rest_frames": choices.rest_frames}
    scores = score_submission(trials, submission, labels=choices.onsets(trials), **options)
    return event_table({f"{submission.name}, {scores.trials} trials": scores}, title="Benchmark")


def unseen_tables(result: Unseen) -> list[Table]:
    """Return the tables of what was found: onsets in both readings, classes and confusion of all frames."""
    warning = f"Warning: the data set {result.rate_fault}. " if result.rate_fault else ""
    warning += f"Warning: {result.unlike} trials are unlike those learned from. " if result.unlike else ""
    note = f"{warning}Single frames: the first that is more likely slip than not, without smoothing or guarantee."
    return [event_table(result.scores, note), *frame_tables({"all frames": frame_scores_of(result.matrices)})]


def judge_detector(detector: str, dataset: Path, labels: str) -> list[Table]:
    """Return the tables of what a detector finds in a data set that it did not learn from, by indentation too."""
    trials = open_trials(dataset)
    onsets = Choices(labels).onsets(trials)
    with threadpool_limits(1):
        if detector != RESIDUAL:
            trained = read_detector(detector)
            result = on_unseen(trained, trials, onsets)
            depths = {trials.conditions[name].get("indentation") for name in trials.names}
            if None in depths or len(depths) < 2:
                return unseen_tables(result)
            ends, frame = rest_ends(trials, trials.names, trained.features.motion.rest_frames)
            by_depth = {}
            for depth, names in left_out(trials.conditions, "indentation").items():
                begins = {name: result.onsets[READINGS[0]][name] for name in names}
                by_depth[condition_text("indentation", depth)] = event_scores_of(begins, onsets, ends, frame=frame)
            return [*unseen_tables(result), event_table(by_depth, title="Onset of slip by indentation")]
        from fingerslip.detect.residual import ResidualSettings, detect_residual, frames_at_rest

        tracks = {name: trials.tracks(name) for name in trials.names}
        rests = {name: frames_at_rest(entry) for name, entry in tracks.items()}
        results = {name: detect_residual(entry, ResidualSettings(rests[name])) for name, entry in tracks.items()}
    ends = {name: float(entry["time"][rests[name] - 1]) for name, entry in tracks.items()}
    scores = event_scores_of({name: findings[-1].onsets for name, findings in results.items()}, onsets, ends)
    return [event_table({"the detector that ships": scores})]


def run_detector(
    source: Path, detector: str, tracking: Mapping[str, Any], output: Path | None = None
) -> tuple[list[Table], list[str]]:
    """Run a detector on tracks or a video, write its page, and return its events, its latency and what to say."""
    trained, rest_frames = None if detector == RESIDUAL else read_detector(detector), tracking.get("rest_frames")
    output = output or folder_beside(source, "slip", lambda folder: origin_of(folder).get("source", ""))
    check_replaceable(output, "slip.csv")
    before = origin_of(output)
    if not source.exists():
        raise InputError(str(source), "is not there", "needs a video, a folder of images, or tracks (.nc, .csv)")
    # What computes and draws is slow to import.
    from fingerslip.detect.live import run_on_tracks
    from fingerslip.detect.page import SlipClip, answer_of, slide_table, write_slip_page
    from fingerslip.detect.residual import ResidualSettings, detect_residual, findings_table, frames_at_rest
    from fingerslip.vision.tracking.track import follow_video, lens_of, tracks_of

    frames, note, seconds, about = None, "Latency without the tracker. A first run compiles, too.", np.zeros(1), None
    with threadpool_limits(1):
        if source.suffix in TRACK_FILES:
            tracks = _read_to_run(source)
        else:
            frames = open_frames(source, tracking.get("frame_rate"), tracking.get("channel", "grey"))
            if trained:
                check_rate_fits(trained, frames.frame_rate, str(source))
            tracker = _tracker(trained, tracking, rest_frames or 10, frames.name)
            lens = lens_of(tracking.get("calibration"), frames)
            rows, broken = follow_video(frames, tracker)
            tracks = tracks_of(tracker, rows, frames.frame_rate, lens, broken, rest_frames=rest_frames)
            note = f"{frames_text(len(rows), frames, tracking.get('frame_rate'))}. Latency with the tracker."
            seconds = np.array([row.seconds for row in rows])
        if trained:
            if frames is None:
                check_rate_fits(trained, frame_rate_of(tracks["time"].values), str(source))
            findings: Sequence[Finding] = list(run_on_tracks(trained, tracks))
            shares = strange_shares(trained, tracks)
            about = detector_table(trained, shares)
            tracks = tracks.assign_attrs(warnings="\n".join(_warnings(tracks, trained, shares.max())))
        else:
            findings = detect_residual(tracks, ResidualSettings(rest_frames=rest_frames or frames_at_rest(tracks)))
    more = np.resize(seconds, len(findings)).tolist()
    timed = [replace(entry, seconds=entry.seconds + tracked) for entry, tracked in zip(findings, more, strict=True)]
    name = "the detector that ships" if trained is None else trained.classifier
    latency = findings_table(timed, f"{source.name} with {name}", note)
    error = trained.provenance.get(TIME_ERROR, ()) if trained else ()
    clip = SlipClip(source.name, tracks, findings, latency, frames, error, str(source.resolve()), detector, about)
    page = write_slip_page(clip, output)
    lines = [*(f"warning: {text}" for text in clip.warnings), *answer_of(clip), f"page: {page}"]
    if before:
        lines.append(f"replaced: what {before['detector']} found in {Path(before['source']).name}")
    return [slide_table(clip), latency], lines


def _read_to_run(source: Path) -> xr.Dataset:
    """Read tracks whose times count from their first frame where they are dates, with what is odd about the times."""
    tracks = read_any_tracks(source)
    said, first = [tracks.attrs.get("warnings")], float(tracks["time"].values[:1].max(initial=0.0))
    if first > _EPOCH:
        tracks = tracks.assign_coords(time=tracks["time"].copy(data=tracks["time"].values - first))
        said.append(f"{source}: its first frame is at {first:.3f} s; all times here count from it")
    if (interval := 1.0 / frame_rate_of(tracks["time"].values)) > 1.0:
        said.append(f"{source}: a frame comes every {interval:.3g} s; are its times in seconds?")
    return tracks.assign_attrs(warnings="\n".join(filter(None, said)))


def _warnings(tracks: xr.Dataset, trained: Detector, strange: float) -> Iterator[str]:
    """Yield what is wrong with tracks, and what of them a trained detector has not learned."""
    from fingerslip.vision.tracking.track import rest_length

    if tracks.attrs.get("warnings"):
        yield str(tracks.attrs["warnings"])
    rest_frames = trained.features.motion.rest_frames
    first = rest_length(markers_of(tracks, "internal")["position"].values[:rest_frames])
    if first < rest_frames:
        fault = f"the markers move from frame {first} on, and the detector takes {rest_frames} frames for rest"
        yield f"{fault}: its times mean nothing; begin the recording earlier, or train with fewer --rest"
    if fault := _strange_fault(strange):
        yield fault


def _strange_fault(share: float) -> str:
    """Say that a share of the features is beyond the range of those learned; nothing where it is small."""
    fault = f"{100 * share:.0f} % of what the detector sees is beyond the range that it learned from"
    return f"{fault}: its answer means nothing here; train it on trials like this clip" if share > UNLIKE else ""


def watch_camera(
    camera: int | str,
    detector: str,
    tracking: Mapping[str, Any],
    tell: Callable[[str], object],
) -> Table:
    """Run a detector on a camera until it ends or is interrupted; tell each event as it comes, and return latencies."""
    from fingerslip.detect.live import LiveDetector
    from fingerslip.detect.residual import findings_table

    trained = None if detector == RESIDUAL else read_detector(detector)
    tracker = _tracker(trained, tracking, tracking.get("rest_frames") or 30, f"camera {camera}")
    live: LiveDetector | ResidualDetector | None = None
    findings: list[Finding] = []
    strange = ""
    with threadpool_limits(1), contextlib.suppress(KeyboardInterrupt):
        for time, frame in live_frames(camera, tracking.get("channel", "grey")):
            for seen in tracker.take(frame, time):
                live = live or _detector_for(trained, tracker)
                new = live.take(seen)
                times = np.array([finding.time for finding in new])
                if trained and not findings and (fault := rate_fault(trained, frame_rate_of(times))):
                    tell(f"warning: camera {camera} {fault}: times of slip mean nothing")
                if isinstance(live, LiveDetector) and not strange:
                    strange = _strange_fault(live.strange_shares.max())
                    if strange:
                        tell(f"warning: {strange}")
                for finding in new:
                    for event in _new_events(findings[-1].onsets if findings else Onsets(None, None), finding):
                        tell(event)
                    findings.append(replace(finding, seconds=finding.seconds + seen.seconds))
    dropped = dropped_frames([finding.time for finding in findings])
    return findings_table(findings, f"camera {camera}", f"Latency with the tracker; {dropped} frames were dropped.")


def _tracker(trained: Detector | None, tracking: Mapping[str, Any], rest_frames: int, name: str) -> MarkerTracker:
    """Return the tracker for a detector; a trained one says itself how many frames are at rest."""
    from fingerslip.vision.tracking.tracker import MarkerTracker

    search = {option: tracking[option] for option in ("n_markers", "layout", "mask", "bright") if option in tracking}
    rest_frames = trained.features.motion.rest_frames if trained else rest_frames
    return MarkerTracker(**search, rest_frames=rest_frames, name=name)


def _detector_for(trained: Detector | None, tracker: MarkerTracker) -> LiveDetector | ResidualDetector:
    """Return what takes the markers of a tracker that has found them."""
    from fingerslip.detect.live import LiveDetector
    from fingerslip.detect.residual import ResidualDetector, ResidualSettings

    if trained is None:
        return ResidualDetector(ResidualSettings(tracker.rest_frames))
    check_tracks_fit(trained, tracker.at_rest)
    return LiveDetector(trained, tracker.reference.ring)


def _new_events(before: Onsets, finding: Finding) -> Iterator[str]:
    """Yield in words what has begun since the finding before."""
    for word, event in {"slip": "incipient", "gross slip": "gross"}.items():
        began = getattr(finding.onsets, event)
        if began is not None and getattr(before, event) is None:
            yield f"{finding.time:.3f} s: {word} since {began:.3f} s"
