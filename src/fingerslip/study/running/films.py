"""Films of finished runs with the cameras of their study: video, truth, tracks, and how far these are apart.

A camera's folder ``cameras/KIND`` in that of a run holds ``truth.nc``, ``errors.json`` and ``tracks/``, as
``fingerslip track`` writes it; of a pixel camera also ``video.avi``.
"""

from __future__ import annotations

import dataclasses
import warnings
from pathlib import Path

import numpy as np

from fingerslip.errors import FingerslipError
from fingerslip.history import read_history
from fingerslip.libraries import xr
from fingerslip.marker_tracks import filmed_tracks
from fingerslip.parameters import as_mapping
from fingerslip.report.page.sensor import write_tracking
from fingerslip.results import HISTORY
from fingerslip.storage.files import digest, holds, new_folder, write_json
from fingerslip.study.definition.runs import Plan
from fingerslip.study.definition.settings import CameraSettings
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.storage.reporting import CAMERAS, ERRORS
from fingerslip.vision.cameras import pixel
from fingerslip.vision.cameras.camera import Camera, true_tracks
from fingerslip.vision.cameras.point import PointCamera, point_tracks
from fingerslip.vision.comparison import TrackErrors, matched_tracks, track_errors
from fingerslip.vision.tracking.track import TrackingWarning, track_markers
from fingerslip.vision.tracks import write_tracks, write_tracks_csv
from fingerslip.vision.video import open_frames

_FORMAT = 1
_LOOKS = {"bright": pixel.BRIGHT_ON_DARK, "dark": pixel.DARK_ON_BRIGHT, "moulded": pixel.MOULDED}
_LIGHTS = {"even": pixel.Lighting(), "harsh": pixel.HARSH_LIGHT, "lamps": pixel.LAMPS}


def film_runs(plan: Plan, progress: StudyProgress) -> dict[str, FingerslipError]:
    """Film the finished runs of a study with its cameras, but for what is filmed already."""
    errors: dict[str, FingerslipError] = {}
    for name, result in plan.finished_runs().items():
        for kind, settings in plan.study.cameras.items():
            folder, key = plan.folder / name / CAMERAS / kind, digest([_FORMAT, result.identity, as_mapping(settings)])
            if holds(folder / ERRORS, "key", key):
                continue
            try:
                filmed = film_history(read_history(plan.folder / name / HISTORY), kind, settings, folder, key)
            except FingerslipError as error:
                errors[f"{name}/{CAMERAS}/{kind}"] = error
            else:
                rms = "nothing found" if filmed.rms is None else f"error {filmed.rms:.3f} px rms"
                share = f"{100 * filmed.kept:.2f} % of the positions within 1 px"
                counts = f"{filmed.markers} markers in {filmed.frames} frames"
                said = f"{counts}, {rms}, {share}, {filmed.swapped} swapped"
                progress.say(f"{plan.source.stem}/{name}: {kind} camera: {said}")
    return errors


def film_history(history: xr.Dataset, kind: str, settings: CameraSettings, folder: Path, key: str = "") -> TrackErrors:
    """Film the markers of a history, track them, compare them with the truth, and write the folder of the camera."""
    markers = filmed_tracks(history, kind, settings.rest)
    camera = camera_of(settings, kind, markers)
    # Without its parents a new folder cannot take its name.
    folder.parent.mkdir(parents=True, exist_ok=True)
    with new_folder(folder) as partial:
        truth = true_tracks(camera, markers)
        if settings.tier == "pixel":
            tracks = _pixels(settings, camera, markers, truth, partial)
        else:  # positions with the errors of the tracker, without frames
            tracks = point_tracks(PointCamera(camera, seed=settings.seed), markers)
            (partial / "tracks").mkdir()
            write_tracks(tracks, partial / "tracks" / "tracks.nc")
            write_tracks_csv(tracks, partial / "tracks" / "tracks.csv")
        write_tracks(tracks, partial / "tracks" / "matched.nc")
        errors = track_errors(tracks, truth)
        write_tracks(truth, partial / "truth.nc")
        write_json(partial / ERRORS, {"key": key, "camera": as_mapping(settings), **dataclasses.asdict(errors)})
    return errors


def camera_of(settings: CameraSettings, kind: str, markers: xr.Dataset) -> Camera:
    """Return the camera of settings, aimed at markers [m] where they rest."""
    options = {name: getattr(settings, name) for name in ("lens", "frame_rate", "exposure")}
    return settings.camera(kind, markers["position"].values[0, :, 1], **options)


def _pixels(
    settings: CameraSettings, camera: Camera, markers: xr.Dataset, truth: xr.Dataset, folder: Path
) -> xr.Dataset:
    """Write the video and its tracks; return the tracks in the order of the truth."""
    look = dataclasses.replace(_LOOKS[settings.markers], radius=settings.marker_radius)
    noise, light = pixel.SensorNoise(read=settings.noise), _LIGHTS[settings.light]
    pixel_camera = pixel.PixelCamera(camera, look, light, noise, settings.jpeg_quality, settings.seed)
    video = folder / "video.avi"
    pixel.film(pixel_camera, markers, video)
    with warnings.catch_warnings():
        # The quality page says the same.
        warnings.simplefilter("ignore", TrackingWarning)
        tracks = track_markers(
            video,
            n_markers=int(np.isfinite(truth["position"].values[0, :, 0]).sum()),
            rest_frames=max(1, round(settings.rest * settings.frame_rate)),
            layout="free",
            bright=settings.markers != "dark",
        )
    tracks = tracks.assign_attrs(source=video.name)
    write_tracking(tracks, open_frames(video), folder / "tracks")
    return matched_tracks(tracks, truth)
