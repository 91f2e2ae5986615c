"""Deformed sections in small multiples."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from fingerslip.errors import ResultError
from fingerslip.report.figures.deformed import deformed_frames_figure, has_frames
from fingerslip.slip import Events, SlipEvents
from unit.report.figures.made import panels
from unit.report.scenes import block_history
from unit.synthetic import Process, make

HISTORY = block_history("Q4")


def test_panels_are_the_start_of_the_slide_and_the_events() -> None:
    events = Events(slip=SlipEvents(incipient=0.06, noticed=0.07, overall=0.1))
    drawn = [axes for axes in panels(deformed_frames_figure(HISTORY, events)) if axes.get_title(loc="left")]
    titles = [" ".join(axes.get_title(loc="left").split()) for axes in drawn]
    assert titles == ["0.050 s, start of slide, 10 ms before incipient", "0.100 s, overall"]
    cells = next(item for item in drawn[-1].collections if isinstance(item, PolyCollection))
    assert len(cells.get_paths()) == HISTORY.sizes["cell"]


@pytest.mark.parametrize("scalar", ["region", "displacement", "strain_energy_density"])
def test_other_fields_and_times_can_be_chosen(scalar: str) -> None:
    figure = deformed_frames_figure(HISTORY, scalar=scalar, times=[0.0, 0.1])
    titled = [axes for axes in panels(figure) if axes.get_title(loc="left")]
    assert len(titled) == 2
    corners = np.array([titled[0].get_xlim(), titled[0].get_ylim()])
    assert (corners[:, 1] - corners[:, 0] > 10.0).all(), "the whole body is framed, in millimetres"


def test_a_history_without_a_section_is_refused() -> None:
    assert not has_frames(make(Process()))
    with pytest.raises(ResultError, match="needs two dimensions and record"):
        deformed_frames_figure(block_history("T4"))
