"""Spikes of a history by models of one's own and of the project."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.afferents.integrate_and_fire import human_afferents
from fingerslip.afferents.model import Spikes, spikes_of
from fingerslip.afferents.signals import BandwidthWarning
from problems.pushed import push_and_slide

SITES = (
    fs.Site("SA-I-01", "SA-I", (0.0, 2e-3)),
    fs.Site("FA-I-01", "FA-I", (1e-3, 0.0), "bulk"),
    fs.Site("SA-I-02", "SA-I", (1e-3, 2e-3)),
    fs.Site("other", "", (0.0, 0.0)),
)


class Once:
    """Fires once, when the stimulus is largest."""

    stimulus, highest_frequency = "equivalent_strain", 1.0

    def spikes(self, times, values):
        return [times[[column.argmax()]] for column in values.T]


@pytest.fixture(scope="module")
def history():
    return fs.simulate(push_and_slide(record=fs.Recording(SITES)))


def test_a_model_of_ones_own_gives_a_train_for_each_receptor(history):
    found = spikes_of(history, {"SA-I": Once(), "FA-I": Once()})
    assert found.names == ("SA-I-01", "FA-I-01", "SA-I-02")
    assert found.kinds == ("SA-I", "FA-I", "SA-I")
    assert [own.size for own in found.times] == [1, 1, 1]
    table = found.to_dataframe()
    assert list(table.columns) == ["site", "kind", "time"]
    assert len(table) == 3


def test_models_of_the_project_fire_and_say_what_the_step_does_not_resolve(history):
    models = {kind: model for kind, model in human_afferents().items() if kind in {"SA-I", "FA-I"}}
    with pytest.warns(BandwidthWarning) as said:
        found = spikes_of(history, models)
    assert {str(warning.message).split(" Hz")[0] for warning in said} == {
        "the model of SA-I reaches 101",
        "the model of FA-I reaches 117",
    }
    assert all(np.all(np.diff(own) > 0.0) for own in found.times)


def test_rates_count_spikes_per_second_and_afferent():
    spikes = Spikes(("a", "b"), ("SA-I", "SA-I"), (np.array([0.05, 0.15, 0.16]), np.array([0.17])), 0.0, 0.2)
    rates = spikes.rates(0.1)
    np.testing.assert_allclose(rates.sel(kind="SA-I"), [5.0, 15.0])
    np.testing.assert_allclose(rates.time, [0.05, 0.15])


def test_an_unknown_stimulus_is_refused(history):
    model = Once()
    model.stimulus = "tickle"
    with pytest.raises(fs.InputError, match="'tickle' is not known"):
        spikes_of(history, {"SA-I": model})


def test_the_last_window_holds_what_is_left_and_a_window_has_a_length():
    spikes = Spikes(("a",), ("SA-I",), (np.array([0.05, 0.95]),), 0.0, 1.0)
    np.testing.assert_allclose(spikes.rates(0.3).sel(kind="SA-I"), [1.0 / 0.3, 0.0, 0.0, 1.0 / 0.3])
    with pytest.raises(fs.InputError, match="window: got 0 s, must be above 0 s"):
        spikes.rates(0.0)


def test_a_stimulus_that_is_not_known_gives_no_train_without_spikes(history):
    unknown = history.assign(strain=history.strain * np.nan)
    with pytest.raises(fs.ResultError, match=r"history\.equivalent_strain: is not known"):
        spikes_of(unknown, {"SA-I": Once()})
    with pytest.raises(fs.ResultError, match="has 1 values, needs two or more"):
        spikes_of(history.isel(time=[0]), {"SA-I": Once()})


def test_a_model_that_forgets_a_receptor_is_refused(history):
    model = Once()
    model.spikes = lambda times, _: [times[:1]]
    with pytest.raises(fs.InputError, match="gave 1 arrays, needs 2, one a receptor"):
        spikes_of(history, {"SA-I": model})
