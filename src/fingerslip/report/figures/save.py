"""The figures of a study, each a function from data to a matplotlib figure, and how one is saved."""

from __future__ import annotations

import io
from pathlib import Path

from matplotlib.figure import Figure

from fingerslip.files import write_bytes
from fingerslip.report.figures.section import section_figure
from fingerslip.report.figures.signals import (
    acceleration_figure,
    acceleration_overview_figure,
    energy_figure,
    force_figure,
    force_overview_figure,
    strain_energy_density_figure,
)
from fingerslip.report.figures.slip import contact_displacement_figure, slip_maps_figure
from fingerslip.report.figures.study import event_times_figure, latency_figure

__all__ = [
    "acceleration_figure",
    "acceleration_overview_figure",
    "contact_displacement_figure",
    "energy_figure",
    "event_times_figure",
    "figure_bytes",
    "force_figure",
    "force_overview_figure",
    "latency_figure",
    "save_figure",
    "section_figure",
    "slip_maps_figure",
    "strain_energy_density_figure",
]

_DOTS_PER_INCH = 150


def figure_bytes(figure: Figure, kind: str = "png") -> bytes:
    """Render a figure.

    Parameters
    ----------
    figure : Figure
        The figure.
    kind : {'png', 'svg', 'pdf'}
        Format of the picture.
    """
    stream = io.BytesIO()
    figure.savefig(stream, format=kind, dpi=_DOTS_PER_INCH)
    return stream.getvalue()


def save_figure(figure: Figure, path: str | Path) -> None:
    """Save a figure, whole or not at all; the ending of the path says the format.

    Parameters
    ----------
    figure : Figure
        The figure.
    path : path
        A ``.png``, ``.svg`` or ``.pdf`` file.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    path = Path(path)
    write_bytes(path, figure_bytes(figure, path.suffix.removeprefix(".").lower()))
