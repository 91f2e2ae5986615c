"""Draw the figures of docs/slip-in-pictures.md and measure its tables.

First: fingerslip validate --pouring (or what it computes in fingerslip.validation.sensor)
Then: python docs/figures/detection_figures.py [RESULTS] [section] [3d] [page]
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

import fingerslip as fs
from fingerslip.detect.classifiers import probabilities
from fingerslip.detect.evaluation.crossval import on_unseen
from fingerslip.detect.features import features_of, motion_of
from fingerslip.detect.labels import CLASSES
from fingerslip.detect.page import SlipClip, stills_figure
from fingerslip.detect.residual import ResidualSettings, detect_residual
from fingerslip.detect.samples import Sampling, benchmark_test_trials
from fingerslip.detect.simulated import trial_cameras
from fingerslip.detect.synthetic import SyntheticSensor, SyntheticSlide, film_trials, synthetic_trial
from fingerslip.detect.training import Detector, train
from fingerslip.detect.trials import TrialSet, open_trials
from fingerslip.history import phase_times, read_history
from fingerslip.marker_tracks import marker_tracks
from fingerslip.report.colours import BLUE, GREEN, GREY, VERMILLION
from fingerslip.report.figures.markers import ring_colours
from fingerslip.report.figures.style import add_legend, figure_grid, save_figure, with_style
from fingerslip.tables.table import Table
from fingerslip.validation.sensor import POURING, POURING_3D
from fingerslip.vision.cameras.camera import true_tracks
from fingerslip.vision.cameras.pixel import frames_of
from fingerslip.vision.video import open_frames

HERE = Path(__file__).parent
COLOURS = dict(zip(CLASSES, (GREY, BLUE, VERMILLION), strict=True))
SLIDE, POUR = "depth-4mm_direction-1_0_sample-01", "depth-4mm_sample-01"
# The first trial at 4 mm.
POUR_3D = "trial-0020"
GRAVITY = 9.81
LABELS = ("external_markers", "all_external_markers", "contact")


def main() -> None:
    """Draw all figures and print the tables."""
    results, parts = Path(sys.argv[1] if len(sys.argv) > 1 else "results"), sys.argv[2:] or ["section", "3d"]
    for part in parts:
        {"section": of_section, "3d": in_3d, "page": of_page}[part](results)


def of_page(results: Path) -> None:
    """Draw what the page of a clip shows first: an analytic slide, filmed."""
    sensor = SyntheticSensor(metres_per_pixel=120e-6)
    slide = synthetic_trial("slide", SyntheticSlide(3.5e-3, seed=3, travel=6e-3), sensor)
    film_trials([slide], results / "page")
    frames = open_frames(results / "page" / "slide.mkv")
    tracks = fs.track_markers(results / "page" / "slide.mkv", rest_frames=10)
    clip = SlipClip("slide.mkv", tracks, detect_residual(tracks, ResidualSettings(20)), Table("", (), ()), frames)
    save_figure(stills_figure(clip), HERE / "slip-page.png")


def in_3d(results: Path) -> None:
    """Draw the figure and print the tables of pouring in 3D."""
    slides, pours = (open_trials(results / f"{name}_trials") for name in POURING_3D)
    detector = trained(slides, "external_markers")
    figure = draw(pours, POUR_3D, detector, "plate", "Pouring in 3D, 4 mm deep")
    save_figure(figure, HERE / "slip-pouring-3d.png")
    print_transfer(slides, pours, ("external_markers", "contact"))


def of_section(results: Path) -> None:
    """Draw the figures and print the tables of the section."""
    slides, pours = (open_trials(results / f"{name}_trials") for name in POURING)
    detector = trained(slides, "external_markers")
    save_figure(
        draw(slides, SLIDE, detector, "external_markers", "A slide of the section, 4 mm deep"), HERE / "slip-slide.png"
    )
    save_figure(draw(pours, POUR, detector, "plate", "Pouring, 4 mm deep"), HERE / "slip-pouring.png")
    save_figure(draw_frames(slides, results / POURING[0] / SLIDE), HERE / "slip-frames.png")
    print_labels(slides)
    print_transfer(slides, pours, LABELS)


def trained(slides: TrialSet, labels: str) -> Detector:
    """Return the forest that validation tests, with other labels."""
    tests = benchmark_test_trials(slides.names)
    names = [name for name in slides.names if name not in tests]
    return train(slides, slides.onsets(labels), "forest", sampling=Sampling(least=0.0), names=names, workers=2)


@with_style
def draw(trials: TrialSet, name: str, detector: Detector, source: str, title: str):
    """Draw markers outside, markers inside, and what the forest says of each frame, over time."""
    tracks, onsets = trials.tracks(name), trials.labels(name)[source]
    figure, panels = figure_grid(4, 1, (8.2, 1.75), title, ("time [s]", ""), share="x")
    time, outside = tracks["time"].values, tracks["kind"].values == "external"
    moved = tracks["position"].values[:, :, 0] - tracks["position"].values[:100, :, 0].mean(axis=0)
    rings = tracks["ring"].values
    keys = lines(panels[0], time, moved[:, outside], rings[outside])
    panels[0].set_title("external markers along x [px]" + (", seen with the plate" if source != "plate" else ""))
    lines(panels[1], time, moved[:, ~outside], rings[~outside])
    panels[1].set_title("internal markers along x [px]: what the detector sees")
    lines(panels[2], time, moved[:, ~outside] - moved[:, ~outside].mean(axis=1, keepdims=True), rings[~outside])
    panels[2].set_title("the same less their mean [px]: what is not rigid")
    motion = motion_of(tracks, detector.features.motion)
    chances = probabilities(detector.estimator, features_of(motion, detector.features))
    for number, one in enumerate(CLASSES):
        (keys[f"forest: {one.replace('_', ' ')}"],) = panels[3].plot(time, chances[:, number], color=COLOURS[one])
    panels[3].set_title("probability of each class [-]")
    for axes in panels:
        for event, style in (("incipient", "--"), ("gross", "-")):
            line = axes.axvline(getattr(onsets, event), color=GREEN, linestyle=style, linewidth=1.1)
            keys[f"label: {event}"] = line
    add_legend(figure, keys)
    return figure


@with_style
def draw_frames(slides: TrialSet, run: Path):
    """Draw what the inner camera sees at five times; arrows are four times what of the motion is not common to all."""
    history, onsets = read_history(run / "history.nc"), slides.labels(SLIDE)["external_markers"]
    jump = slides.labels(SLIDE)["contact"].gross
    start = phase_times(history, "hold")[0][0]
    tracks = marker_tracks(history, ("internal",))
    camera = fs.PixelCamera(trial_cameras().internal, fs.MarkerLook(radius=0.5e-3), seed=1)
    moments = {"at rest": 1.0, "label: incipient": onsets.incipient, "label: gross": onsets.gross}
    moments |= {"before the jerk": jump - 0.3, "after the jerk": jump + 0.7}
    figure, panels = figure_grid(len(moments), 1, (8.2, 0.75), "What the inner camera sees", ("x [px]", ""))
    truth = true_tracks(camera.camera, tracks)
    rest = truth["position"].values[np.searchsorted(truth["time"].values, start + 1.0)]
    for axes, (name, moment) in zip(panels, moments.items(), strict=True):
        number = int(np.searchsorted(truth["time"].values, start + moment))
        (frame,) = frames_of(camera, tracks, start=number, stop=number + 1)
        axes.imshow(frame, cmap="gray", vmin=0, vmax=255)
        place = truth["position"].values[number]
        moved = place - rest
        apart = 4.0 * (moved - moved.mean(axis=0))
        axes.quiver(*place.T, *apart.T, angles="xy", scale_units="xy", scale=1.0, color="#E69F00", width=0.002)
        axes.set_ylim(262, 217)
        axes.set_yticks([])
        axes.grid(visible=False)
        axes.set_title(f"{name}, {moment:.1f} s: all moved by {moved[:, 0].mean():.0f} px")
    return figure


def lines(axes: Axes, time: np.ndarray, moved: np.ndarray, rings: np.ndarray) -> dict:
    """Draw a line for each marker in the colour of its ring."""
    colours, keys = ring_colours(np.arange(int(rings.max()) + 1)), {}
    for marker, ring in enumerate(rings):
        (line,) = axes.plot(time, moved[:, marker], color=colours[int(ring)], linewidth=0.9)
        keys["centre" if ring == 0 else f"ring {ring}"] = line
    return dict(sorted(keys.items()))


def print_labels(slides: TrialSet) -> None:
    """Print when each kind of label begins, by indentation."""
    depths = sorted({one["indentation"] for one in slides.conditions.values()})
    say("depth [mm]", *LABELS)
    for depth in depths:
        names = [name for name in slides.names if slides.conditions[name]["indentation"] == depth]
        cells = []
        for source in LABELS:
            found = [slides.labels(name)[source] for name in names]
            times = [[getattr(one, event) for one in found] for event in ("incipient", "gross")]
            known = [[value for value in values if value is not None] for values in times]
            cells.append(" to ".join(f"{np.median(values):.1f} ({len(values)})" for values in known))
        say(f"{1e3 * depth:g}", *cells)


def print_transfer(slides: TrialSet, pours: TrialSet, sources: tuple[str, ...]) -> None:
    """Print the scores while pouring for each kind of label that was learned from, and by rate and indentation."""
    for labels in sources:
        found = on_unseen(trained(slides, labels), pours, pours.onsets("plate"))
        for reading, one in found.scores.items():
            lead = (one.lead_of_all.value, one.lead_of_all_spread)  # early alarms counted
            numbers = (one.error.value, one.error_spread, *lead, one.gross_error.value)
            cells = ("none" if value is None else f"{value:.2f}" for value in numbers)
            say(labels, reading, one.missed, *cells, one.before_gross.value)
        if labels == sources[0]:
            by_condition(pours, found.onsets["single frames"])


def by_condition(pours: TrialSet, found: dict) -> None:
    """Print mean onset error and lead by thirds of the rate of pouring, and by indentation."""
    true = pours.onsets("plate")
    rate = {name: 1e3 * poured(one) for name, one in pours.conditions.items()}
    edges = np.quantile(list(rate.values()), [0.0, 1 / 3, 2 / 3, 1.0])
    groups = {
        f"{low:.1f} to {high:.1f} g/s": [
            name for name in pours.names if low <= rate[name] < high + 1e-9 * (high == edges[-1])
        ]
        for low, high in itertools.pairwise(edges)
    }
    for depth in (3.0, 3.5, 4.0):
        groups[f"{depth:g} mm"] = [
            n for n in pours.names if abs(1e3 * pours.conditions[n]["indentation"] - depth) < 0.01
        ]
    for label, names in groups.items():
        error = [found[name].first - true[name].incipient for name in names if found[name].first is not None]
        lead = [true[name].gross - found[name].first for name in names if found[name].first is not None]
        say(label, len(names), f"{np.mean(error):.2f}", f"{np.mean(lead):.2f}")


def poured(conditions: Mapping[str, Any]) -> float:
    """Return the rate of pouring of a trial [kg/s]: the section is filled with its mass in 40 s."""
    return conditions["load_rate"] / GRAVITY if "load_rate" in conditions else conditions["mass"] / 40.0


def say(*cells: object) -> None:
    """Print a row of a table."""
    sys.stdout.write("| " + " | ".join(map(str, cells)) + " |\n")


if __name__ == "__main__":
    main()
