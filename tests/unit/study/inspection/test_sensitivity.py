"""What moves the results of a stored study, and predictions between its runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fingerslip.errors import InputError
from fingerslip.study.inspection.show import predict_table, write_sensitivities
from fingerslip.study.running.runner import run_study
from unit.study.block import block_values

pytest.importorskip("SALib")
pytestmark = pytest.mark.usefixtures("reports", "simulated")
Write = Callable[..., Path]
RANGES = {"contact.friction_coefficient": [0.2, 0.4], "programme.0.press.depth": ["0.05 mm", "0.1 mm"]}
AT = ["contact.friction_coefficient=0.3", "programme.0.press.depth=0.07 mm"]


def folder_of(write_study: Write, method: str, count: int) -> Path:
    sample = {"method": method, "count": count, "ranges": RANGES}
    path = write_study(block_values() | {"sweep": {}, "sample": sample})
    return run_study(path, results_dir=path.parent / "results", workers=1).folder


def test_sobol_indices_are_written_with_their_figure(write_study: Write) -> None:
    folder = folder_of(write_study, "saltelli", 4)
    (table,) = write_sensitivities(folder, "overall_slip", "auto")
    # The stand-in of the simulation knows friction alone.
    assert table.rows[0][0] == "friction coefficient"
    assert table.rows[1][1] == pytest.approx(0.0, abs=1e-12)
    assert (folder / "sensitivity-overall_slip-sobol.png").is_file()
    assert (folder / "sensitivity-overall_slip-sobol.csv").is_file()
    (linear,) = write_sensitivities(folder, "overall_slip", "linear")
    assert linear.title == "What moves overall slip (accumulated slip)"
    with pytest.raises(InputError, match="of: no regression of 'normal_force_max'"):
        write_sensitivities(folder, "normal_force_max", "linear")


def test_elementary_effects_and_predictions(write_study: Write) -> None:
    folder = folder_of(write_study, "morris", 6)
    (table,) = write_sensitivities(folder, "overall_slip", "auto")
    assert table.rows[0][0] == "friction coefficient"
    (row,) = predict_table(folder, AT, ["overall_slip"]).rows
    assert row[2] == pytest.approx(1.4 + 0.5 * 0.3, abs=0.2)
    with pytest.raises(InputError, match=r"needs path=value, such as contact\.friction_coefficient=0\.5"):
        predict_table(folder, ["x"], ["overall_slip"])
    with pytest.raises(InputError, match=r"time\.step: does not differ between the runs"):
        predict_table(folder, [*AT, "time.step=1 ms"], ["overall_slip"])
