"""The slide's records and sustained crossings."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip import slip
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import InputError
from fingerslip.slip.windows import ContactForces, accumulated_slip, area_fraction, counterface_normal
from unit.report.scenes import block_history
from unit.synthetic import HALF_WIDTH, PRESS_END, SPEED, Process, make, slip_times

SIGNALS = st.lists(st.floats(0.0, 1.0), min_size=2, max_size=40)


PRESS, TWO_SLIDES = ("press", 0.0, 1.0), (("slide", 1.0, 1.4), ("hold", 1.4, 1.5), ("slide", 1.5, 2.0))


@pytest.mark.parametrize(
    ("phases", "slide", "records"),
    [
        ((("press", 0.0, 1.003), ("slide", 1.003, 1.998)), 0, (200, 399)),  # the last record before the slide is first
        ((("press", 0.0, 1.0 - 1e-13), ("slide", 1.0 - 1e-13, 2.0 - 1e-13)), 0, (200, 400)),  # rounding is forgiven
        ((PRESS, ("hold", 1.0, 2.0)), 0, None),
        ((("press", 0.0, 2.5), ("slide", 2.5, 3.0)), 0, None),  # not recorded
        ((PRESS, *TWO_SLIDES), 1, (300, 400)),
    ],
)
def test_window_of_a_slide(phases, slide, records):
    window = slip.slide_window(make(Process(phases=phases)), slide)
    assert (window and (window.first, window.last)) == records


def test_a_slide_that_turns_back_is_another_one_and_one_that_is_not_there_is_refused():
    history = make(Process(phases=(("press", 0.0, 1.0), ("slide", 1.0, 1.2), ("slide", 1.2, 1.6), ("slide", 1.6, 2.0))))
    plate = history["counterface_displacement"].copy()
    plate[320:, 0, 0] = 2.0 * plate[320, 0, 0] - plate[320:, 0, 0]
    there_and_back = history.assign(counterface_displacement=plate)
    windows = [slip.slide_window(there_and_back, slide) for slide in (0, 1)]
    assert [(window.start, window.end) for window in windows] == [(1.0, 1.6), (1.6, 2.0)]
    with pytest.raises(InputError, match=r"slide: got 2, the programme has 2 slide"):
        slip.slide_window(make(Process(phases=(PRESS, *TWO_SLIDES))), 2)


@pytest.mark.parametrize(
    ("values", "level", "sustained", "crossing"),
    [
        ([0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0], 0.5, 1.0, 3.5),  # a short spell does not count
        ([0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0], 0.5, 2.0, None),
        ([0.0, 0.0, 0.0, 1.0], 0.25, 10.0, 2.25),  # one up to the end counts however short
        ([np.nan, np.nan, 0.6, 0.7], 0.5, 1.0, 2.0),  # missing values are below every level
        ([np.nan] * 4, 0.0, 0.0, None),
    ],
)
def test_crossings_that_last(values, level, sustained, crossing):
    times = np.arange(len(values), dtype=float)
    assert slip.sustained_crossing(times, np.array(values), level, sustained) == pytest.approx(crossing)


@given(SIGNALS, st.floats(0.01, 1.0), st.floats(0.01, 1.0), st.floats(0.0, 5.0))
def test_higher_level_is_never_reached_earlier(values, one, other, sustained):
    times, signal = np.arange(len(values), dtype=float), np.array(values)
    low = slip.sustained_crossing(times, signal, min(one, other), sustained)
    high = slip.sustained_crossing(times, signal, max(one, other), sustained)
    assert high is None or (low is not None and low <= high + 1e-9)


def first_lasting(times, above, sustained):
    """Return the first record from which a signal stays above for long enough, by looking at all of them."""
    for start in np.flatnonzero(above & ~np.concatenate([[False], above[:-1]])):
        below = np.flatnonzero(~above[start:])
        end = start + below[0] - 1 if below.size else times.size - 1
        if end == times.size - 1 or times[end] - times[start] >= sustained:
            return int(start)
    return None


@given(st.lists(st.lists(st.floats(0.0, 1.0), min_size=9, max_size=9), min_size=0, max_size=6), st.floats(0.0, 5.0))
def test_several_signals_are_looked_at_as_one_by_one(signals, sustained):
    times, values = np.array([0.0, 0.5, 1.0, 2.0, 2.5, 4.0, 5.0, 6.5, 7.0]), np.array(signals).reshape(-1, 9).T
    found = slip.sustained_crossings(times, values, 0.5, sustained)
    assert found == [slip.sustained_crossing(times, own, 0.5, sustained) for own in values.T]
    for own, crossing in zip(values.T, found, strict=True):
        start = first_lasting(times, own >= 0.5, sustained)
        assert (crossing is None) == (start is None)
        if crossing is not None and start is not None:
            assert times[max(start - 1, 0)] <= crossing <= times[start]


def test_forces_of_a_turned_plate_are_those_of_the_level_one_and_a_second_one_has_its_own():
    turn, force = np.array([[0.8, -0.6], [0.6, 0.8]]), HISTORY["counterface_force"]
    turned = HISTORY.assign_coords(counterface_normal=(("counterface", "component"), [turn @ [0.0, 1.0]]))
    turned = turned.assign(counterface_force=force.copy(data=force.values @ turn.T))
    level, inclined = slip.contact_forces(HISTORY), slip.contact_forces(turned)
    np.testing.assert_allclose(inclined.normal, level.normal, atol=1e-12)
    np.testing.assert_allclose(inclined.friction, level.friction, atol=1e-12)
    force = HISTORY["counterface_force"].values
    np.testing.assert_allclose(level.friction, np.abs(force[:, 0, 0]), atol=1e-15)
    of_two = (("time", "counterface", "component"), np.concatenate([force, 2.0 * force], axis=1))
    normals = (("counterface", "component"), np.array([[0.0, 1.0]] * 2))
    two = HISTORY.drop_dims("counterface").assign(counterface_force=of_two).assign_coords(counterface_normal=normals)
    np.testing.assert_allclose(slip.contact_forces(two, 1).normal, 2.0 * slip.contact_forces(two, 0).normal)
    forces = ContactForces(np.array([0.0, 1e-12, 0.5, 1.0]), np.array([[0.1, 0.0], [0.1, 0.0], [0.3, 0.4], [0.2, 0.0]]))
    np.testing.assert_allclose(forces.ratio(), [np.nan, np.nan, 1.0, 0.2], err_msg="missing without pressure")
    np.testing.assert_allclose(forces.ratio(0.6), [np.nan, np.nan, np.nan, 0.2])


def test_tangent_is_the_normal_turned_clockwise_and_in_3d_the_furthest_travel_along_the_surface():
    assert slip.slide_tangent(HISTORY).tolist() == [1.0, 0.0]
    tilted = HISTORY.assign_coords(counterface_normal=(("counterface", "component"), [[0.6, 0.8]]))
    assert slip.slide_tangent(tilted) == pytest.approx([0.8, -0.6])
    assert counterface_normal(tilted).tolist() == [0.6, 0.8]
    history = block_history()
    assert slip.slide_tangent(history) == pytest.approx([1.0, 0.0, 0.0])
    travel = history["counterface_displacement"].copy()
    travel[:, 0] = np.linspace(0.0, 1.0, history.sizes["time"])[:, None] * [0.0, 3.0, 4.0]
    sideways = history.assign(counterface_displacement=travel)
    assert slip.slide_tangent(sideways) == pytest.approx([0.0, 1.0, 0.0]), "the normal is z"
    at_rest = history.assign(counterface_displacement=0.0 * travel)
    assert slip.slide_tangent(at_rest) == pytest.approx([1.0, 0.0, 0.0])


HISTORY = make(Process())


def three_nodes(states, way):
    """Return a slide of three nodes with areas 1, 2 and 5 mm2, recorded every 0.1 s."""
    times = 0.1 * np.arange(len(states))
    return HISTORY.isel(time=slice(len(states)), contact_node=slice(3)).assign_coords(
        time=times,
        contact_area=("contact_node", [1e-6, 2e-6, 5e-6]),
        phase_kind=("phase", ["press", "slide"]),
        phase_start=("phase", [-1.0, 0.0]),
        phase_end=("phase", [0.0, times[-1]]),
    ).assign(
        contact_state=(("time", "contact_node"), np.array(states)),
        slip_distance=(("time", "contact_node"), 1e-6 * np.array(way)),
    )  # fmt: skip


def test_fractions_follow_the_annular_slip_and_weigh_nodes_by_their_areas():
    fine = make(Process(nodes=401, jump=False, open_nodes=3))
    slipping = slip.slipping_fraction(fine).sel(time=[1.2, 1.505, 1.9], method="nearest").values
    assert slipping == pytest.approx([0.0, 0.5, 1.0], abs=0.01)
    late = slip.slipped_fraction(fine, slip.slide_window(fine), 30e-6).sel(time=1.505 + 0.01, method="nearest")
    assert float(late) == pytest.approx(0.5, abs=0.01)
    fractions = slip.slipping_fraction(HISTORY), slip.slipped_fraction(HISTORY, slip.slide_window(HISTORY), 50e-6)
    assert [float(one.sel(time=PRESS_END + 5e-3, method="nearest")) for one in fractions] == [1.0, 0.0]
    states = [[STICK, STICK, STICK], [SLIP, STICK, STICK], [STICK, SLIP, SLIP], [OPEN, SLIP, STICK], [OPEN] * 3]
    history = three_nodes(states, np.zeros((5, 3)).tolist())
    shares = [0.0, 1 / 8, 7 / 8, 2 / 7, np.nan]
    assert slip.slipping_fraction(history).values == pytest.approx(shares, nan_ok=True)
    assert slip.stick_ratio(history).values == pytest.approx(1.0 - np.array(shares), nan_ok=True)
    assert slip.contact_area(history).values == pytest.approx([8e-6, 8e-6, 8e-6, 7e-6, 0.0])


def test_slip_counts_beyond_the_tolerance_from_the_start_of_the_slide_on():
    """The first node slipped before the slide, the second lands during it, the third slips last."""
    states = [[SLIP, OPEN, STICK], [STICK, STICK, STICK], [STICK, SLIP, SLIP], [SLIP, SLIP, SLIP], [OPEN, SLIP, SLIP]]
    way = [[50, 0, 0], [50, 0, 0], [60, 30, 21], [75, 60, 40], [75, 90, 60]]
    history = three_nodes(states, way)
    window = slip.slide_window(history)
    assert accumulated_slip(history, window)[:, 0] * 1e6 == pytest.approx([0, 0, 10, 25, 25])
    fraction = slip.slipped_fraction(history, window, 20e-6)
    # Areas 1 and 5 were there from the start; the first lifts off at the end.
    assert fraction.values == pytest.approx([0.0, 0.0, 5 / 6, 1.0, 1.0])
    assert slip.slipped_fraction(history, window, 22e-6).values[2] == 0.0


@given(st.lists(st.tuples(st.booleans(), st.booleans(), st.floats(1e-9, 1e-3)), min_size=1, max_size=20))
def test_a_fraction_is_between_nothing_and_all(nodes):
    whole, inside, areas = (np.array(column) for column in zip(*nodes, strict=True))
    (found,) = area_fraction((whole & inside)[None], whole[None], areas)
    assert np.isnan(found) == (not whole.any())
    if whole.any():
        assert -1e-12 <= found <= 1.0 + 1e-12
        assert found == pytest.approx(areas[whole & inside].sum() / areas[whole].sum())


@pytest.mark.parametrize("normal", [(0.0, 1.0), (0.6, 0.8), (0.0, -1.0)])
def test_way_off_the_plates_line_is_along_the_plate_whatever_its_inclination(normal):
    tangent = np.array([normal[1], -normal[0]])
    window = slip.slide_window(HISTORY)
    count = HISTORY.sizes["contact_node"]
    plate, lift = HISTORY["counterface_displacement"].values[:, 0].T
    along = HISTORY["contact_displacement"].values[..., 0]
    squeeze = 1e-4 * np.sin(20.0 * HISTORY["time"].values)
    node = along[..., None] * tangent + squeeze[:, None, None] * np.array(normal)
    counterface = plate[:, None] * tangent + lift[:, None] * np.array(normal)
    inclined = HISTORY.assign_coords(counterface_normal=(("counterface", "component"), [normal])).assign(
        contact_displacement=(("time", "contact_node", "component"), node),
        counterface_displacement=(("time", "counterface", "component"), counterface[:, None]),
    )
    expected = np.abs((along - along[window.first]) - (plate - plate[window.first])[:, None])[window.records]
    assert slip.relative_displacement(inclined, window).shape == (window.last - window.first + 1, count)
    np.testing.assert_allclose(slip.relative_displacement(inclined, window), expected, atol=1e-15)
    ideal = make(Process(jump=False))
    way = SPEED * np.clip(2.0 - slip_times(Process(), np.linspace(-HALF_WIDTH, HALF_WIDTH, 41)), 0.0, None)
    for distance in (slip.relative_displacement, accumulated_slip):
        np.testing.assert_allclose(distance(ideal, slip.slide_window(ideal))[-1, :41], way, atol=1e-12)
