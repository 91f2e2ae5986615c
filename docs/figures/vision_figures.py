"""Draw the figures of docs/vision.md, and write its table of errors, measured on frames with known truth.

python docs/figures/vision_figures.py
"""

from __future__ import annotations

import dataclasses
import sys
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
import xarray as xr

import fingerslip as fs
from fingerslip.report.figures.markers import fields_figure, marker_tracks_figure
from fingerslip.report.figures.style import save_figure
from fingerslip.vision.cameras.pixel import DARK_ON_BRIGHT, HARSH_LIGHT, LAMPS, MOULDED, frames_of
from fingerslip.vision.cameras.point import following, window_centroids
from fingerslip.vision.overlay import field_frames, overlay_frames
from fingerslip.vision.video import opencv

FOLDER = Path(__file__).parent
CAMERA = fs.Camera(fs.pinhole_for_view(640, 480, 0.064, 0.05), fs.Pose((0.0, 0.0, 0.05), (0.0, 0.0, 0.0)))
PITCH = 4e-3
# Windows that hold a smeared marker too.
LOCATE = following(partial(window_centroids, reach=12))


def slide(seconds: float, speed: float) -> xr.Dataset:
    """Return 81 markers that slide along x at a speed [m/s]."""
    layout, times = fs.ring_layout(PITCH), np.linspace(0.0, seconds, 61)
    position = np.zeros((times.size, layout.count, 3))
    position[:, :, :2] = layout.position
    position[:, :, 0] += speed * times[:, None]
    return fs.make_tracks(position, times, units="m", ring=layout.ring, angle=layout.angle)


def press_and_slide() -> xr.Dataset:
    """Return 81 markers that spread around a spot in a second, and are then dragged around it for two."""
    layout, times = fs.ring_layout(PITCH), np.arange(91) / 30.0
    off = layout.position - (3e-3, -1.5e-3)
    near = np.exp(-0.5 * (off**2).sum(axis=1) / 8e-3**2)
    pressed, dragged = np.clip(times, 0, 1), np.clip(times - 1, 0, 2)
    position = np.zeros((times.size, layout.count, 3))
    position[:, :, :2] = layout.position + 0.15 * pressed[:, None, None] * off * near[:, None]
    position[:, :, 0] += 1.5e-3 * dragged[:, None] * near
    return fs.make_tracks(position, times, units="m", ring=layout.ring, angle=layout.angle)


def draw_frames() -> None:
    """Draw four frames: clean, with the faults of real ones, as in recordings, and dark markers with an overlay."""
    moving = press_and_slide()
    plain = fs.PixelCamera(CAMERA)
    harsh = fs.PixelCamera(CAMERA, lighting=HARSH_LIGHT, noise=fs.SensorNoise(2.0, 0.05), jpeg_quality=80)
    farther = fs.Camera(fs.pinhole_for_view(640, 480, 0.085, 0.05), CAMERA.pose)
    real = fs.PixelCamera(farther, MOULDED, LAMPS, fs.SensorNoise(1.5, 0.01), 85)
    dark = fs.PixelCamera(CAMERA, DARK_ON_BRIGHT, lighting=fs.Lighting(vignetting=0.4, gradient=0.3))
    truth = fs.true_tracks(CAMERA, moving)
    last = truth.sizes["time"] - 1
    colour = opencv().COLOR_GRAY2BGR
    frames = [opencv().cvtColor(next(frames_of(one, moving, start=last)), colour) for one in (plain, harsh, real)]
    frames.append(next(islice(overlay_frames(frames_of(dark, moving), truth), last, None)))
    together = np.vstack([np.hstack(frames[:2]), np.hstack(frames[2:])])
    half = opencv().resize(together, None, fx=0.6, fy=0.6, interpolation=opencv().INTER_AREA)
    opencv().imwrite(str(FOLDER / "vision-frames.png"), half, [opencv().IMWRITE_PNG_COMPRESSION, 9])


def draw_fields() -> None:
    """Draw tracks and fields as a point camera sees them."""
    seen = fs.point_tracks(fs.PointCamera(CAMERA), press_and_slide())
    save_figure(fields_figure(fs.marker_fields(seen, rest=1), 2.5), FOLDER / "vision-fields.png")
    save_figure(marker_tracks_figure(seen), FOLDER / "vision-tracks.png")


