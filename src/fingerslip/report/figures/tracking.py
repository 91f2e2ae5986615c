"""Figures of how good tracks are: markers in the first frame, count over time, lost intervals, noise, jumps."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingerslip.report.colours import BLUE, GREY, ORANGE, SKY, VERMILLION
from fingerslip.report.figures.style import figure_grid, say, styled
from fingerslip.vision.exposure import FINE
from fingerslip.vision.tracking.quality import jumps, lost_intervals, noise_at_rest, seen_count

__all__ = ["count_figure", "jump_figure", "noise_figure"]


@styled
def count_figure(tracks: xr.Dataset) -> Figure:
    """Draw how many markers were seen over time, and below it when each was lost."""
    labels = ("time [s]", "")
    figure, (count, lost) = figure_grid(2, 1, (6.4, 1.9), "Markers that were seen", labels, share="x")
    time, n_markers = tracks["time"].values, tracks.sizes["marker"]
    count.plot(time, seen_count(tracks), color=BLUE, linewidth=1.0, drawstyle="steps-mid")
    count.axhline(n_markers, color=GREY, linewidth=0.8, linestyle="--")
    count.set_ylim(-0.03 * n_markers, 1.06 * n_markers)
    count.set_ylabel("markers")
    _shade(count, tracks)
    _draw_lost(lost, tracks)
    return figure


def _shade(axes: Axes, tracks: xr.Dataset) -> None:
    """Mark frames that are dark, overexposed or duplicated."""
    if "frame_state" in tracks:
        odd = np.flatnonzero(tracks["frame_state"].values != FINE)
        for t in odd[:: max(len(odd) // 2000, 1)]:
            axes.axvline(float(tracks["time"][t]), color=ORANGE, linewidth=0.6, alpha=0.5, zorder=0)


def _draw_lost(axes: Axes, tracks: xr.Dataset) -> None:
    time = tracks["time"].values
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    intervals = lost_intervals(tracks)
    for one in intervals:
        colour = SKY if one.returned else VERMILLION
        axes.barh(one.marker, one.frames * step, left=time[one.first] - 0.5 * step, height=0.9, color=colour)
    axes.set_ylim(-1, tracks.sizes["marker"])
    axes.set_ylabel("marker")
    axes.set_title("Lost: found again (light), not found again (dark)" if intervals else "No marker was lost")


@styled
def noise_figure(tracks: xr.Dataset, frame: NDArray[np.uint8] | None = None) -> Figure:
    """Draw the markers where they rest, coloured by their noise there, on the first frame."""
    figure, (axes,) = figure_grid(1, 1, (6.0, 4.4), "Noise at rest", ("x [px]", "y [px]"))
    name = "image_position" if "image_position" in tracks else "position"
    rest = tracks[name].values[: max(int(tracks.attrs.get("rest_frames", 1)), 1)]
    seen_once = np.isfinite(rest).all(axis=2).any(axis=0)
    if frame is not None:
        axes.imshow(frame, cmap="gray", vmin=0, vmax=255)
    places, noise = np.nanmean(rest[:, seen_once], axis=0), noise_at_rest(tracks)[seen_once]
    drawn = axes.scatter(places[:, 0], places[:, 1], c=noise, s=46, cmap="viridis", linewidths=1.4, vmin=0.0)
    # Rings, which leave the marker visible: without a face the colour goes to the edge. The stubs lack None.
    drawn.set_facecolor("none")
    drawn.set_edgecolor(None)  # type: ignore[arg-type]
    figure.colorbar(drawn, ax=axes, label="standard deviation [px]", shrink=0.8)
    for (x, y), number in zip(places, tracks["marker"].values[seen_once], strict=True):
        axes.annotate(str(number), (x, y), xytext=(4, 4), textcoords="offset points", fontsize=5.5, color=ORANGE)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    if frame is None:
        axes.invert_yaxis()
    return figure


@styled
def jump_figure(tracks: xr.Dataset) -> Figure:
    """Draw how often markers moved by how much more than their neighbours between two frames."""
    labels = ("displacement between frames beyond the neighbours' [px]", "marker-frames")
    figure, (axes,) = figure_grid(1, 1, (6.4, 2.6), "Jumps", labels)
    found = jumps(tracks)
    found = found[np.isfinite(found)]
    if not found.size:
        say(axes, "no two frames with neighbours")
        return figure
    edges = np.linspace(0.0, max(float(found.max()), 0.1) * 1.02, 61)
    axes.hist(found, bins=list(edges), color=BLUE)
    axes.set_yscale("log")
    return figure
