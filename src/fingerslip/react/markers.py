"""A detector that learned from marker tracks, in the loop: it sees the pins of a sensor frame by frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import xarray as xr

from fingerslip.detect.live import LiveDetector, frames_of
from fingerslip.detect.training import Detector, check_tracks_fit
from fingerslip.history import COORDINATES, VARIABLES
from fingerslip.marker_tracks import marker_tracks
from fingerslip.parameters.words import describe_fields
from fingerslip.react.moment import Alarm, Moment

_RECORDS = ("site", "site_kind", "site_position", "displacement")


@describe_fields
@dataclass(frozen=True)
class LearnedMarkers:
    """A trained detector that sees the pins of a sensor.

    It sees the run from its start, and needs its frames at rest before the load begins. An onset before the load is an
    alarm as the load begins.

    Examples
    --------
    ::

        learned = fs.LearnedMarkers(read_detector("detector"), frame_rate=120.0, delay=12e-3)
        sensor = fs.holder_of(sensor, sizes, contact=fs.Contact("contact"), groups=["internal_markers"])
        with fs.Grasp(held, sensor, {"learned": learned}) as grasp:
            outcome = grasp.react(fs.reaction("servo"), "learned")
    """

    detector: Annotated[Detector, "The detector, as :func:`fingerslip.detect.model_file.read_detector` reads it."]
    frame_rate: Annotated[float, "Frames a second of the camera [1/s]; no frame lies between two steps."] = 60.0
    event: Annotated[Literal["incipient", "gross"], "The onset that is an alarm."] = "incipient"
    delay: Annotated[float, "Time that camera, tracker and classifier take [s]."] = 0.0

    @property
    def groups(self) -> tuple[str, ...]:
        """The pins."""
        return ("internal_markers",)

    def start(self) -> _MarkerWatch:
        """Return what watches one run."""
        return _MarkerWatch(self)


class _MarkerWatch:
    """Looks at the frames of one run."""

    def __init__(self, settings: LearnedMarkers) -> None:
        self._settings = settings
        self._live: LiveDetector | None = None
        self._step, self._frames = 0, 0

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm, or None, after a step; at the first one all frames so far are looked at."""
        seen, settings = moment.observation, self._settings
        records = seen.recorder.values(self._step, seen.step + 1)
        times = np.arange(self._step, seen.step + 1) * (seen.time / max(seen.step, 1))
        values = {name: ((VARIABLES.get(name) or COORDINATES[name]).dims, records[name]) for name in _RECORDS}
        tracks = marker_tracks(xr.Dataset(values).assign_coords(time=times), ("internal",))
        self._step = seen.step + 1
        if self._live is None:
            check_tracks_fit(settings.detector, tracks)
            self._live = LiveDetector(settings.detector, tracks["ring"].values.astype(np.intp))
        alarm = None
        for frame in frames_of(tracks):
            if frame.time * settings.frame_rate < self._frames - 1e-6:
                continue
            self._frames += 1
            for finding in self._live.take(frame):
                score = finding.slip if settings.event == "incipient" else finding.gross
                if getattr(finding.onsets, settings.event) is not None:
                    alarm = alarm or Alarm(moment.time, score)
        return alarm