def draw_overlays() -> None:
    """Draw a frame with three of the fields, as overlay videos have them."""
    moving, camera = press_and_slide(), fs.PixelCamera(CAMERA)
    fields = fs.marker_fields(fs.point_tracks(fs.PointCamera(CAMERA), moving), rest=1)
    shown = [
        next(islice(field_frames(frames_of(camera, moving), fields, name), 75, None))
        for name in ("displacement", "rigid_residual", "divergence", "curl")
    ]
    together = np.vstack([np.hstack(shown[:2]), np.hstack(shown[2:])])
    half = opencv().resize(together, None, fx=0.7, fy=0.7, interpolation=opencv().INTER_AREA)
    opencv().imwrite(str(FOLDER / "vision-field-overlays.png"), half, [opencv().IMWRITE_PNG_COMPRESSION, 9])


def table() -> list[str]:
    """Return the lines of the table of errors."""
    plain = fs.PixelCamera(CAMERA)
    fine = dataclasses.replace(CAMERA, exposure=33e-3)
    cases = {
        "default": (plain, 0.3e-3),
        "no noise": (dataclasses.replace(plain, noise=fs.SensorNoise(0.0)), 0.3e-3),
        "noise of 4 grey levels": (dataclasses.replace(plain, noise=fs.SensorNoise(4.0)), 0.3e-3),
        "noise of 8 grey levels": (dataclasses.replace(plain, noise=fs.SensorNoise(8.0)), 0.3e-3),
        "contrast of 40 grey levels": (dataclasses.replace(plain, look=fs.MarkerLook(marker=80.0)), 0.3e-3),
        "markers of 0.3 mm": (dataclasses.replace(plain, look=fs.MarkerLook(radius=0.3e-3)), 0.3e-3),
        "dark on bright": (dataclasses.replace(plain, look=DARK_ON_BRIGHT), 0.3e-3),
        "JPEG of quality 60": (dataclasses.replace(plain, jpeg_quality=60), 0.3e-3),
        "background texture of 6 grey levels": (
            dataclasses.replace(plain, lighting=fs.Lighting(texture=6.0)),
            0.3e-3,
        ),
        "vignetting 0.5, gradient 0.4": (
            dataclasses.replace(plain, lighting=fs.Lighting(vignetting=0.5, gradient=0.4)),
            0.3e-3,
        ),
        "10 mm/s, exposure 33 ms (3.3 px of blur)": (dataclasses.replace(plain, camera=fine), 10e-3),
        "all of HARSH_LIGHT": (dataclasses.replace(plain, lighting=HARSH_LIGHT), 0.3e-3),
    }
    lines = ["| frames | noise [px] | bias [px] | correlation | lost |", "|---|---|---|---|---|"]
    for name, (camera, speed) in cases.items():
        found = fs.measure_errors(camera, slide(2.0 if speed < 1e-3 else 0.5, speed), LOCATE)
        share = f"{100 * found.lost:.1f} %"
        lines.append(f"| {name} | {found.noise:.4f} | {found.bias:.4f} | {found.correlation:.2f} | {share} |")
    return lines


def beside_glare() -> str:
    """Return how long errors last in bad light, and how heavy their tails are."""
    camera, moving = fs.PixelCamera(CAMERA, lighting=HARSH_LIGHT), slide(2.0, 0.3e-3)
    truth = fs.true_tracks(CAMERA, moving)["position"].values
    errors = LOCATE(frames_of(camera, moving), truth[0]) - truth
    errors = errors[:, ~np.isnan(errors).any(axis=(0, 2))]
    errors -= errors.mean(axis=0)
    shares = [float((errors[lag:] * errors[:-lag]).mean() / (errors**2).mean()) for lag in (1, 20)]
    excess = float((errors**4).mean() / (errors**2).mean() ** 2 - 3.0)
    return f"bad light: correlation {shares[0]:.2f} over 1 frame, {shares[1]:.2f} over 20, excess kurtosis {excess:.1f}"


if __name__ == "__main__":
    draw_frames()
    draw_fields()
    draw_overlays()
    sys.stdout.write("\n".join([*table(), beside_glare()]) + "\n")
