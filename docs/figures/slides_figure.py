"""Draw the figure of simulated slides in docs/detection.md, and print when slip begins in them.

First: fingerslip detect simulate studies/bulens2023_dataset.yaml --output bulens2023
Then: python docs/figures/slides_figure.py bulens2023
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from fingerslip.detect.labels import Onsets
from fingerslip.detect.trials import TrialSet, open_trials
from fingerslip.report.colours import BLUE, VERMILLION
from fingerslip.report.figures.markers import ring_colours
from fingerslip.report.figures.style import add_legend, figure_grid, save_figure, with_style

HERE = Path(__file__).parent
REST = 100


def main() -> None:
    """Draw the first trial of each indentation."""
    trials = open_trials(sys.argv[1])
    first = {}
    for name in trials.names:
        first.setdefault(trials.conditions[name]["indentation"], name)
    save_figure(draw(trials, tuple(first.values())), HERE / "tactip-slides.png")
    print_onsets(trials, tuple(first))


def print_onsets(trials: TrialSet, depths: tuple[float, ...]) -> None:
    """Print the mean times of both onsets since the film began, by indentation and kind of label."""
    for depth in depths:
        names = [name for name in trials.names if trials.conditions[name]["indentation"] == depth]
        for source in ("external_markers", "contact"):
            onsets = [trials.labels(name)[source] for name in names]
            means = [
                np.mean([getattr(one, event) for one in onsets if getattr(one, event) is not None])
                for event in ("incipient", "gross")
            ]
            sys.stdout.write(f"{1e3 * depth:g} mm, {source}: {means[0]:.2f} s, {means[1]:.2f} s\n")


@with_style
def draw(trials: TrialSet, names: tuple[str, ...]):
    """Draw how far markers are from rest, inside above and outside below, a column for each trial."""
    wide, keys = len(names), {}
    labels = ("time [s]", "displacement [px]")
    figure, panels = figure_grid(2 * wide, wide, (3.0, 2.4), "The first slide of each indentation", labels, share="x")
    for column, name in enumerate(names):
        tracks, onsets = trials.tracks(name), trials.onsets()[name]
        depth = 1e3 * trials.conditions[name]["indentation"]
        for row, kind in enumerate(("internal", "external")):
            panel = panels[row * wide + column]
            own = tracks.isel(marker=np.flatnonzero(tracks["kind"].values == kind))
            keys |= draw_markers(panel, own, onsets)
            panel.set_title(f"{kind} markers, {depth:.0f} mm")
    add_legend(figure, dict(sorted(keys.items())))
    return figure


def draw_markers(panel: Axes, tracks: xr.Dataset, onsets: Onsets) -> dict:
    """Draw how far every marker that is seen at rest is from there, coloured by ring, and both onsets."""
    position = tracks["position"].values
    seen = np.isfinite(position[:REST, :, 0]).all(axis=0)
    position, rings = position[:, seen], tracks["ring"].values[seen]
    moved = np.linalg.norm(position - position[:REST].mean(axis=0), axis=2)
    colours, keys = ring_colours(np.arange(5)), {}
    for ring, line in zip(rings, moved.T, strict=True):
        (drawn,) = panel.plot(tracks["time"].values, line, color=colours[int(ring)], linewidth=0.6)
        keys["centre" if ring == 0 else f"ring {ring}"] = drawn
    for event, colour in (("incipient", BLUE), ("gross", VERMILLION)):
        keys[f"label: {event}"] = panel.axvline(getattr(onsets, event), color=colour, linewidth=1.1)
    return keys


if __name__ == "__main__":
    main()
