"""Tables of numerical uncertainties."""

from __future__ import annotations

from fingerslip.report.tables.compare import convergence_table, series_table
from fingerslip.tables.table import Missing, texts
from fingerslip.uncertainty import Convergence, Series

SIZES = (1.0, 0.5, 0.25)
GOOD = Convergence(
    "overall slip",
    "s",
    2.0,
    {
        "mesh": Series("mesh", SIZES, (2.0, 1.5, 1.25)),
        "step": Series("step", SIZES, (2.0, 2.2, 2.1)),
        "penalty": Series("penalty", SIZES, (2.0, 2.0, 2.0)),
        "alpha": Series("alpha", (-0.4, -0.05), (2.0, 2.001)),
    },
)
NEVER = Convergence("incipient slip", "s", None, {"mesh": Series("mesh", SIZES, (None, None, None))})


def test_a_number_has_its_uncertainty_by_setting_and_its_verdict() -> None:
    row = texts(convergence_table({"slip.overall": GOOD}, "run"))[0]
    assert row == [
        "overall slip", "s", "2", "1.387", "1.25 (1.0)", "0.6 (up/down)", "unchanged", "0.001", "not with step",
    ]  # fmt: skip


def test_an_event_that_did_not_happen_says_so_in_every_cell() -> None:
    table = convergence_table({"slip.incipient": NEVER, "normal_force_max_N": NEVER}, "run")
    assert texts(table)[0][2:] == ["none"] * 7
    assert texts(table)[1][2:] == ["n/a"] * 7, "a measure is no event"
    assert "none: the event did not happen" in table.remarks


def test_a_setting_that_was_not_varied_is_told_from_an_event_that_a_level_lacks() -> None:
    one = Convergence("overall slip", "s", 2.0, {"step": Series("step", SIZES, (2.0, None, 1.9))})
    row = convergence_table({"slip.overall": one}, "run").rows[0]
    assert row[3:8] == (Missing.NO_EVENT, Missing.NOT_STUDIED, Missing.NO_EVENT, *[Missing.NOT_STUDIED] * 2)


def test_a_number_that_nothing_changes_has_no_error_bar() -> None:
    still = Convergence("overall slip", "s", 1.748, {"step": Series("step", SIZES, (1.748,) * 3)})
    assert still.uncertainty is None
    assert texts(convergence_table({"slip.overall": still}, "run"))[0][2:5] == ["1.748", "unchanged", "n/s"]


def test_series_have_a_row_for_every_level() -> None:
    rows = series_table({"run": {"slip.overall": GOOD}}).rows
    assert len(rows) == 3 * 3 + 2
    assert rows[1] == ("run", "slip.overall", "s", "mesh", 0.5, 1.5)
