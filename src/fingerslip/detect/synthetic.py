"""Analytic trials for tests and examples: an annulus of slip that closes on the centre, again and again.

No sensor was simulated or filmed here. The contact is a disc whose points stick to a plate until their shear reaches a
limit, largest in the centre; then each jumps ahead and sticks again. What is learned from such trials says nothing
about any sensor: they show that labels, features, classifiers and evaluation do what they claim.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fingerslip.arrays import Flags, Floats
from fingerslip.detect.labels import LabelSettings, labels_from_contact, labels_from_external_markers
from fingerslip.detect.recordings import EXTERNAL
from fingerslip.detect.trials import Trial
from fingerslip.marker_layouts import MarkerLayout, ring_layout
from fingerslip.storage.files import check_empty, csv_text, write_text, writing
from fingerslip.vision.cameras.camera import Camera, Pose
from fingerslip.vision.cameras.intrinsics import pinhole_for_view
from fingerslip.vision.cameras.pixel import MarkerLook, PixelCamera, film
from fingerslip.vision.tracks import make_tracks

#: Where the middle of the sensor is in the pictures of both cameras [px].
CENTRE = (320.0, 240.0)


@dataclass(frozen=True)
class SyntheticSensor:
    """The sensor and its cameras; all values are assumed, and a slide is faster than a real one to keep tests short."""

    internal: MarkerLayout = field(default_factory=lambda: ring_layout(2.5e-3))
    external: MarkerLayout = field(default_factory=lambda: ring_layout(2.5e-3, (1, 6, 12)))
    frame_rate: float = 30.0  # [1/s]
    rest_frames: int = 20  # before the plate moves
    metres_per_pixel: float = 60e-6  # scale of both cameras [m]
    noise: float = 0.05  # standard deviation of a marker's position [px]
    radius: float = 20e-3  # of the dome [m]


@dataclass(frozen=True)
class SyntheticSlide:
    """What happens in a trial."""

    indentation: float = 3e-3  # how deep the dome is pressed [m]
    direction: float = 0.0  # direction of the slide [rad]
    friction_coefficient: float = 0.8  # static friction coefficient
    seed: int = 0  # seed of noise and of the unevenness of friction
    travel: float = 10e-3  # length of the slide [m]
    speed: float = 1e-3  # its speed [m/s]
    repeat: int = 0  # number of the repeat


_SOURCE = "analytic example, no sensor"
#: Share of its shear that a point keeps when it slips; of its static limit that it may reach in the centre.
_KEPT, _LIMIT = 0.4, 1.2
_GAIN, _LAG = 0.8, 0.05
#: Distance of the camera [m]; it looks straight at a plane, so that it does not matter.
_DISTANCE = 50e-3


def synthetic_trial(name: str, slide: SyntheticSlide, sensor: SyntheticSensor | None = None) -> Trial:
    """Return an analytic trial with labels from its external markers and from its contact."""
    sensor = sensor or SyntheticSensor()
    draw = np.random.default_rng(slide.seed)
    frames = sensor.rest_frames + round(slide.travel / slide.speed * sensor.frame_rate)
    time = np.arange(frames) / sensor.frame_rate
    travel = np.maximum(time - (sensor.rest_frames - 1) / sensor.frame_rate, 0.0) * slide.speed
    points = np.concatenate([sensor.external.position, sensor.internal.position])
    shear, slipping, touching = _slip(points, travel, slide, sensor, draw)
    outside = sensor.external.count
    positions = np.concatenate(
        [
            _project(sensor.external.position, travel[:, None] - shear[:, :outside], slide, sensor, draw),
            _project(sensor.internal.position, -_lagging(shear[:, outside:], sensor), slide, sensor, draw),
        ],
        axis=1,
    )
    scale = {f"metres_per_pixel_{axis}": sensor.metres_per_pixel for axis in "xy"}
    tracks = make_tracks(
        positions,
        time,
        units="px",
        kind=["external"] * outside + ["internal"] * sensor.internal.count,
        ring=np.concatenate([sensor.external.ring, sensor.internal.ring]),
        angle=np.concatenate([sensor.external.angle, sensor.internal.angle]),
        attributes={"frame_rate": sensor.frame_rate, **scale, "source": _SOURCE},
    )
    labels = {
        "external_markers": labels_from_external_markers(tracks, LabelSettings(rest_frames=sensor.rest_frames)),
        "contact": labels_from_contact(time, 1.0 - slipping[:, touching].mean(axis=1)),
    }
    conditions = {**vars(slide), "task": "slide"}
    return Trial(name, tracks, labels, conditions, {"source": _SOURCE, "seed": slide.seed})


def synthetic_slides(
    indentations: Sequence[float] = (2e-3, 3e-3, 4e-3, 5e-3),
    directions: int = 8,
    repeats: int = 10,
    *,
    seed: int = 0,
    sensor: SyntheticSensor | None = None,
    **slide: float,
) -> Iterator[Trial]:
    """Yield analytic trials over depths [m], directions and repeats, of another friction and noise each."""
    draw = np.random.default_rng(seed)
    number = 0
    for depth in indentations:
        for sector in range(directions):
            for repeat in range(repeats):
                direction, friction = 2.0 * math.pi * sector / directions, round(float(draw.uniform(0.6, 1.1)), 3)
                slides = SyntheticSlide(depth, direction, friction, seed=seed + number, repeat=repeat, **slide)
                yield synthetic_trial(f"slide-{number:04d}", slides, sensor)
                number += 1


def _slip(
    points: Floats, travel: Floats, slide: SyntheticSlide, sensor: SyntheticSensor, draw: np.random.Generator
) -> tuple[Floats, Flags, Flags]:
    """Return the shear of each point over time [m], whether it has slipped since it last stuck, and if it touches."""
    contact = math.sqrt(2.0 * sensor.radius * slide.indentation)
    share = np.clip(1.0 - (np.linalg.norm(points, axis=1) / contact) ** 2, 0.0, 1.0)
    uneven = np.exp(0.08 * draw.standard_normal(len(points)))
    limit = _LIMIT * slide.friction_coefficient * slide.indentation * share * uneven
    # The points in the middle let go together: gross slip.
    middle = int(np.argmax(share))
    foot = np.zeros(len(points))
    shear, slipping = np.empty((len(travel), len(points))), np.zeros((len(travel), len(points)), dtype=bool)
    slipped = np.zeros(len(points), dtype=bool)
    for frame, gone in enumerate(travel):
        loose = gone - foot > limit
        if loose[middle]:
            loose[:] = True
            slipped[:] = False
        foot = np.where(loose, gone - _KEPT * np.minimum(limit, gone - foot), foot)
        slipped |= loose
        shear[frame], slipping[frame] = gone - foot, slipped
    return shear, slipping, share > 0


def _lagging(shear: Floats, sensor: SyntheticSensor) -> Floats:
    """Return how far internal markers follow: a share of the shear, with the lag of the gel."""
    follow = 1.0 - math.exp(-1.0 / (sensor.frame_rate * _LAG))
    lagging, state = np.empty_like(shear), np.zeros(shear.shape[1])
    for frame, wanted in enumerate(_GAIN * shear):
        state = state + follow * (wanted - state)
        lagging[frame] = state
    return lagging


def _project(
    rest: Floats, along: Floats, slide: SyntheticSlide, sensor: SyntheticSensor, draw: np.random.Generator
) -> Floats:
    """Return the positions of markers in an image [px]: y points down, noise included."""
    direction = np.array([math.cos(slide.direction), math.sin(slide.direction)])
    moved = (rest + along[:, :, None] * direction) / sensor.metres_per_pixel * np.array([1.0, -1.0])
    noisy: Floats = moved + np.array(CENTRE) + sensor.noise * draw.standard_normal(moved.shape)
    return noisy


def film_trials(trials: Iterable[Trial], folder: str | Path, *, size: tuple[int, int] = (320, 240)) -> Path:
    """Film trials as a lab does: a video of the inside and one of the skin for each, and a table of conditions.

    They are analytic trials, whose pictures of a size [px] have their middle at :data:`CENTRE`; the folder is new or
    empty. Returns the path of the table, ``conditions.csv``.
    """
    target, pose = Path(folder), Pose((0.0, 0.0, _DISTANCE), (0.0, 0.0, 0.0))
    check_empty(target)
    with writing(target):
        target.mkdir(parents=True, exist_ok=True)
    rows: list[tuple[object, ...]] = [("file", EXTERNAL, "indentation [mm]", "direction [deg]")]
    for trial in trials:
        names = f"{trial.name}.mkv", f"{trial.name}-outside.mkv"
        for kind, name in zip(("internal", "external"), names, strict=True):
            markers = trial.tracks.isel(marker=np.flatnonzero(trial.tracks["kind"].values == kind))
            scale, rate = (float(markers.attrs[key]) for key in ("metres_per_pixel_x", "frame_rate"))
            # y of pictures points down, that of the plane up.
            plane = (markers["position"].values - np.array(CENTRE)) * np.array([scale, -scale])
            space = np.concatenate([plane, np.zeros_like(plane[:, :, :1])], axis=2)
            lens = pinhole_for_view(*size, view_width=size[0] * scale, distance=_DISTANCE)
            camera = Camera(lens, pose, "internal", frame_rate=rate, exposure=0.3 / rate)
            filming = PixelCamera(camera, MarkerLook(radius=4.0 * scale), seed=1)
            film(filming, make_tracks(space, markers["time"].values, units="m"), target / name)
        conditions = trial.conditions
        rows.append((*names, 1e3 * conditions["indentation"], round(math.degrees(conditions["direction"]), 6)))
    write_text(target / "conditions.csv", csv_text(rows))
    return target / "conditions.csv"
