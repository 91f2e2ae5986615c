"""A detector at work on what is new: a video, tracks or a camera."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from threadpoolctl import threadpool_limits

from fingerslip.detect.folders import origin_of
from fingerslip.detect.labels import Onsets
from fingerslip.detect.model_file import read_detector
from fingerslip.detect.recordings import TRACK_FILES, read_any_tracks
from fingerslip.detect.training import (
    TIME_ERROR,
    Detector,
    check_rate_fits,
    check_tracks_fit,
    frame_rate_of,
    rate_fault,
)
from fingerslip.errors import InputError
from fingerslip.storage.files import check_replaceable, folder_beside
from fingerslip.tables.table import Table
from fingerslip.vision.video import dropped_frames, live_frames, open_frames

if TYPE_CHECKING:
    import xarray as xr

    from fingerslip.detect.live import Finding, LiveDetector
    from fingerslip.detect.residual import ResidualDetector
    from fingerslip.vision.tracking.tracker import MarkerTracker

#: Name of the detector that ships, where one is chosen.
RESIDUAL = "residual"


def run_detector(
    source: Path, detector: str, tracking: Mapping[str, Any], rest_frames: int | None, output: Path | None = None
) -> tuple[list[Table], list[str]]:
    """Run a detector on tracks or a video, write its page, and return its events, its latency and what to say."""
    trained = None if detector == RESIDUAL else read_detector(detector)
    output = output or folder_beside(source, "slip", lambda folder: origin_of(folder).get("source", ""))
    check_replaceable(output, "slip.csv")
    before = origin_of(output)
    if not source.exists():
        raise InputError(str(source), "is not there", "needs a video, a folder of images, or tracks (.nc, .csv)")
    # What computes and draws is slow to import.
    from fingerslip.detect.live import findings_table, run_on_tracks
    from fingerslip.detect.page import SlipClip, answer_of, slide_table, write_slip_page
    from fingerslip.detect.residual import ResidualSettings, detect_residual, frames_at_rest
    from fingerslip.vision.tracking.track import follow_video, lens_of, tracks_of

    frames, note, seconds = None, "Latency without the tracker. A first run compiles, too.", np.zeros(1)
    with threadpool_limits(1):
        if source.suffix in TRACK_FILES:
            tracks = read_any_tracks(source)
        else:
            frames = open_frames(source, tracking.get("frame_rate"), tracking.get("channel", "grey"))
            if trained:
                check_rate_fits(trained, frames.frame_rate, str(source))
            tracker = _tracker(trained, tracking, rest_frames or 10, frames.name)
            lens = lens_of(tracking.get("calibration"), frames)
            rows, broken = follow_video(frames, tracker)
            tracks, note = tracks_of(tracker, rows, frames.frame_rate, lens, broken), "Latency with the tracker."
            seconds = np.array([row.seconds for row in rows])
        if trained:
            if frames is None:
                check_rate_fits(trained, frame_rate_of(tracks["time"].values), str(source))
            tracks = tracks.assign_attrs(warnings="\n".join(_warnings(tracks, trained)))
            findings: Sequence[Finding] = list(run_on_tracks(trained, tracks))
        else:
            findings = detect_residual(tracks, ResidualSettings(rest_frames=rest_frames or frames_at_rest(tracks)))
    more = np.resize(seconds, len(findings)).tolist()
    timed = [replace(entry, seconds=entry.seconds + tracked) for entry, tracked in zip(findings, more, strict=True)]
    name = "the detector that ships" if trained is None else trained.classifier
    latency = findings_table(timed, f"{source.name} with {name}", note)
    error = trained.provenance.get(TIME_ERROR, ()) if trained else ()
    clip = SlipClip(source.name, tracks, findings, latency, frames, error, str(source.resolve()), detector)
    page = write_slip_page(clip, output)
    lines = [*(f"warning: {text}" for text in clip.warnings), *answer_of(clip), f"page: {page}"]
    if before:
        lines.append(f"replaced: what {before['detector']} found in {Path(before['source']).name}")
    return [slide_table(clip), latency], lines


def _warnings(tracks: xr.Dataset, trained: Detector) -> Iterator[str]:
    """Yield what is wrong with tracks, and with their rest for a trained detector."""
    from fingerslip.detect.residual import first_motion

    if tracks.attrs.get("warnings"):
        yield str(tracks.attrs["warnings"])
    rest_frames = trained.features.motion.rest_frames
    first = first_motion(tracks, rest_frames)
    if first is not None:
        fault = f"the markers move from frame {first} on, and the detector takes {rest_frames} frames for rest"
        yield f"{fault}: its times mean nothing; begin the recording earlier, or train with fewer --rest-frames"


def watch_camera(
    camera: int | str,
    detector: str,
    tracking: Mapping[str, Any],
    rest_frames: int | None,
    tell: Callable[[str], object],
) -> Table:
    """Run a detector on a camera until it ends or is interrupted; tell each event as it comes, and return latencies."""
    from fingerslip.detect.live import findings_table

    trained = None if detector == RESIDUAL else read_detector(detector)
    tracker = _tracker(trained, tracking, rest_frames or 30, f"camera {camera}")
    live: LiveDetector | ResidualDetector | None = None
    findings: list[Finding] = []
    with threadpool_limits(1), contextlib.suppress(KeyboardInterrupt):
        for time, frame in live_frames(camera, tracking.get("channel", "grey")):
            for seen in tracker.take(frame, time):
                live = live or _detector_for(trained, tracker)
                new = live.take(seen)
                times = np.array([finding.time for finding in new])
                if trained and not findings and (fault := rate_fault(trained, frame_rate_of(times))):
                    tell(f"warning: camera {camera} {fault}: times of slip mean nothing")
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
    return MarkerTracker(
        **search, rest_frames=trained.features.motion.rest_frames if trained else rest_frames, name=name
    )


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
