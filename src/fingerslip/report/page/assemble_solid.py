"""The pictures that a report shows of runs in space."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch as Swatch

from fingerslip.report.figures.cut import cropped, cut_frames_figure
from fingerslip.report.figures.onset import slip_onset_figure
from fingerslip.report.figures.patch import (
    reference_nodes_figure,
    slip_frames_figure,
    stick_ratio_figure,
    surface_strain_figure,
)
from fingerslip.report.figures.style import BLACK, add_legend, figure_grid, region_colours, styled, titled
from fingerslip.report.page.page import Picture
from fingerslip.report.scene.scene import SceneOptions, region_names
from fingerslip.report.scene.viewer import still
from fingerslip.slip import Events

__all__ = ["is_solid", "solid_overview", "solid_pictures", "solid_scene"]


def is_solid(history: xr.Dataset) -> bool:
    """Tell whether a history is one in space."""
    return bool(history.sizes["component"] == len("xyz"))


def solid_overview(histories: Mapping[str, xr.Dataset]) -> list[Picture]:
    """Return the pictures that compare runs in space."""
    said = "Sticking share of the contact against tangential over normal force, during the slide."
    onset = "When each place of the contact slips for good, in seconds from the start of the slide; the plate moves "
    onset += "along the arrow. What sticks to the end is dark."
    return [
        Picture("slip-onset", onset, slip_onset_figure(histories)),
        Picture("stick-ratio", said, stick_ratio_figure(histories)),
    ]


def solid_pictures(history: xr.Dataset, events: Events, label: str) -> list[Picture]:
    """Return the pictures of one run in space.

    Parameters
    ----------
    history : xarray.Dataset
        Its history.
    events : Events
        Its slip events.
    label : str
        Its name.
    """
    pictures = [
        Picture(
            f"{label}-slip-frames",
            "Where the contact sticks and slips, seen from below; the plate moves to the right. Part of the edge slips "
            "already in the press. Events count what has slipped since the slide began.",
            slip_frames_figure(history, events, title=label),
        ),
        Picture(
            f"{label}-stick-ratio",
            "Stick ratio against the tangential force. It starts below one where the press has made the edge slip.",
            stick_ratio_figure({label: history}, title=label),
        ),
        Picture(
            f"{label}-surface-strain",
            "Green-Lagrange strain of the skin along the slide, and its rate; the plate moves to the right.",
            surface_strain_figure(history, events, title=label),
        ),
    ]
    if any(str(kind).endswith("surface") for kind in history["site_kind"].values):
        said = "Motion of the reference nodes along the slide: h1 to h7 along the finger to the tip, v1 to v7 across."
        pictures.append(Picture(f"{label}-reference-nodes", said, reference_nodes_figure(history, events, label)))
    if history.sizes.get("snapshot_time", 0):
        said = (
            "von Mises stress inside the finger, on a cut along it. The colours are scaled to the soft layers; the "
            "phalanx goes beyond them."
        )
        pictures.append(Picture(f"{label}-cut", said, cut_frames_figure(history, events, title=label)))
    return pictures


@styled
def solid_scene(history: xr.Dataset, title: str) -> Figure:
    """Return a figure of the layers, cut open, at the start; the history needs snapshots."""
    options = SceneOptions(scalar="region", cut="z", edges=True, written=False)
    figure, (axes,) = figure_grid(1, 1, (7.0, 3.4), titled("Layers and mesh at the start, cut open", title), ("", ""))
    axes.imshow(cropped([still(history, 0.0, options)])[0])
    axes.set_axis_off()
    keys: dict[str, Artist] = {
        name: Swatch(color=colour) for name, colour in region_colours(region_names(history)).items()
    }
    if history.sizes.get("site", 0):
        keys["recorded sites"] = Line2D([], [], color=BLACK, marker="o", markersize=4.0, linestyle="none")
    add_legend(figure, keys)
    return figure
