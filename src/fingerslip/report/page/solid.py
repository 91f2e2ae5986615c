"""The pictures that a report shows of runs in 3D."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch as Swatch

from fingerslip.history import site_kinds
from fingerslip.report.colours import BLACK, region_colours
from fingerslip.report.figures.contact import (
    slip_frames_figure,
    slip_onset_figure,
    stick_ratio_figure,
    surface_strain_figure,
)
from fingerslip.report.figures.solid import crop, cut_frames_figure, reference_kinds, reference_nodes_figure
from fingerslip.report.figures.style import add_legend, figure_grid, join_title, with_style
from fingerslip.report.page.page import Picture
from fingerslip.report.page.pictures import PictureSet, RunToDraw
from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.scene.scene import region_names
from fingerslip.report.scene.viewer import still
from fingerslip.slip import Events

if TYPE_CHECKING:
    import skfem
    import xarray as xr

__all__ = ["SOLID", "scene_figure"]


@with_style
def scene_figure(history: xr.Dataset, title: str) -> Figure:
    """Draw the layers, cut open, at the start."""
    options = SceneOptions(scalar="region", cut="z", edges=True, written=False)
    figure, (axes,) = figure_grid(
        1, 1, (7.0, 3.4), join_title("Layers and mesh at the start, cut open", title), ("", "")
    )
    axes.imshow(crop([still(history, 0.0, options)])[0])
    axes.set_axis_off()
    keys: dict[str, Artist] = {
        name: Swatch(color=colour) for name, colour in region_colours(region_names(history)).items()
    }
    if site_kinds(history).size:
        keys["recorded sites"] = Line2D([], [], color=BLACK, marker="o", markersize=4.0, linestyle="none")
    add_legend(figure, keys)
    return figure


def _model(run: RunToDraw, mesh: skfem.Mesh) -> list[Picture]:  # noqa: ARG001  the snapshots hold the mesh
    if not _has_snapshots(run.history):
        return []
    said = f"Layers, elements and plate at the start, cut open: {run.title}."
    return [Picture(f"scene-{run.name}", said, scene_figure(run.history, run.title))]


def _run(run: RunToDraw) -> list[Picture]:
    return [
        _slip_frames(run),
        _stick_ratio(run),
        _surface_strain(run),
        *([_reference_nodes(run)] if reference_kinds(run.history) else []),
        *([_cut(run)] if _has_snapshots(run.history) else []),
    ]


def _slip_frames(run: RunToDraw) -> Picture:
    said = (
        "Where the contact sticks and slips, seen from below; the plate moves to the right. Part of the edge slips "
        "already in the press. Events count what has slipped since the slide began."
    )
    return Picture(f"{run.name}-slip-frames", said, slip_frames_figure(run.history, run.events, title=run.title))


def _stick_ratio(run: RunToDraw) -> Picture:
    said = "Stick ratio against the tangential force. It starts below one where the press has made the edge slip."
    return Picture(f"{run.name}-stick-ratio", said, stick_ratio_figure({run.title: run.history}, title=run.title))


def _surface_strain(run: RunToDraw) -> Picture:
    said = "Green-Lagrange strain of the skin along the slide, and its rate; the plate moves to the right."
    return Picture(f"{run.name}-surface-strain", said, surface_strain_figure(run.history, run.events, title=run.title))


def _reference_nodes(run: RunToDraw) -> Picture:
    said = "Motion of the reference nodes along the slide: h1 to h7 along the finger to the tip, v1 to v7 across."
    return Picture(f"{run.name}-reference-nodes", said, reference_nodes_figure(run.history, run.events, run.title))


def _cut(run: RunToDraw) -> Picture:
    said = (
        "von Mises stress inside the finger, on a cut along it. The colours are scaled to the soft layers; the stress "
        "in the phalanx exceeds them."
    )
    return Picture(f"{run.name}-cut", said, cut_frames_figure(run.history, run.events, title=run.title))


def _side_by_side(histories: Mapping[str, xr.Dataset], events: Mapping[str, Events]) -> list[Picture]:  # noqa: ARG001
    onset = (
        "When each part of the contact slips for good, in seconds from the start of the slide; the plate moves along "
        "the arrow. What sticks to the end is dark."
    )
    ratio = "Sticking share of the contact against tangential over normal force, during the slide."
    return [
        Picture("slip-onset", onset, slip_onset_figure(histories)),
        Picture("stick-ratio", ratio, stick_ratio_figure(histories)),
    ]


def _has_snapshots(history: xr.Dataset) -> bool:
    return history.sizes.get("snapshot_time", 0) > 0


#: The pictures of runs in 3D.
SOLID = PictureSet(_model, _run, _side_by_side)
