"""Saving a figure, and rendering one as bytes."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from fingerslip.files import write_bytes

__all__ = ["figure_bytes", "save_figure"]

_DOTS_PER_INCH = 150
# Text that can be searched and edited: whole fonts, which journals ask for, and words instead of outlines.
_TEXT: Any = {"pdf.fonttype": 42, "svg.fonttype": "none"}


def figure_bytes(figure: Figure, kind: str = "png") -> bytes:
    """Render a figure."""
    stream = io.BytesIO()
    if kind == "png":
        _write_png(figure, stream)
    else:
        with mpl.rc_context(_TEXT):
            figure.savefig(stream, format=kind, dpi=_DOTS_PER_INCH)
    return stream.getvalue()


def _write_png(figure: Figure, stream: io.BytesIO) -> None:
    """Draw a figure once: ``savefig`` draws it twice, the first time only to find its layout."""
    write: Any = FigureCanvasAgg(figure).print_png
    figure.set_dpi(_DOTS_PER_INCH)
    # A report renders dozens of figures: time counts more than the last kilobytes.
    write(stream, pil_kwargs={"compress_level": 2})


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
