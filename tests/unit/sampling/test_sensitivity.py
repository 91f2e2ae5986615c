"""Linear fits of slip times: known slopes come back, with their units, errors and shares."""

import dataclasses

import numpy as np
import pytest

from fingerslip.published import published_set
from fingerslip.results import StudyResult
from fingerslip.sampling.sensitivity import (
    Fit,
    Interval,
    fit_samples,
    fits_of,
    groups_of,
    interval_of,
    number_and_unit,
    position,
    published_intervals,
)
from fingerslip.slip import SlipEvents
from unit.sampled import RANGES, VARIANT, overall, study_of


def slip_fit(study: StudyResult) -> Fit:
    fit = fit_samples(study.runs, study.ranges, "slip", "overall")
    assert fit is not None
    return fit


def test_slopes_of_a_linear_time_are_exact_in_the_units_of_the_ranges_the_largest_change_first() -> None:
    fit = slip_fit(study_of())
    units = [(effect.path.split(".")[-1], effect.unit) for effect in fit.effects]
    assert units == [("clearance", "mm"), ("half_height", "mm"), ("poisson_ratio", "")]
    assert [effect.slope for effect in fit.effects] == pytest.approx([-0.5, 0.1, 0.0], abs=1e-9)
    assert [effect.change for effect in fit.effects] == pytest.approx([-0.2, 0.1, 0.0], abs=1e-9)
    assert fit.middle == pytest.approx(1.7)
    assert (fit.determination, fit.predicted) == (pytest.approx(1.0), pytest.approx(1.0))
    assert fit.residual == pytest.approx(0.0, abs=1e-12)


def test_standardised_coefficients_add_up_to_the_variance_and_ranks_have_the_sign() -> None:
    fit = slip_fit(study_of(count=200))
    clearance, height, ratio = fit.effects
    # Of uniform values the variances are those of 0.2 s and 0.1 s.
    assert clearance.standardised == pytest.approx(-0.2 / np.hypot(0.2, 0.1), abs=0.03)
    assert height.standardised == pytest.approx(0.1 / np.hypot(0.2, 0.1), abs=0.03)
    assert clearance.rank == pytest.approx(-0.9, abs=0.06)
    assert abs(ratio.rank) < 0.15


def test_the_standard_error_is_that_of_a_known_noise_and_few_samples_flatter_no_predicted_determination() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.01, 400)
    errors = iter(noise)
    fit = slip_fit(study_of(count=400, time=lambda *given: overall(*given) + next(errors)))
    assert fit.residual == pytest.approx(0.01, rel=0.1)
    # A uniform value over a range r has the variance r^2 / 12.
    assert fit.effects[0].change_error == pytest.approx(0.01 * np.sqrt(12 / 400), rel=0.1)
    assert fit.effects[0].slope == pytest.approx(-0.5, abs=4 * fit.effects[0].error)
    noise = iter(np.random.default_rng(2).normal(0.0, 1.0, 6))
    fit = slip_fit(study_of(count=6, time=lambda *_: 2.0 + next(noise)))
    assert fit.determination > 0.2
    # Six samples less a constant and three slopes leave two degrees of freedom.
    left_over = 6 * (1.0 - fit.determination) * np.var(fit.interval.values)
    assert 2 * fit.residual**2 == pytest.approx(left_over)
    assert fit.predicted < 0.0


def test_samples_without_the_event_are_left_out_and_too_few_or_equal_ones_have_no_fit() -> None:
    fit = slip_fit(study_of(time=lambda *given: None if given[0] > 0.3 else overall(*given)))
    assert fit.interval.missing == 3
    assert fit.effects[0].slope == pytest.approx(-0.5)
    assert fits_of(study_of(count=2)) == fits_of(study_of(count=4)) == ()
    study = study_of(time=lambda *_: 1.7)
    assert fit_samples(study.runs, study.ranges, "slip", "overall") is None
    assert fit_samples(study.runs, study.ranges, "acceleration", "overall") is None, "not recorded"


def test_groups_are_the_samples_of_each_swept_value() -> None:
    groups = groups_of(study_of(5, ("original", "scaled")).runs)
    sizes = [(dict(group), len(members)) for group, members in groups]
    assert sizes == [({VARIANT: "original"}, 5), ({VARIANT: "scaled"}, 5)]
    fits = fits_of(study_of(6, ("original", "scaled")))
    assert [fit.group[VARIANT] for fit in fits if fit.time == "overall"] == ["original", "scaled"]
    assert set(RANGES) == {effect.path for effect in fits[0].effects}


UNIFORM = Interval(tuple(1.0 + 0.01 * number for number in range(101)))


def test_a_published_time_is_placed_among_percentiles_and_events_that_did_not_happen_are_counted() -> None:
    spans = {
        (1.345, 1.345): "within, at 35 %",
        (0.99, 0.99): "below all",
        (2.01, 2.01): "above all",
        (0.8, 1.0): "within, at 0 %",
        (1.0, 1.0): "within, at 0 %",
        (1.99, 2.5): "within, at 100 %",
    }
    assert {span: position(span, UNIFORM) for span in spans} == spans
    assert UNIFORM.summary == pytest.approx((1.0, 1.05, 1.5, 1.95, 2.0))
    assert interval_of([None, 2.0, 1.0, None]) == Interval((1.0, 2.0), 2)
    assert interval_of([None]) is None
    assert [number_and_unit(value) for value in ("6.5 mm", 0.48)] == [(6.5, "mm"), (0.48, "")]


def test_every_published_time_has_the_interval_of_the_runs_that_meet_its_conditions() -> None:
    study = study_of(12, ("original", "scaled"))
    found = published_intervals(study.runs, [published_set("wang2014-table2"), published_set("wang2014-peaks")])
    assert [(one.value.quantity, one.value.conditions["fingertip.phalanx.variant"]) for one in found] == [
        *((time, variant) for variant in ("original", "scaled") for time in ("incipient", "overall", "latency")),
        ("three_quarter", "original"),
    ], "a time that is printed twice stands once"
    assert {one.reading for one in found} == {"slip"}, "nothing else is recorded"
    assert {one.samples for one in found} == {12}
    original = found[1]
    assert original.interval is not None
    assert original.where == position((1.71, 1.71), original.interval)
    assert found[-1].interval is None
    assert found[-1].where == ""


def test_both_readings_are_shown_where_the_paper_names_none_and_samples_leave_conditions_open() -> None:
    study = study_of()
    runs = [
        dataclasses.replace(run, events=dataclasses.replace(run.events, acceleration=SlipEvents(overall=1.0)))
        for run in study.runs
    ]
    found = published_intervals(runs, [published_set("wang2014-table2")])
    places = [(interval.reading, interval.where) for interval in found if interval.value.quantity == "overall"]
    assert places == [("slip", found[2].where), ("acceleration", "above all")]
    # A condition on a sampled value is what the samples leave open.
    friction, published, runs = {"contact.friction_coefficient": 0.5}, [published_set("wang2014-table2")], study.runs
    assert published_intervals([dataclasses.replace(run, sampled=run.sampled | friction) for run in runs], published)
    other = [dataclasses.replace(run, values=run.values | friction) for run in runs]
    assert published_intervals(other, published) == ()
