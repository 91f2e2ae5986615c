"""Figures are drawn also of incomplete histories, and saved whole or not at all."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
import xarray as xr
from matplotlib.figure import Figure

from fingerslip.errors import ResultError
from fingerslip.report.figures.contact import (
    contact_displacement_figure,
    energy_figure,
    force_figure,
    force_overview_figure,
    slip_maps_figure,
)
from fingerslip.report.figures.receptors import (
    acceleration_figure,
    acceleration_overview_figure,
    strain_energy_density_figure,
)
from fingerslip.report.figures.style import figure_bytes, save_figure
from fingerslip.slip import Events
from unit.report.figures.made import APART, BARE, HISTORY, NO_SLIDE


@pytest.mark.parametrize(
    "history",
    [
        pytest.param(NO_SLIDE, id="no slide", marks=pytest.mark.slow),
        pytest.param(APART, id="no contact"),
        pytest.param(BARE, id="no receptors"),
    ],
)
def test_figures_of_incomplete_histories_are_drawn_without_a_warning(history: xr.Dataset) -> None:
    figures = (
        slip_maps_figure({"a": history}, {"a": Events()}),
        contact_displacement_figure(history, Events()),
        acceleration_figure(history, Events()),
        acceleration_overview_figure({"a": history}, {}),
        strain_energy_density_figure(history, Events()),
        force_figure(history, Events()),
        force_overview_figure({"a": history}, {}),
        energy_figure(history),
    )
    for figure in figures:
        assert figure_bytes(figure).startswith(b"\x89PNG")


def test_pictures_have_150_dots_per_inch() -> None:
    # Width and height stand in the header of a PNG file.
    assert struct.unpack(">II", figure_bytes(Figure(figsize=(2.0, 1.0)))[16:24]) == (300, 150)


@pytest.mark.parametrize(("suffix", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_figure_is_saved_whole(tmp_path: Path, suffix: str, start: bytes) -> None:
    save_figure(energy_figure(HISTORY), tmp_path / f"a.{suffix}")
    assert (tmp_path / f"a.{suffix}").read_bytes().startswith(start)
    assert [path.name for path in tmp_path.iterdir()] == [f"a.{suffix}"]


def test_text_of_figures_for_papers_stays_text() -> None:
    figure = energy_figure(HISTORY)
    pdf, svg = figure_bytes(figure, "pdf"), figure_bytes(figure, "svg").decode()
    assert b"/Type3" not in pdf
    assert b"/TrueType" in pdf or b"/CIDFontType2" in pdf
    assert ">time [s]</text>" in svg


def test_figure_that_cannot_be_saved_says_so(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="cannot be written"):
        save_figure(energy_figure(HISTORY), tmp_path / "missing" / "a.png")
