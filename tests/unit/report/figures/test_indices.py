"""The figure of sensitivities: a pair of bars for each value, the largest on top."""

from __future__ import annotations

import pytest

from fingerslip.report.figures.samples import indices_figure
from unit.report.figures.made import panels, words
from unit.report.tables.test_indices import one


@pytest.mark.parametrize(
    ("method", "keys", "axis"),
    [
        ("sobol", {"total", "first order"}, "Sobol index [-]"),
        ("morris", {"mean size", "standard deviation"}, "elementary effect [s]"),
    ],
)
def test_bars_are_the_numbers(method: str, keys: set[str], axis: str) -> None:
    figure = indices_figure([one(method)])
    (axes,) = panels(figure)
    assert [bar.get_width() for bar in axes.patches] == [0.3, 0.6, 0.2, 0.5]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["press depth", "friction coefficient"]
    assert keys <= words(figure)
    assert axes.get_xlabel() == axis


def test_groups_have_panels() -> None:
    groups = [one("sobol", group={"fingertip.phalanx.variant": name}) for name in ("original", "scaled")]
    titles = [axes.get_title(loc="left") for axes in panels(indices_figure(groups))]
    assert titles == ["phalanx original", "phalanx scaled"]
