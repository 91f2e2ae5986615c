"""A history to browse: the slider's time decides what is drawn."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from unit import synthetic


def test_the_time_decides_what_is_drawn() -> None:
    history = synthetic.make(synthetic.Process())
    shown = fs.plot(history)
    above, below = shown.figure.axes
    times = history["time"].values
    last = shown.at(float(times[-1]))
    assert last is shown
    assert below.lines[-1].get_xdata()[0] == times[-1]
    drawn = above.collections[0].get_offsets()
    assert np.allclose(np.asarray(drawn)[:, 1], 1e-3 * history["normal_traction"].values[-1])
    assert above.texts[0].get_text() == f"{times[-1]:.3f} s"
    assert repr(shown) == f"<HistoryPlot: {times.size} records, 0 to {times[-1]:g} s>"


def test_notebooks_get_a_slider_that_needs_no_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fingerslip.report.figures.browse._FRAMES", 3)
    page = fs.plot(synthetic.make(synthetic.Process()))._repr_html_()
    assert 'type="range"' in page
    assert page.count("data:image/png;base64") == 3


def test_a_history_without_contact_is_refused() -> None:
    history = synthetic.make(synthetic.Process()).isel(contact_node=slice(0))
    with pytest.raises(InputError, match="history: has no contact nodes"):
        fs.plot(history)
