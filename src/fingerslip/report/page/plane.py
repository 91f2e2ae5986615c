"""The pictures that a report shows of sections."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from fingerslip.report.figures.deformed import is_held
from fingerslip.report.figures.fingertip import receptor_positions, section_figure
from fingerslip.report.figures.slip import contact_displacement_figure, slip_maps_figure
from fingerslip.report.page.page import Picture
from fingerslip.report.page.pictures import PictureSet, RunToDraw
from fingerslip.slip import Events

if TYPE_CHECKING:
    import skfem
    import xarray as xr

__all__ = ["PLANE"]

_SLIP_MAP = "Where and when the surface sticks and slips."


def _model(run: RunToDraw, mesh: skfem.Mesh) -> list[Picture]:
    figure = section_figure(mesh, receptor_positions(run.history), title=run.title)
    return [Picture(f"section-{run.name}", f"Layers, elements, receptors and plate at the start: {run.title}.", figure)]


def _run(run: RunToDraw) -> list[Picture]:
    slip_map = slip_maps_figure({run.title: run.history}, {run.title: run.events})
    pictures = [Picture(f"{run.name}-slip-map", _SLIP_MAP, slip_map)]
    if not is_held(run.history):
        displacement = contact_displacement_figure(run.history, run.events, run.title)
        said = "Displacement of nodes over the contact, beside that of the plate."
        pictures.append(Picture(f"{run.name}-displacement", said, displacement))
    return pictures


def _side_by_side(histories: Mapping[str, xr.Dataset], events: Mapping[str, Events]) -> list[Picture]:
    return [Picture("slip-maps", _SLIP_MAP, slip_maps_figure(histories, events))]


#: The pictures of sections.
PLANE = PictureSet(_model, _run, _side_by_side)
