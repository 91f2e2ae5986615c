"""Numbers read from histories whose slip is known."""

import numpy as np
import pytest
import xarray as xr

from fingerslip.results import RunResult
from fingerslip.slip import EventSettings, find_events, slide_window
from fingerslip.validation.measures import (
    REFERENCE_NODES,
    centre_after_edge,
    densities,
    largest_accelerations,
    measure,
    measure_3d,
    rms_after,
    travel_over_friction_depth,
)
from unit import synthetic

SETTINGS = EventSettings()


def prepared(process=None):
    history = synthetic.make(process or synthetic.Process())
    window = slide_window(history)
    assert window is not None
    return history, window


def reversed_slip(history):
    """Let slip begin in the centre: the nodes in contact swap their motion from the edge inwards."""
    inside = np.abs(history["contact_position"].values[:, 0]) <= synthetic.HALF_WIDTH + 1e-9
    count = int(inside.sum())
    half = count // 2
    order = np.concatenate((np.arange(half)[::-1], np.arange(half, count)[::-1], np.arange(count, inside.size)))
    swapped = history["contact_displacement"].values[:, order]
    return history.assign(contact_displacement=(history["contact_displacement"].dims, swapped))


def test_centre_leaves_after_the_edges_by_the_travel_of_slip_and_before_them_where_slip_begins_there():
    history, window = prepared(synthetic.Process(jump=False))
    # The medians of the inner and outer quarters lie at 1/8 and 7/8 of the half width.
    assert centre_after_edge(history, window, SETTINGS) == pytest.approx(0.75 * (1.71 - 1.30), rel=0.05)
    assert centre_after_edge(reversed_slip(history), window, SETTINGS) < -0.2
    assert centre_after_edge(*prepared(synthetic.Process(nodes=3)), SETTINGS) is None, "too few for quarters"


def test_largest_acceleration_falls_with_depth_and_leaves_the_transition_out():
    history, window = prepared()
    largest = largest_accelerations(history, window, 1.1)
    assert largest["FA-I"] > largest["SA-I"] > largest["SA-II"] > largest["FA-II"] > 0.0
    # The synthetic signal decays with depth over 2 mm, from 0.5 mm to 3 mm.
    assert largest["FA-I"] / largest["FA-II"] == pytest.approx(np.exp(2.5 / 2.0))
    strong = synthetic.Process(peaks={1.53: 0.054, 1.71: 0.1})
    history, window = prepared(strong)
    with_transition = largest_accelerations(history, window, 1.0)["FA-I"]
    assert with_transition > 3.0 * largest_accelerations(history, window, 1.1)["FA-I"]


def test_density_grows_to_overall_slip_and_stays_or_falls():
    history, window = prepared()
    steady = densities(history, window, 1.71)
    assert steady.growth["FA-I", "A"] == pytest.approx(1.71**2, rel=1e-6)
    assert max(steady.range_after.values()) < 1e-9
    assert steady.mean_after["FA-II", "B"] / steady.mean_after["FA-II", "A"] == pytest.approx(1.2 / 0.8)
    fading = history["strain_energy_density"] * np.where(history["time"] > 1.8, 0.5, 1.0)[:, None]
    falling = densities(history.assign(strain_energy_density=fading), window, 1.71)
    assert min(falling.range_after.values()) > 0.5


def test_travel_is_counted_in_friction_times_indentation_whichever_way_the_plate_slides():
    history, window = prepared()
    way = history["counterface_displacement"] * xr.DataArray([-1.0, 1.0], dims="component")
    back = history.assign(counterface_displacement=way.transpose(*history["counterface_displacement"].dims))
    for slide in (history, back):
        assert travel_over_friction_depth(slide, window, 1.71) == pytest.approx(0.71 * 3.0 / (0.6 * 1.5))


def test_run_in_3d_is_read_at_the_eight_reference_nodes():
    history, _ = prepared(synthetic.Process(jump=False))
    names = [f"skin-{line}{number}" for line in "hv" for number in range(1, 8)]
    # Sites of the synthetic history from the 6th of FA-I on; the reference nodes 2 to 5 of both lines follow the plate
    # up to a time of their own, the others never do.
    sites = [*history["site"].values[:5], *names, *history["site"].values[19:]]
    displacement = history["displacement"].values.copy()
    plate = history["counterface_displacement"].values[:, 0, 0]
    for number, name in enumerate(names):
        until = 1.2 + 0.05 * number if name in REFERENCE_NODES else 1.0
        displacement[:, 5 + number, 0] = np.minimum(plate, 3e-3 * (until - 1.0))
    named = history.assign_coords(site=sites).assign(displacement=(history["displacement"].dims, displacement))
    found = measure_3d(RunResult("run", {}, find_events(history)), named)
    first, last = 1.2 + 0.05, 1.2 + 0.05 * 11
    assert found.run.events.displacement.incipient == pytest.approx(first + 50e-6 / 3e-3, abs=1e-3)
    assert found.run.events.displacement.overall == pytest.approx(last + 50e-6 / 3e-3, abs=1e-3)
    assert found.node_range("incipient") == pytest.approx(50e-6 / 3e-3, abs=1e-3)
    assert found.run.events.acceleration.recorded


def test_vibration_counts_only_within_its_time():
    history, window = prepared(synthetic.Process(peaks={1.80: 0.2}))
    during, later = rms_after(history, window, 1.75), rms_after(history, window, 1.85)
    assert later is not None
    assert during > 100.0 * later


def test_run_is_measured_with_its_peaks():
    history, _ = prepared()
    found = measure(RunResult("run", {}, find_events(history)), history)
    assert found.overall_peak.time == pytest.approx(1.71, abs=6e-3)
    assert found.incipient_peak.time == pytest.approx(1.53, abs=6e-3)
    assert found.middle_peaks == 1
    assert found.travel == pytest.approx(0.71 * 3.0 / 0.9, abs=0.05)


def test_run_without_overall_slip_or_slide_has_no_number_that_needs_it():
    history, _ = prepared(synthetic.Process(edge=1.3, centre=9.0, peaks={}))
    found = measure(RunResult("run", {}, find_events(history)), history)
    assert (found.densities, found.rms_after, found.travel, found.overall_peak) == (None,) * 4
    assert found.middle_peaks == 0
    history = synthetic.make(synthetic.Process(phases=(("press", 0.0, 1.0), ("hold", 1.0, 2.0))))
    found = measure(RunResult("run", {}, find_events(history)), history)
    assert (found.largest_acceleration, found.centre_after_edge) == ({}, None)
