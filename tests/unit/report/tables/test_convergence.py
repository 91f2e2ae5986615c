"""Tables of numerical uncertainties."""

from __future__ import annotations

from fingerslip.report.tables.convergence import convergence_table, series_table
from fingerslip.report.tables.table import texts
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
    row = texts(convergence_table([GOOD], "run"))[0]
    assert row == [
        "overall slip", "s", "2", "1.387", "1.25 (1.0)", "0.6 (up/down)", "0", "0.001", "not with step",
    ]  # fmt: skip


def test_an_event_that_did_not_happen_is_a_row_of_dashes() -> None:
    assert texts(convergence_table([NEVER], "run"))[0][2:] == ["-"] * 7


def test_series_have_a_row_for_every_level() -> None:
    rows = series_table({"run": {"slip.overall": GOOD}}).rows
    assert len(rows) == 3 * 3 + 2
    assert rows[1] == ("run", "slip.overall", "s", "mesh", 0.5, 1.5)
