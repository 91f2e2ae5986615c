"""Spikes step by step, beside those of whole arrays; and the detector that counts them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fingerslip.afferents.model import AFFERENTS, spikes_of
from fingerslip.afferents.signals import BandwidthWarning
from fingerslip.errors import InputError
from fingerslip.model.model import Model, Recording
from fingerslip.react.detectors import SpikeCount
from fingerslip.react.loads import RampLoad
from fingerslip.react.loop import Grasp
from fingerslip.react.scenario import HeldObject
from fingerslip.react.spikes import SpikeStream
from fingerslip.sites import Site
from unit.pads import pad

KINDS = AFFERENTS.names
STEP = 1e-3


def stimuli(model_name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times (n,) and three stimuli (n, 3) that rise, shake and rest, strong enough for a type of afferent."""
    model = AFFERENTS.read(model_name)
    times = np.arange(0.0, 0.3, STEP)
    size = model.least_steady or 0.05 * (model.least_rate or 0.0)
    rising = np.clip(times - 0.05, 0.0, 0.1) / 0.1
    shaking = np.sin(2 * np.pi * 30 * times) * (times > 0.1)
    return times, size * np.stack([4.0 * rising, 3.0 * rising + 2.0 * shaking, 0.1 * rising], axis=1)


@pytest.mark.parametrize("name", KINDS)
def test_spikes_step_by_step_are_those_of_whole_arrays(name: str) -> None:
    model, (times, values) = AFFERENTS.read(name), stimuli(name)
    whole = np.sort(np.concatenate(model.spikes(times, values)))
    stream = SpikeStream(model, times[0], values[0])
    pairs = zip(times[1:], values[1:], strict=True)
    arrivals = np.array([spike for time, row in pairs for spike in stream.advance(time, row)])
    assert whole.size > 10
    assert np.all(np.diff(arrivals) >= 0.0)
    # Substeps are a little shorter or longer there, which moves single spikes.
    counts = [np.searchsorted(spikes, np.arange(0.0, 0.31, 1e-3)) for spikes in (arrivals, whole)]
    assert np.abs(counts[0] - counts[1]).max() <= 1 + 0.02 * whole.size


def holder() -> Model:
    sites = tuple(Site(f"FA-I-{number}", "FA-I", (x, 1e-3)) for number, x in enumerate((-4e-3, 0.0, 4e-3)))
    return replace(pad(), record=Recording(sites=sites))


HELD = HeldObject(load=RampLoad(rate=30.0, force=2.0), margin=0.3, settle=0.15, rest=0.02, after=0.1, step=0.4e-3)


def test_alarm_comes_with_the_spike_that_fills_the_window() -> None:
    detectors = {"few": SpikeCount(count=2), "more": SpikeCount(count=4), "many": SpikeCount(count=10_000)}
    with Grasp(HELD, holder(), detectors) as grasp:
        alarms = grasp.open_loop.alarms
        history = grasp.history(None)
    few, more = alarms["few"], alarms["more"]
    assert few is not None
    assert more is not None
    assert 0.0 < few.time <= more.time
    assert alarms["many"] is None
    # From rest at the start of the load on, as the detector begins.
    since = history.isel(time=slice(round(HELD.begins / HELD.step), None))
    spikes = np.sort(np.concatenate(spikes_of(since, {"FA-I": AFFERENTS.read("fa-i")}).times)) - HELD.begins
    window = SpikeCount().window
    first = next(last for start, last in zip(spikes, spikes[3:], strict=False) if last - start <= window)
    assert more.time == pytest.approx(first, abs=3.0 * HELD.step)


def test_detector_without_its_receptors_is_refused() -> None:
    with pytest.raises(InputError) as caught:
        Grasp(HELD, pad(), {"touch": SpikeCount(kind="SA-I")})
    assert str(caught.value) == (
        "detectors.touch: needs sites of the kind SA-I, the holder has none; "
        "write holder_of(..., groups=['SA-I']), or record.sites in a study"
    )


def test_steps_that_are_too_long_for_the_afferents_are_warned_of() -> None:
    held = HeldObject(load=RampLoad(rate=30.0, force=2.0), margin=0.3, settle=0.15, rest=0.02, after=0.1, step=4e-3)
    with Grasp(held, holder(), {"few": SpikeCount(count=2)}) as grasp, pytest.warns(BandwidthWarning, match="0.0004 s"):
        assert grasp.open_loop.times.size > 1
