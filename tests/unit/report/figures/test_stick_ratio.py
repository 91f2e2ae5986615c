"""The figure of the stick ratio."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.report.figures.solid import stick_ratio_figure
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


def shown(figure: object) -> list[object]:
    return [axes for axes in figure.axes if axes.get_visible()]  # type: ignore[attr-defined]


def test_stick_ratio_is_drawn_over_the_slide(history: xr.Dataset) -> None:
    (axes,) = shown(stick_ratio_figure({"block": history}))
    (line,) = axes.lines
    assert line.get_label() == "block"
    assert line.get_xdata().size == 6  # records of the slide, its start included
    assert np.nanmax(line.get_xdata()) <= 0.5 * (1.0 + 1e-9)


def test_several_runs_have_a_legend(history: xr.Dataset) -> None:
    (axes,) = shown(stick_ratio_figure({"one": history, "other": history}))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["one", "other"]
