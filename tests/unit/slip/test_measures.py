"""Measures of histories in which they are known, and where an added measure appears."""

import numpy as np
import pytest

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.slip import MEASURES, Measure, acceleration_peaks, find_events, read_measures
from fingerslip.slip.measures import caveats, measure_of, resolution_warnings
from fingerslip.units import Unit
from unit.synthetic import END, PRESS_END, SPEED, Process, make

HISTORY = make(Process())
PHASES = (("press", 0.0, 1.0), ("slide", 1.0, 1.5), ("lift", 1.5, 2.0))


def with_forces(history, normal, tangential):
    force = np.stack([tangential, normal], axis=-1)[:, None]
    return history.assign(counterface_force=(("time", "counterface", "component"), force))


def test_forces_are_the_largest_the_last_and_their_ratio_at_the_end_of_the_last_slide():
    history = make(Process(phases=PHASES))
    times = history["time"].values
    normal = np.where(times <= 1.5 + 1e-9, 0.4, 0.1) + 0.2 * (np.abs(times - 0.5) < 1e-9)
    tangential = np.where(np.abs(times - 1.5) < 1e-9, -0.1, 0.3)
    numbers = read_measures(with_forces(history, normal, tangential))
    assert numbers["normal_force_max_N"] == pytest.approx(0.6)
    assert numbers["normal_force_end_N"] == pytest.approx(0.1)
    assert numbers["friction_force_ratio_end_of_slide"] == pytest.approx(0.25)
    phases = (("press", 0.0, 1.0), ("slide", 1.0, 1.2), ("hold", 1.2, 1.5), ("slide", 1.5, 2.0))
    history = make(Process(phases=phases))
    times = history["time"].values
    ratio = read_measures(with_forces(history, np.ones_like(times), times / 10))["friction_force_ratio_end_of_slide"]
    assert ratio == pytest.approx(0.2)


def test_the_slip_margin_is_what_is_left_of_the_largest_force_ratio_at_incipient_slip():
    """The ratio grows linearly from the start of the slide, at 1 s, to overall slip at 1.71 s."""
    incipient = find_events(HISTORY).incipient
    expected = 1.0 - (incipient - 1.0) / 0.71
    assert read_measures(HISTORY)["slip_margin_incipient"] == pytest.approx(expected, rel=1e-9)
    slippery = read_measures(make(Process(friction=0.1)))["slip_margin_incipient"]
    assert slippery == pytest.approx(expected, rel=1e-9), "a share of the limit, whatever the friction"


def test_the_slip_margin_leaves_out_records_without_pressure_and_is_none_without_a_slide_slip_friction_or_pressure():
    times, none = HISTORY["time"].values, np.zeros(HISTORY.sizes["time"])
    forces = np.where(times < 1.9, 1.0, 0.0), 0.5 * np.clip(times - 1.0, 0.0, 0.6) * np.where(times < 1.8, 1.0, 0.9)
    found = read_measures(with_forces(HISTORY, *forces))["slip_margin_incipient"]
    assert found == pytest.approx(1.0 - (find_events(HISTORY).incipient - 1.0) / 0.6, rel=1e-9)
    pressed = make(Process(phases=(("press", 0.0, 1.0), ("hold", 1.0, 2.0))))
    smooth, apart = with_forces(HISTORY, none + 1.0, none), with_forces(HISTORY, none, none)
    for history in (pressed, make(Process(edge=3.0, centre=4.0)), smooth, apart):
        assert read_measures(history)["slip_margin_incipient"] is None
    for history in (pressed, apart):
        assert read_measures(history)["friction_force_ratio_end_of_slide"] is None


def test_contact_numbers_are_the_extreme_ones_with_their_signs():
    gap, traction = HISTORY["gap"].copy(), HISTORY["tangential_traction"].copy()
    gap[7, 3], gap[9, 4] = -5e-6, 8e-4
    traction[11, 2] = np.array([-4e3, 0.0])
    history = HISTORY.assign(gap=gap, tangential_traction=traction).assign_attrs(tangential_penalty=2e9)
    numbers = read_measures(history)
    assert numbers["penetration_max_m"] == pytest.approx(5e-6)
    assert numbers["elastic_slip_max_m"] == pytest.approx(4e3 / 2e9)
    assert numbers["normal_traction_max_Pa"] == pytest.approx(3e3)
    assert numbers["slip_distance_max_m"] == pytest.approx(float(HISTORY["slip_distance"].max()))
    apart = HISTORY.assign(gap=HISTORY["gap"] * 0 + 1e-4)
    assert read_measures(apart)["penetration_max_m"] == 0.0


