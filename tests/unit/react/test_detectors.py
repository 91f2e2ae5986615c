"""Detectors: on what a step might have recorded, counting spikes step by step, and one that learned from markers."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fingerslip.afferents.model import AFFERENTS
from fingerslip.afferents.signals import BandwidthWarning
from fingerslip.afferents.spikes import spikes_of
from fingerslip.detect.features import FeatureSettings, MotionSettings, markers_of, motion_of
from fingerslip.detect.live import run_on_tracks
from fingerslip.detect.training import Detector
from fingerslip.detect.trials import layout_digest, layout_text
from fingerslip.errors import InputError
from fingerslip.marker_tracks import marker_tracks
from fingerslip.model.model import Recording
from fingerslip.react.detectors import AtOnce, ForceRatio, Never, SlippedArea, SpikeCount, StickRatio
from fingerslip.react.loads import RampLoad
from fingerslip.react.loop import Grasp
from fingerslip.react.markers import LearnedMarkers
from fingerslip.react.moment import Moment
from fingerslip.react.scenario import HeldObject
from fingerslip.react.spikes import SpikeStream
from fingerslip.sites import Site
from unit.pads import pad


def moment(**changes):
    """Return four nodes that touch and one that does not; two stick, and one has slipped by 0.1 mm."""
    recorded = {
        "contact_state": np.array([1, 1, 2, 2, 0]),
        "slip_distance": np.array([0.0, 50e-6, 120e-6, 10e-6, 9e-3]),
        "counterface_force": np.array([[-0.9, 2.0]]),
        **changes,
    }
    return Moment(0.1, recorded, np.array([1.0, 1.0, 2.0, 1.0, 5.0]), np.array([0.0, 50e-6, 20e-6, 0.0, 0.0]))


def test_shares_are_those_of_the_area_that_touches_and_zero_without_contact():
    assert moment().slipped_fraction() == pytest.approx(2 / 5)
    assert moment().slipped_fraction(5e-6) == pytest.approx(3 / 5)
    assert moment().stick_ratio == pytest.approx(2 / 5)
    assert moment().force_ratio == pytest.approx(0.45)
    apart = moment(contact_state=np.zeros(5, dtype=int), counterface_force=np.zeros((1, 2)))
    assert (apart.slipped_fraction(), apart.stick_ratio, apart.force_ratio) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("detector", "silent", "value"),
    [
        (SlippedArea(fraction=0.4), SlippedArea(fraction=0.41), 0.4),
        (StickRatio(ratio=0.4), StickRatio(ratio=0.39), 0.4),
        (ForceRatio(friction=0.5, share=0.9), ForceRatio(friction=0.5, share=0.91), 0.45),
        (AtOnce(), Never(), 1.0),
    ],
)
def test_alarm_comes_where_the_measure_reaches_its_limit(detector, silent, value):
    alarm = detector.start().take(moment())
    assert (alarm.time, alarm.value) == (0.1, pytest.approx(value))
    assert silent.start().take(moment()) is None


def stimuli(model):
    """Return times (n,) and three stimuli (n, 3) that rise, shake and rest, strong enough for a type of afferent."""
    times = np.arange(0.0, 0.3, 1e-3)
    size = model.least_steady or 0.05 * (model.least_rate or 0.0)
    rising = np.clip(times - 0.05, 0.0, 0.1) / 0.1
    shaking = np.sin(2 * np.pi * 30 * times) * (times > 0.1)
    return times, size * np.stack([4.0 * rising, 3.0 * rising + 2.0 * shaking, 0.1 * rising], axis=1)


@pytest.mark.parametrize("name", AFFERENTS.names)
def test_spikes_step_by_step_are_those_of_whole_arrays(name):
    model = AFFERENTS.read(name)
    times, values = stimuli(model)
    whole = np.sort(np.concatenate(model.spikes(times, values)))
    stream = SpikeStream(model, times[0], values[0])
    pairs = zip(times[1:], values[1:], strict=True)
    arrivals = np.array([spike for time, row in pairs for spike in stream.advance(time, row)])
    assert whole.size > 10
    assert np.all(np.diff(arrivals) >= 0.0)
    # Substeps are a little shorter or longer there, which moves single spikes.
    counts = [np.searchsorted(spikes, np.arange(0.0, 0.31, 1e-3)) for spikes in (arrivals, whole)]
    assert np.abs(counts[0] - counts[1]).max() <= 1 + 0.02 * whole.size


def held(rate, step):
    """Return an object whose load grows at a rate [N/s], at a step [s]."""
    return HeldObject(load=RampLoad(rate=rate, force=2.0), margin=0.3, settle=0.15, rest=0.02, after=0.1, step=step)


def holder(*sites):
    return replace(pad(), record=Recording(sites=sites))


SKIN = holder(*(Site(f"FA-I-{number}", "FA-I", (x, 1e-3)) for number, x in enumerate((-4e-3, 0.0, 4e-3))))


@pytest.mark.slow
def test_alarm_comes_with_the_spike_that_fills_the_window():
    detectors = {"few": SpikeCount(count=2), "more": SpikeCount(count=4), "many": SpikeCount(count=10_000)}
    with Grasp(held(30.0, 0.4e-3), SKIN, detectors) as grasp:
        alarms, history, begins = grasp.open_loop.alarms, grasp.open_loop.history, grasp.held.begins
    assert 0.0 < alarms["few"].time <= alarms["more"].time
    assert alarms["many"] is None
    # From rest at the start of the load on, as the detector begins.
    since = history.isel(time=slice(round(begins / 0.4e-3), None))
    spikes = np.sort(np.concatenate(spikes_of(since, {"FA-I": AFFERENTS.read("fa-i")}).times)) - begins
    window = SpikeCount().window
    first = next(last for start, last in zip(spikes, spikes[3:], strict=False) if last - start <= window)
    assert alarms["more"].time == pytest.approx(first, abs=3.0 * 0.4e-3)


def test_steps_that_are_too_long_for_the_afferents_are_warned_of():
    detectors = {"few": SpikeCount(count=2)}
    with Grasp(held(30.0, 4e-3), SKIN, detectors) as grasp, pytest.warns(BandwidthWarning, match="0.42 ms"):
        assert grasp.open_loop.times.size > 1


HELD = held(8.0, 2e-3)
SENSOR = holder(*(Site(f"internal-marker-0-{n:02d}", "internal marker", (1e-3 * (n - 2), 1e-3)) for n in range(5)))


@dataclass(frozen=True)
class Threshold:
    """Says slip, and gross slip, where a marker moved farther than two distances [m]."""

    slip: float
    gross: float

    def predict_proba(self, values):
        largest = np.abs(values).max(axis=1)
        slips, is_gross = largest >= self.slip, largest >= self.gross
        return np.stack([~slips, slips & ~is_gross, is_gross], axis=1).astype(float)


class AsItIs:
    """Scores of single frames."""

    def start(self):
        return np.zeros(0)

    def scores(self, state, interval, chances):  # noqa: ARG002
        return np.stack([0.5 - chances[:, 0], chances[:, 2] - 0.5], axis=1), state


@pytest.fixture(scope="module")
def detector():
    """Return a detector for which slip begins before the load does, gross slip after it."""
    with Grasp(HELD, SENSOR, {}) as grasp:
        inside = markers_of(marker_tracks(grasp.open_loop.history), "internal")
    motion = MotionSettings(rest_frames=10, window=3)
    moved = motion_of(inside.isel(time=slice(0, None, 2)), motion).displacement
    largest = np.linalg.norm(moved, axis=2).max(axis=1)
    begins = round(0.5 * HELD.begins / HELD.step)
    threshold = Threshold(0.5 * largest[begins], 0.5 * (largest[begins] + largest[-1]))
    layout = layout_digest(inside), layout_text(inside)
    return Detector("threshold", threshold, FeatureSettings(("displacement",), motion), (), *layout, AsItIs())


@pytest.mark.slow
def test_alarm_is_the_onset_that_the_detector_finds_in_the_whole_tracks(detector):
    learned = {event: LearnedMarkers(detector, 250.0, event) for event in ("incipient", "gross")}
    with Grasp(HELD, SENSOR, learned) as grasp:
        alarms, tracks = grasp.open_loop.alarms, marker_tracks(grasp.history(None)).isel(time=slice(0, None, 2))
    onsets = list(run_on_tracks(detector, tracks))[-1].onsets
    # The skin shears as weight and grip come: the onset of slip lies before the load.
    for event, alarm in alarms.items():
        assert alarm.time == pytest.approx(max(getattr(onsets, event) - HELD.begins, 0.0), abs=1e-9), event
        assert (alarm.time == 0.0) == (event == "incipient")
    other = LearnedMarkers(replace(detector, layout="other"))
    with Grasp(HELD, SENSOR, {"learned": other}) as grasp, pytest.raises(InputError, match="have "):
        assert grasp.open_loop


@pytest.mark.parametrize(
    ("make", "kind"), [(LearnedMarkers, "internal_markers"), (lambda _: SpikeCount(kind="SA-I"), "SA-I")]
)
def test_detector_without_its_sites_is_refused(detector, make, kind):
    with pytest.raises(InputError) as caught:
        Grasp(HELD, pad(), {"touch": make(detector)})
    assert str(caught.value) == (
        f"detectors.touch: needs sites of the kind {kind}, the holder has none; "
        f"write holder_of(..., groups=['{kind}']), or record.sites in a study"
    )
