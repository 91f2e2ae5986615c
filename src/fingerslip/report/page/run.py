"""The section of a report that shows one run in detail."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fingerslip.history import is_solid, sites_of_kinds
from fingerslip.report.figures.contact import energy_figure, force_figure
from fingerslip.report.figures.deformed import is_held
from fingerslip.report.figures.receptors import acceleration_figure, strain_energy_density_figure
from fingerslip.report.page.page import DrawnPicture, Picture, ReportSection
from fingerslip.report.page.pictures import PictureSet, RunPictures, RunToDraw
from fingerslip.report.page.plane import PLANE
from fingerslip.report.page.sensor import marker_pictures, place_pictures
from fingerslip.report.page.solid import SOLID
from fingerslip.report.tables.runs import measures_table, peaks_table, readings_table
from fingerslip.results import RunResult
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import PeakSettings, acceleration_peaks

if TYPE_CHECKING:
    import skfem
    import xarray as xr

__all__ = ["draw_ahead", "has_receptors", "model_pictures", "picture_set", "run_section"]


def picture_set(history: xr.Dataset) -> PictureSet:
    """Return the pictures that fit a history."""
    return SOLID if is_solid(history) else PLANE


def has_receptors(history: xr.Dataset) -> bool:
    """Tell whether a history has any mechanoreceptors."""
    return sites_of_kinds(history, RECEPTOR_KINDS).size > 0


def run_section(
    result: RunResult,
    history: xr.Dataset,
    title: str,
    settings: PeakSettings,
    drawn: tuple[DrawnPicture, ...] | None = None,
) -> ReportSection:
    """Assemble the section of one run: all readings of its events, its measures, and its pictures; folded."""
    tables = [readings_table(result), measures_table([result], ["value"])]
    if has_receptors(history):
        tables.append(peaks_table(acceleration_peaks(history, settings)))
    pictures = _pictures(RunToDraw(result.name, title, history, result.events)) if drawn is None else drawn
    return ReportSection(title, (), tuple(tables), tuple(pictures), folded=True)


def model_pictures(run: RunToDraw, mesh: skfem.Mesh) -> list[Picture]:
    """Return the pictures of the model of a run at the start."""
    return [*picture_set(run.history).model(run, mesh), *place_pictures(run)]


def draw_ahead(run: RunToDraw, mesh: skfem.Mesh | None, *, contact: bool) -> RunPictures:
    """Draw the pictures of one run before its report is made."""
    return RunPictures(
        contact=_render(_pictures(run)) if contact else None,
        model=None if mesh is None else _render(model_pictures(run, mesh)),
    )


def _render(pictures: Sequence[Picture]) -> tuple[DrawnPicture, ...]:
    return tuple(DrawnPicture(picture.name, picture.caption, picture.png) for picture in pictures)


def _pictures(run: RunToDraw) -> list[Picture]:
    receptors = _receptors(run) if has_receptors(run.history) else []
    return [*picture_set(run.history).run(run), *marker_pictures(run), _forces(run), *receptors, _energy(run)]


def _forces(run: RunToDraw) -> Picture:
    figure = force_figure(run.history, run.events, run.title)
    return Picture(f"{run.name}-forces", "Forces, their ratio, and the slipping area.", figure)


def _energy(run: RunToDraw) -> Picture:
    return Picture(f"{run.name}-energy", "Where the work of the plate goes.", energy_figure(run.history, run.title))


def _receptors(run: RunToDraw) -> list[Picture]:
    where = "at the receptors around both edges of the contact."
    density = strain_energy_density_figure(run.history, run.events, run.title)
    pictures = [Picture(f"{run.name}-strain-energy-density", f"Strain energy density {where}", density)]
    if not is_held(run.history):
        acceleration = acceleration_figure(run.history, run.events, run.title)
        said = f"Acceleration along the plate {where}"
        pictures.insert(0, Picture(f"{run.name}-acceleration", said, acceleration))
    return pictures
