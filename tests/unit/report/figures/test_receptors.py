"""Figures of what receptors record."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.afferents.model import Spikes
from fingerslip.report.figures.receptors import (
    acceleration_figure,
    acceleration_overview_figure,
    spike_figure,
    strain_energy_density_figure,
)
from fingerslip.slip import Events, SlipEvents
from unit.report.figures.made import ALL, APART, BARE, EVENTS, HISTORIES, HISTORY, NO_SLIDE, marked, panels, words
from unit.report.scenes import block_history
from unit.synthetic import PRESS_END, Process, make


def test_acceleration_has_the_four_types_on_one_scale() -> None:
    figure = acceleration_figure(HISTORY, EVENTS, "original")
    assert [axes.get_title(loc="left") for axes in panels(figure)] == ["FA-I", "SA-I", "FA-II", "SA-II"]
    assert len({axes.get_ylim() for axes in panels(figure)}) == 1
    assert all(marked(axes)[-1] == EVENTS.acceleration.overall for axes in panels(figure))
    assert {"acceleration along the plate [m/s²]", "Acceleration at the receptors: original"} <= words(figure)


def test_transition_does_not_set_the_scale() -> None:
    weak = make(Process(peaks={1.5: 0.02, 1.71: 0.1}))
    top = panels(acceleration_figure(weak))[0].get_ylim()[1]
    assert 0.05 < top < 0.15


def test_density_starts_at_zero_with_both_areas() -> None:
    figure = strain_energy_density_figure(HISTORY, EVENTS)
    assert all(axes.get_ylim()[0] == 0.0 for axes in panels(figure))
    assert "strain energy density [J/m³]" in words(figure)
    area_a, area_b = (line for line in panels(figure)[0].lines if len(line.get_xdata()) > 2)
    assert area_b.get_ydata()[-1] > area_a.get_ydata()[-1]


def test_overview_has_a_panel_for_each_run() -> None:
    figure = acceleration_overview_figure(HISTORIES, ALL)
    assert [axes.get_title(loc="left") for axes in panels(figure)] == list(HISTORIES)


def test_peaks_that_count_are_dotted() -> None:
    axes = panels(acceleration_overview_figure({"a": HISTORY}, {"a": EVENTS}))[0]
    dots = next(line for line in axes.lines if line.get_marker() == "o")
    assert list(dots.get_xdata()) == pytest.approx([1.53, 1.63, 1.71], abs=0.0051)


def test_a_high_transition_is_cut_and_says_how_high_it_was() -> None:
    weak = make(Process(step=1e-3, peaks={1.5: 0.02, 1.71: 0.1}))
    texts = [text.get_text() for text in panels(acceleration_figure(weak))[0].texts]
    assert any(text.startswith("cut, reaches ") for text in texts)
    assert not any(text.get_text().startswith("cut") for text in panels(acceleration_figure(NO_SLIDE))[0].texts)


@pytest.mark.parametrize("draw", [acceleration_figure, strain_energy_density_figure])
def test_missing_receptors_are_said_for_each_area(draw: object) -> None:
    for axes in panels(draw(BARE)):
        texts = [text.get_text() for text in axes.texts]
        assert texts[:2] == ["no receptor in area A", "no receptor in area B"]


@pytest.mark.parametrize("draw", [acceleration_figure, strain_energy_density_figure])
def test_types_that_a_run_does_not_record_have_no_panel(draw: object) -> None:
    kinds = HISTORY["site_kind"].values
    some = HISTORY.isel(site=np.flatnonzero(np.isin(kinds, ["FA-I", "SA-II"])))
    assert [axes.get_title(loc="left") for axes in panels(draw(some))] == ["FA-I", "SA-II"]


@pytest.mark.parametrize("history", [NO_SLIDE, APART, BARE], ids=["no slide", "no contact", "no receptors"])
def test_overview_without_a_signal_says_so(history: object) -> None:
    (axes,) = panels(acceleration_overview_figure({"a": history}, {"a": Events()}))
    assert [text.get_text() for text in axes.texts] == ["no slide or no receptor"]


def test_accelerations_are_marked_with_their_own_events() -> None:
    own = EVENTS.acceleration
    peaks = [PRESS_END, own.incipient, own.three_quarter, own.overall]
    assert marked(panels(acceleration_overview_figure({"a": HISTORY}, {"a": EVENTS}))[0]) == pytest.approx(peaks)


def test_overview_has_keys_for_the_events_that_happened_alone() -> None:
    def keys(events: Events) -> set[str]:
        figure = acceleration_overview_figure({"a": HISTORY}, {"a": events})
        return {text.get_text() for text in figure.legends[0].get_texts()} & {"incipient", "three-quarter", "overall"}

    assert keys(EVENTS) == {"incipient", "three-quarter", "overall"}
    assert keys(Events(acceleration=SlipEvents(overall=1.7))) == {"overall"}


def test_the_label_of_a_single_low_panel_is_wrapped() -> None:
    one = HISTORY.isel(site=np.flatnonzero(HISTORY["site_kind"].values == "FA-I"))
    assert acceleration_figure(one).get_supylabel() == "acceleration along\nthe plate [m/s²]"


TIMES = (np.array([0.1, 0.2]), np.array([0.3]), np.array([0.15, 0.35]))

SPIKES = Spikes(("a", "b", "c"), ("SA-I", "SA-I", "FA-I"), TIMES, 0.0, 0.5)


def test_every_type_has_its_raster_with_a_row_for_each_afferent_and_rates_come_last() -> None:
    slow, fast, rates = spike_figure(SPIKES, block_history()).axes
    assert [len(axes.collections) for axes in (slow, fast)] == [2, 1]
    assert slow.get_ylabel() == "SA-I\n2 afferents"
    drawn = [collection.get_positions() for collection in slow.collections]
    np.testing.assert_allclose(np.concatenate(drawn), [0.1, 0.2, 0.3])
    assert rates.get_ylabel() == "mean rate [1/s]"
