"""Arrival of the slip front at receptors, contact near an edge, markers of the skin, and force ratios."""

import numpy as np
import pytest
import xarray as xr

from fingerslip import slip
from fingerslip.contact.states import OPEN, STICK
from fingerslip.sites import Site
from fingerslip.slip import front
from fingerslip.slip.front import edge_distance, edge_warning, share_before_centre, skin_marker_slips, stick_slip_cycles
from fingerslip.slip.receptors import tangential_acceleration
from unit.synthetic import HALF_WIDTH, PRESS_END, SPEED, Process, make, slip_times

PROCESS = Process(jump=False)
TOLERANCE = slip.EventSettings().slip_tolerance


@pytest.mark.parametrize("nodes", [21, 81])
def test_front_arrives_at_a_receptor_when_it_passes_there_on_any_mesh(nodes):
    history = make(Process(jump=False, nodes=nodes))
    arrivals = slip.front_arrivals(history)
    rows = [history["site"].values.tolist().index(name) for name in arrivals["site"].values]
    x = history["site_position"].values[rows, 0]
    assert np.all(np.diff(x) > 0.0)
    assert np.all(np.abs(x) <= HALF_WIDTH + 1e-9)
    # Between nodes the front is straight but for the centre, where it turns between two nodes of the coarse mesh.
    assert arrivals.values == pytest.approx(slip_times(PROCESS, x) + TOLERANCE / SPEED, abs=2e-3)
    missing = slip.front_arrivals(make(Process(jump=False, nodes=nodes, centre=2.5)))
    assert np.isnan(missing.values[missing.size // 2])
    assert np.isfinite(missing.values[[0, -1]]).all()


def test_receptors_may_be_taken_where_they_were_meant_to_be():
    places = {"here": ("FA-I", (1.1e-3, -6e-3)), "out": ("FA-I", (9e-3, -6e-3)), "deep": ("SA-II", (0.0, 0.0))}
    arrivals = slip.front_arrivals(make(PROCESS), sites=[Site(name, *place) for name, place in places.items()])
    assert arrivals["site"].values.tolist() == ["here"]
    assert arrivals.values[0] == pytest.approx(slip_times(PROCESS, np.array([1.1e-3]))[0] + TOLERANCE / SPEED, abs=1e-3)


def test_friction_reaches_its_shares_in_order_and_nothing_arrives_without_slide_or_receptors():
    half, most, beyond = slip.force_ratio_times(make(PROCESS), (0.5, 0.9, 1.1))
    # The synthetic friction force rises evenly from the start of the slide to overall slip.
    rise = PROCESS.centre - PRESS_END
    assert (half, most) == pytest.approx((PRESS_END + 0.5 * rise, PRESS_END + 0.9 * rise), abs=1e-3)
    assert beyond is None
    assert slip.force_ratio_times(make(Process(friction=0.0)), (0.5,)) == (None,), "without friction there is no limit"
    still = make(Process(phases=(("press", 0.0, 1.0), ("hold", 1.0, 2.0))))
    assert slip.force_ratio_times(still) == (None, None)
    assert slip.front_arrivals(still).size == slip.front_arrivals(make(PROCESS), kinds=("unknown",)).size == 0


HISTORY = make(Process())
X = HISTORY["contact_position"].values[:, 0]
SPACING = float(X[1] - X[0])


def ending_at(edge, history=HISTORY):
    """Return the history of a body whose boundary ends at a position [m]."""
    return history.assign_coords(contact_edge_distance=("contact_node", np.abs(edge - X)))


def test_contact_that_reaches_an_edge_is_found_with_its_time_and_distance():
    found = front.edge_contact(ending_at(HALF_WIDTH + 0.5 * SPACING))
    assert (found.boundary, found.distance) == ("skin", pytest.approx(0.5 * SPACING))
    # The patch grows with the square root of time; nodes within two spacings of the edge touch from here on.
    assert found.time == pytest.approx(((HALF_WIDTH - SPACING) / HALF_WIDTH) ** 2, abs=5.1e-3)
    one = ending_at(0.0).isel(contact_node=[20])
    touching = one.assign(contact_state=xr.full_like(one["contact_state"], STICK))
    assert front.edge_contact(touching) == front.EdgeContact("skin", 0.0, 0.0), "a single candidate counts"
    belongs = ("contact_node", np.where(X > 0.0, 1, 0))
    two = xr.concat([HISTORY[["counterface_force"]]] * 2, "counterface")
    history = ending_at(HALF_WIDTH).drop_dims("counterface").assign(two)
    history = history.assign_coords(counterface=["left", "right"], contact_counterface=belongs)
    assert front.edge_contact(history).boundary == "right"
    text = edge_warning({"angle 0 deg": None, "angle 30 deg": front.EdgeContact("skin", 0.125, 0.0)})
    assert "angle 30 deg ('skin' from 0.125 s on, smallest distance 0 mm)" in text
    assert "angle 0 deg" not in text
    assert edge_warning({"a": None}) == ""


def test_contact_away_from_edges_does_not_count():
    """Three facets away, but for the longer ones of quadratic elements; where no node touches; where there is none."""
    away = ending_at(HALF_WIDTH + 3.0 * SPACING)
    assert front.edge_contact(away) is None
    assert edge_distance(away) == pytest.approx(3.0 * SPACING)
    assert front.edge_contact(away.assign_attrs(element="T6")) is not None
    state = HISTORY["contact_state"].where(xr.DataArray(X < 0.0, dims="contact_node"), OPEN).astype(np.int8)
    assert front.edge_contact(ending_at(HALF_WIDTH, HISTORY.assign(contact_state=state))) is None
    closed = HISTORY.assign_coords(contact_edge_distance=("contact_node", np.full(X.size, np.inf)))
    for history in (closed, HISTORY):
        assert (front.edge_contact(history), edge_distance(history)) == (None, None)


AT_SITES = make(Process(jump=False))
SITES = ("FA-I-10", "FA-I-12", "FA-I-14")


def leaving(times):
    """Return the history with sites that follow the plate up to a time each."""
    displacement = AT_SITES["displacement"].values.copy()
    plate = AT_SITES["counterface_displacement"].values[:, 0, 0]
    names = AT_SITES["site"].values.tolist()
    for name, time in times.items():
        displacement[:, names.index(name), 0] = np.minimum(plate, SPEED * (time - PRESS_END))
    return AT_SITES.assign(displacement=(AT_SITES["displacement"].dims, displacement))


@pytest.mark.parametrize("tolerance", [20e-6, 100e-6])
def test_first_and_last_site_leave_the_line_when_they_lag_by_the_tolerance(tolerance):
    history = leaving(dict(zip(SITES, (1.2, 1.3, 1.5), strict=True)))
    events = slip.reference_events(history, SITES, slip.EventSettings(displacement_tolerance=tolerance))
    assert events.incipient == pytest.approx(1.2 + tolerance / SPEED, abs=1e-3)
    assert events.overall == pytest.approx(1.5 + tolerance / SPEED, abs=1e-3)
    assert events.noticed == pytest.approx(1.3 + tolerance / SPEED, abs=1e-3)


def test_sites_that_stay_on_the_line_are_not_recorded_or_alone_give_what_can_be_read_of_them():
    events = slip.reference_events(leaving({"FA-I-10": 1.2, "FA-I-12": 9.0}), SITES[:2])
    assert events.incipient is not None
    assert events.overall is None
    assert not slip.reference_events(AT_SITES, ("skin-h2",)).recorded
    assert not slip.reference_events(AT_SITES, ()).recorded
    assert not slip.acceleration_events(AT_SITES, slip.PeakSettings(sites=("skin-h2",))).recorded
    signal, row = (
        slip.peak_signal(AT_SITES, slip.PeakSettings(sites=("SA-II-3",))),
        AT_SITES["site"].values.tolist().index("SA-II-3"),
    )
    own = np.abs(tangential_acceleration(AT_SITES, np.array([row])))[:, 0]
    assert signal.values == pytest.approx(own[-signal.size :]), "peaks are read at named sites alone"


MOMENTS = np.linspace(0.0, 10.0, 101)


def marked(friction=None, lags=(1.0, 3.0, 2.0)):
    """Return a marked of three markers that follow a plate at 1 mm/s until they lag from given times on."""
    plate = np.column_stack([1e-3 * MOMENTS, 0.0 * MOMENTS])
    moved = np.stack([np.column_stack([1e-3 * np.minimum(MOMENTS, lag), 0.0 * MOMENTS]) for lag in lags], axis=1)
    force = np.column_stack([MOMENTS if friction is None else friction, np.ones(101)])
    rest = np.array([[-1e-3, 0.0], [0.0, 0.0], [1e-3, 0.0]])
    return xr.Dataset(
        {
            "displacement": (("time", "site", "component"), moved),
            "counterface_displacement": (("time", "counterface", "component"), plate[:, None]),
            "counterface_force": (("time", "counterface", "component"), force[:, None]),
            "contact_state": (("time", "contact_node"), np.ones((101, 3), dtype=int)),
        },
        coords={
            "time": MOMENTS,
            "site": ["external-marker-1-02", "external-marker-0-01", "external-marker-1-01"],
            "site_kind": ("site", ["external marker"] * 3),
            "site_position": (("site", "component"), rest),
            "counterface_normal": (("counterface", "component"), [[0.0, 1.0]]),
            "contact_position": (("contact_node", "component"), rest),
            "phase_kind": ("phase", ["slide"]),
            "phase_start": ("phase", [0.0]),
            "phase_end": ("phase", [10.0]),
        },
    )


def test_times_at_which_markers_lag_and_share_of_them_before_the_centre():
    rows, slips = skin_marker_slips(marked())
    # 50 um behind a plate at 1 mm/s.
    assert rows.tolist() == [0, 1, 2]
    assert slips == pytest.approx([1.05, 3.05, 2.05])
    assert share_before_centre(marked()) == 1.0
    assert share_before_centre(marked(lags=(1.0, 2.0, 20.0))) == 0.5
    assert share_before_centre(marked().assign_coords(site_kind=("site", ["probe"] * 3))) is None


PLATEAU = np.minimum(MOMENTS, 3.0)


@pytest.mark.parametrize(
    ("friction", "cycles"),
    [(np.mod(MOMENTS, 2.6), 3), (PLATEAU, 0), (PLATEAU + 0.05 * np.sin(20 * MOMENTS), 0)],
    ids=["saw tooth", "plateau", "small falls are noise"],
)
def test_falls_of_friction_are_counted(friction, cycles):
    assert stick_slip_cycles(marked(friction)) == cycles