def test_contact_is_soft_where_much_of_the_approach_is_penetration_and_strain_is_judged():
    """The plate starts 0.1 mm below the skin and ends 1.5 mm above where it touches."""
    times = HISTORY["time"].values
    travel, gap = HISTORY["counterface_displacement"].copy(), HISTORY["gap"].copy() * 0
    travel[:, 0] = np.stack([0.0 * times, 1.6e-3 * np.minimum(times, 1.0)], axis=1)
    gap[0], gap[1:] = 1e-4, -12e-6
    soft = read_measures(HISTORY.assign(counterface_displacement=travel, gap=gap))
    assert soft["penetration_over_approach"] == pytest.approx(12e-6 / 1.5e-3)
    assert resolution_warnings({"a run": soft}) == ()
    (said,) = resolution_warnings({"a run": soft | {"penetration_over_approach": 0.0194}})
    assert said.startswith(
        "Contact is soft, its force over approach too small by as much: a run (1.9 % of the approach is"
    )
    strained = {f"run {number}": soft | {"largest_strain": 0.1 * number} for number in range(1, 5)}
    (said,) = resolution_warnings(strained)
    listed = "run 3 (up to 0.30); run 4 (up to 0.40)"
    assert said == f"Strains are large for kinematics: small: {listed}: compare with kinematics: finite."
    assert read_measures(HISTORY.assign(counterface_displacement=travel * 0))["penetration_over_approach"] is None


def test_numbers_of_the_solution():
    iterations = np.zeros(HISTORY.sizes["time"], dtype=int)
    iterations[:3] = [4, 1, 5]
    imbalance = HISTORY["energy_imbalance"] * 0
    imbalance[5] = -3e-8
    history = HISTORY.assign(contact_iterations=("time", iterations), energy_imbalance=imbalance)
    numbers = read_measures(history)
    assert (numbers["contact_iterations_max"], numbers["contact_iterations_mean"]) == (5, round(10 / 401, 2))
    assert numbers["energy_imbalance_over_work"] == pytest.approx(3e-8 / float(HISTORY["external_work"].max()))
    unrecorded = history.drop_vars(["contact_iterations", "energy_imbalance"])
    for name in ("contact_iterations_max", "contact_iterations_mean", "energy_imbalance_over_work"):
        assert read_measures(unrecorded)[name] is None
    at_rest = history.assign(external_work=HISTORY["external_work"] * 0)
    assert read_measures(at_rest)["energy_imbalance_over_work"] is None


def test_keys_carry_the_unit_values_are_written_for_people_and_own_measures_are_read_like_those_that_ship():
    keys = [measure.key for measure in MEASURES]
    assert keys[:3] == ["normal_force_max_N", "normal_force_end_N", "friction_force_max_N"]
    assert len(set(keys)) == len(keys)
    assert all(measure_of(measure.key) is measure for measure in MEASURES)
    assert measure_of("something_else") is None
    assert Measure("peak", "", lambda _: None, Unit("m/s^2")).key == "peak_m_per_s2"
    area, records = measure_of("contact_area_max_m2"), measure_of("records")
    assert (area.text(1.3514e-5), area.text(None), records.text(601)) == ("13.51 mm^2", "does not exist", "601")
    own = Measure("end", "end of the run", lambda history: float(history["time"][-1]), Unit("s"))
    assert read_measures(HISTORY, [own]) == {"end_s": pytest.approx(2.0)}
    numbers = read_measures(HISTORY.drop_dims(["counterface", "contact_node"]))
    of_the_solution = {"records", "contact_iterations_max", "contact_iterations_mean", "energy_imbalance_over_work"}
    of_the_solution |= {"inverted_cells"}
    assert numbers["records"] == 401
    assert {name for name, value in numbers.items() if value is not None} <= of_the_solution


