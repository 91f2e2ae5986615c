"""Figure of when each part of the contact slips for good."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.report.figures.solid import slip_onset_figure
from fingerslip.slip import slide_window
from unit.report.scenes import block_history


@pytest.fixture
def history() -> xr.Dataset:
    return block_history().load()


def with_states(history: xr.Dataset, before: int, after: int, switch: float) -> xr.Dataset:
    """Return a history whose whole contact changes its state once."""
    states = np.where(history["time"].values[:, None] < switch, before, after)
    kept = history.copy()
    kept["contact_state"] = history["contact_state"].copy(data=np.broadcast_to(states, history["contact_state"].shape))
    return kept


def triangles(figure: object) -> list[np.ndarray]:
    """Return the colours of the triangles, panel by panel."""
    return [axes.collections[0].get_facecolor() for axes in figure.axes if axes.collections and axes.get_title("left")]  # type: ignore[attr-defined]


def test_colours_count_from_the_start_of_the_slide_and_share_one_scale(history: xr.Dataset) -> None:
    window = slide_window(history)
    assert window is not None
    early, late = window.start + 0.02, window.end - 0.01
    runs = {"early": with_states(history, STICK, SLIP, early), "late": with_states(history, STICK, SLIP, late)}
    figure = slip_onset_figure(runs)
    first, second = triangles(figure)
    assert len({tuple(colour) for colour in first}) == len({tuple(colour) for colour in second}) == 1
    assert not np.array_equal(first[0], second[0])
    (scale,) = [axes for axes in figure.axes if "time into" in axes.get_ylabel()]
    assert scale.get_ylim()[1] == pytest.approx(late - window.start, abs=0.011)  # a record


def test_what_sticks_to_the_end_is_dark_and_what_never_touches_is_not_drawn(history: xr.Dataset) -> None:
    stuck, open_ = (with_states(history, state, state, 0.0) for state in (STICK, OPEN))
    figure = slip_onset_figure({"stuck": stuck, "open": open_})
    drawn = triangles(figure)
    assert np.allclose(drawn[0], drawn[0][0])
    assert drawn[0][0][:3].max() < 0.25
    assert len(drawn[1]) == 0


def test_panels_share_the_axes_of_the_plate_and_arrows_tell_the_directions_apart(history: xr.Dataset) -> None:
    turned = history.copy()
    turned["counterface_displacement"] = -history["counterface_displacement"]
    figure = slip_onset_figure({"there": history, "back": turned})
    panels = [axes for axes in figure.axes if axes.get_title("left")]
    (there,), (back,) = ([text for text in axes.texts if hasattr(text, "arrow_patch")] for axes in panels)
    direction = np.subtract(there.xy, there.xyann)
    np.testing.assert_allclose(direction, -np.subtract(back.xy, back.xyann), atol=1e-12)
    assert panels[0].get_xlim() == panels[1].get_xlim()
