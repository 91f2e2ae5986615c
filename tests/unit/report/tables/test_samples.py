"""Tables of a study with samples, of sensitivities and of predictions."""

import dataclasses
from dataclasses import replace
from pathlib import Path

import pytest

from fingerslip.published import published_set
from fingerslip.report.tables import samples
from fingerslip.results import RefusedRun
from fingerslip.sampling.indices import Prediction, Surrogate, Validation
from fingerslip.sampling.sensitivity import fits_of, interval_of
from fingerslip.tables.table import texts, to_csv
from unit.report.tables.runs import sensitivity
from unit.sampled import study_of

TABLE2 = [published_set("wang2014-table2")]


def test_times_have_intervals_beside_the_published_ones_of_their_phalanx_or_none():
    table = samples.published_table(study_of(12, ("original", "scaled")).runs, TABLE2)
    rows = {(row[0], row[1]): row for row in texts(table)}
    assert len(rows) == 6
    overall = rows["overall slip (accumulated slip)", "phalanx scaled"]
    assert overall[2] == "1.77"
    assert [float(cell) for cell in overall[3:8]] == sorted(float(cell) for cell in overall[3:8])
    assert overall[8].startswith("within, at ")
    assert overall[9] == "12 of 12"
    assert {row[1] for row in samples.published_table(study_of().runs, TABLE2).rows} == {"all"}
    rows = texts(samples.intervals_table(study_of(12, ("original", "scaled")).runs))
    assert [row[1] for row in rows[:5]] == [
        f"{time} (accumulated slip)"
        for time in ("incipient slip", "48 % slip", "three-quarter slip", "overall slip", "latency")
    ]
    assert [row[0] for row in rows] == ["phalanx original"] * 5 + ["phalanx scaled"] * 5
    table = samples.published_table(study_of(time=lambda *_: None).runs, TABLE2)
    assert texts(table)[0][3:] == [*["none"] * 5, "n/a", "0 of 12"]
    assert samples.interval_cells(interval_of([1.0, 2.0, 3.0])) == (
        1.0,
        pytest.approx(1.1),
        2.0,
        pytest.approx(2.9),
        3.0,
    )


def test_sensitivities_have_units_errors_and_changes():
    (fit,) = (fit for fit in fits_of(study_of()) if fit.time == "overall")
    table = samples.sensitivity_table(fit)
    assert table.title == "What moves overall slip (accumulated slip), phalanx original"
    first = texts(table)[0]
    assert first[:3] == ["clearance", "0 mm", "0.4 mm"]
    assert first[3] == "-0.500000 ± 0.000000 s/mm", "six decimals at most"
    assert first[4] == "-200 ± 0"
    assert texts(table)[2][0] == "tissue Poisson's ratio"
    assert texts(table)[2][3].endswith(" s")
    assert table.note.startswith("Linear regression over 12 samples, ± standard error: 1.700 s in the middle")
    # Slopes have two digits of their errors.
    clearance = fit.effects[0]
    noisy = [dataclasses.replace(clearance, error=error) for error in (0.0456, 0.000321, 2.3)]
    table = samples.sensitivity_table(dataclasses.replace(fit, effects=tuple(noisy)))
    assert [row[3] for row in texts(table)] == ["-0.500 ± 0.046 s/mm", "-0.50000 ± 0.00032 s/mm", "-0.500 ± 2.300 s/mm"]


def test_rows_for_programs_have_all_digits_and_refused_samples_say_why():
    lines = to_csv(samples.sensitivity_rows(fits_of(study_of()))).splitlines()
    assert lines[0].startswith("fingertip.phalanx.variant,reading,time,samples,middle_s,r2,r2_predicted")
    assert len(lines) == 1 + 2 * 3
    assert samples.group_text({"fingertip.phalanx.variant": "scaled", "contact.friction_coefficient": 0.6}) == (
        "phalanx scaled, friction coefficient 0.6"
    )
    assert samples.group_text({}) == ""
    refused = (RefusedRun("sample-3", {}, {}, "too large"),)
    assert samples.refused_table(refused).rows == (("sample-3", "too large"),)
    tables = samples.sample_tables(dataclasses.replace(study_of(), refused=refused), TABLE2)
    assert [table.title.partition(" (")[0] for table in tables] == [
        "Published times in the intervals of the samples",
        "Slip times over the samples",
        "What moves overall slip",
        "Samples whose values do not fit together",
    ]


GOOD = Validation(error=0.01, largest=0.03, explained=0.99, covered=0.96, runs=40)


def test_sobol_indices_have_their_intervals():
    table = samples.indices_table(sensitivity("sobol", group={"fingertip.phalanx.variant": "scaled"}))
    assert table.title == "What moves latency (accumulated slip), phalanx scaled"
    assert table.rows[0] == ("friction coefficient", 0.6, 0.1, 0.5, 0.2)
    assert table.note.startswith("56 runs, mean 0.4 s, standard deviation 0.1 s; 8 blocks, 1 left out because")
    of_surrogate = samples.indices_table(sensitivity("sobol", surrogate=GOOD)).note
    assert "its error is 0.01 s (root mean square), at most 0.03 s, Q² 0.990, and 96 % lie in its 95 %" in of_surrogate
    table = samples.indices_table(sensitivity("morris"))
    assert [column.unit for column in table.columns] == ["", *4 * ["s"]]
    assert table.rows[0] == ("friction coefficient", 0.6, 0.1, 0.1, 0.5)


def test_predictions_say_their_error_and_which_runs_they_do_without():
    surrogate = Surrogate("overall_slip", "s", (), GOOD, Path())
    table = samples.prediction_table([(surrogate, Prediction(1.5, 1.4, 1.6))], {"contact.friction_coefficient": 0.5})
    assert table.title == "Predicted for friction coefficient 0.5"
    assert table.rows == (("overall slip", "s", 1.5, 1.4, 1.6, 0.01, 0.03, 0.99),)
    assert table.note.startswith("A Gaussian process of 40 runs. From, to:")
    fewer = replace(GOOD, runs=427, repeated=21)
    latency, slip = (Surrogate(name, "s", (), fewer, Path()) for name in ("latency", "overall_slip"))
    found = Prediction(1.5, 1.4, 1.6)
    of = "427 of 448 runs (left out: 21 with the inputs of another)"
    assert samples.prediction_table([(latency, found), (slip, found)], {}).note.startswith(
        f"A Gaussian process of {of}. From"
    )
    assert (
        f"indices of a surrogate of {of}: for runs" in samples.indices_table(sensitivity("sobol", surrogate=fewer)).note
    )
    seldom = Surrogate("latency", "s", (), replace(fewer, runs=424, missing=3), Path())
    fewest = "424 of 448 runs (left out: 21 with the inputs of another, 3 without this output)"
    said = f"latency: {fewest}; overall slip: {of}."
    assert said in samples.prediction_table([(seldom, found), (slip, found)], {}).note