@pytest.mark.parametrize(("step", "nodes", "warnings"), [(5e-3, 41, 0), (0.1, 41, 2), (5e-3, 5, 2)])
def test_what_resolves_a_slide_is_read_off_and_judged(step, nodes, warnings):
    numbers = read_measures(make(Process(step=step, nodes=nodes, jump=False)))
    assert numbers["slide_records"] == round((END - PRESS_END) / step)
    assert numbers["slide_step_s"] == pytest.approx(step)
    assert numbers["nodes_across_contact"] == nodes
    texts = resolution_warnings({"a run": numbers})
    assert len(texts) == warnings
    assert all(text.startswith("Too coarse for the times of slip: a run (") for text in texts)
    (many,) = resolution_warnings({f"run {number}": {"slide_records": 10} for number in range(5)})
    assert "run 2 (10 steps in the slide) and 2 more: take a smaller step" in many


@pytest.mark.parametrize(("direction", "nodes"), [((1.0, 0.0, 0.0), 21), ((0.0, 0.0, 1.0), 5)])
def test_in_3d_nodes_across_the_contact_are_rows_along_the_slide_on_the_first_counterface(direction, nodes):
    x, z = np.meshgrid(np.arange(21.0), np.arange(5.0))
    places = np.stack([x, 0.0 * x, z], axis=-1).reshape(-1, 3) * 1e-3
    beside = places[:40] * 0.5 + (0.0, 0.0, 0.1)
    history = make(Process(nodes=145, open_nodes=0, jump=False)).drop_vars(
        ["contact_position", "counterface_displacement"]
    )
    history = history.isel(component=[0, 1, 1]).assign_coords(component=["x", "y", "z"])
    history["contact_position"] = (("contact_node", "component"), np.concatenate([places, beside]))
    history["contact_counterface"] = ("contact_node", np.repeat([0, 1], [105, 40]))
    history["contact_state"] = (("time", "contact_node"), np.full((history.sizes["time"], 145), STICK))
    travel = history["time"].values[:, None, None] * np.array(direction)
    history["counterface_displacement"] = (("time", "counterface", "component"), travel)
    history["counterface_normal"] = (("counterface", "component"), [[0.0, 1.0, 0.0]])
    assert read_measures(history, [measure_of("nodes_across_contact")])["nodes_across_contact"] == nodes


def test_nodes_that_came_into_contact_since_the_slide_began_and_stick_at_overall_slip_are_counted_and_told():
    history = make(Process(jump=False)).copy(deep=True)
    states, before = history["contact_state"].values, history["time"].values <= PRESS_END + 1e-9
    assert read_measures(history)["sticking_at_overall"] == 0
    states[:, :3], states[:, 3] = STICK, SLIP
    states[before, :4] = OPEN
    assert read_measures(history)["sticking_at_overall"] == 3
    assert read_measures(make(Process(centre=2.5)))["sticking_at_overall"] is None
    told = "the contact at the start of the slide: of the nodes that touch since then, "
    for counts, words in (
        ([3, 1, 0], "up to 3 still stick in 2 of 3 runs."),
        ([1], "1 still sticks."),
        ([0, None], ""),
    ):
        said = caveats({f"run {number}": {"sticking_at_overall": count} for number, count in enumerate(counts)})
        assert said == ((f"Overall slip is that of {told}{words}",) if words else ())


def test_peaks_are_counted_before_that_of_overall_slip_and_travel_is_that_of_the_plate_between_events():
    numbers = read_measures(HISTORY)
    assert numbers["peaks_before_overall"] == 2
    largest = acceleration_peaks(HISTORY).largest
    assert largest.time == pytest.approx(1.71, abs=5.1e-3)
    assert numbers["overall_peak_height_m_per_s2"] == largest.height
    silent = read_measures(HISTORY.drop_dims("site"))
    assert (silent["peaks_before_overall"], silent["overall_peak_height_m_per_s2"]) == (None, None)
    history = make(Process(jump=False))
    numbers = read_measures(history)
    assert numbers["overall_travel_m"] == pytest.approx(SPEED * (1.71 - PRESS_END) + 20e-6, rel=1e-3)
    assert numbers["latency_travel_m"] == pytest.approx(SPEED * 0.9 * 0.41, rel=0.03)
    assert read_measures(make(Process(centre=2.5)))["overall_travel_m"] is None
