"""Tables of a study with samples."""

from __future__ import annotations

import dataclasses

import pytest

from fingerslip.published import published_set
from fingerslip.report.tables.samples import (
    group_text,
    interval_cells,
    intervals_table,
    published_table,
    refused_table,
    sample_tables,
    sensitivity_rows,
    sensitivity_table,
)
from fingerslip.results import RefusedRun
from fingerslip.sampling import fits_of, interval_of
from fingerslip.tables.table import texts, to_csv
from unit.sampled import study_of

TABLE2 = [published_set("wang2014-table2")]


def test_published_times_stand_beside_the_interval_of_their_phalanx() -> None:
    table = published_table(study_of(12, ("original", "scaled")).runs, TABLE2)
    rows = {(row[0], row[1]): row for row in texts(table)}
    assert len(rows) == 6
    overall = rows["overall slip (accumulated slip)", "phalanx scaled"]
    assert overall[2] == "1.77"
    assert [float(cell) for cell in overall[3:8]] == sorted(float(cell) for cell in overall[3:8])
    assert overall[8].startswith("within, at ")
    assert overall[9] == "12 of 12"


def test_conditions_that_all_have_in_common_are_left_out() -> None:
    assert {row[1] for row in published_table(study_of().runs, TABLE2).rows} == {"all"}


def test_an_event_that_no_sample_has_is_none() -> None:
    table = published_table(study_of(time=lambda *_: None).runs, TABLE2)
    assert texts(table)[0][3:] == [*["none"] * 5, "n/a", "0 of 12"]
    assert interval_cells(interval_of([1.0, 2.0, 3.0])) == (1.0, pytest.approx(1.1), 2.0, pytest.approx(2.9), 3.0)


def test_every_recorded_time_has_an_interval() -> None:
    rows = texts(intervals_table(study_of(12, ("original", "scaled")).runs))
    assert [row[1] for row in rows[:5]] == [
        f"{time} (accumulated slip)"
        for time in ("incipient slip", "48 % slip", "three-quarter slip", "overall slip", "latency")
    ]
    assert [row[0] for row in rows] == ["phalanx original"] * 5 + ["phalanx scaled"] * 5


def test_sensitivities_have_units_errors_and_changes() -> None:
    (fit,) = (fit for fit in fits_of(study_of()) if fit.time == "overall")
    table = sensitivity_table(fit)
    assert table.title == "What moves overall slip (accumulated slip), phalanx original"
    first = texts(table)[0]
    assert first[:3] == ["clearance", "0 mm", "0.4 mm"]
    assert first[3] == "-0.500000 ± 0.000000 s/mm", "six decimals at most"
    assert first[4] == "-200 ± 0"
    assert texts(table)[2][0] == "Poisson's ratio"
    assert texts(table)[2][3].endswith(" s")
    assert table.note.startswith("Linear regression over 12 samples, ± standard error: 1.700 s in the middle")


def test_slopes_have_two_digits_of_their_errors() -> None:
    (fit,) = (fit for fit in fits_of(study_of()) if fit.time == "overall")
    clearance = fit.effects[0]
    noisy = [dataclasses.replace(clearance, error=error) for error in (0.0456, 0.000321, 2.3)]
    table = sensitivity_table(dataclasses.replace(fit, effects=tuple(noisy)))
    assert [row[3] for row in texts(table)] == [
        "-0.500 ± 0.046 s/mm",
        "-0.50000 ± 0.00032 s/mm",
        "-0.500 ± 2.300 s/mm",
    ]


def test_rows_for_programs_have_all_digits() -> None:
    lines = to_csv(sensitivity_rows(fits_of(study_of()))).splitlines()
    assert lines[0].startswith("fingertip.phalanx.variant,reading,time,samples,middle_s,r2,r2_predicted")
    assert len(lines) == 1 + 2 * 3


def test_refused_samples_say_why() -> None:
    refused = (RefusedRun("sample-3", {}, {}, "too large"),)
    assert refused_table(refused).rows == (("sample-3", "too large"),)
    tables = sample_tables(dataclasses.replace(study_of(), refused=refused), TABLE2)
    assert [table.title.partition(" (")[0] for table in tables] == [
        "Published times in the intervals of the samples",
        "Slip times over the samples",
        "What moves overall slip",
        "Samples whose values do not fit together",
    ]


def test_what_samples_have_in_common_is_in_words() -> None:
    assert group_text({"fingertip.phalanx.variant": "scaled", "contact.friction_coefficient": 0.6}) == (
        "phalanx scaled, friction coefficient 0.6"
    )
    assert group_text({}) == ""
