"""Results as MATLAB files."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.io import loadmat

from fingerslip.export.formats import write_history_mat, write_tables_mat


def test_a_history_reads_back_with_units_and_dimensions(pushed: xr.Dataset, tmp_path: Path) -> None:
    write_history_mat(pushed, tmp_path)
    history = loadmat(tmp_path / "history.mat", simplify_cells=True)["history"]
    np.testing.assert_array_equal(history["displacement"], pushed["displacement"].values)
    np.testing.assert_array_equal(history["contact_state"], pushed["contact_state"].values)
    assert list(history["dimensions"]["displacement"]) == ["time", "site", "component"]
    assert (history["units"]["stress"], history["meaning"]["time"]) == ("Pa", "time")
    assert list(history["site"]) == ["deep", "low"]
    assert history["attributes"]["element"] == pushed.attrs["element"]


def test_a_table_reads_back_under_names_that_matlab_takes(tmp_path: Path) -> None:
    frame = pd.DataFrame({"run": ["a", "b"], "contact.friction_coefficient": [0.2, np.nan]})
    frame.attrs["units"] = {"contact.friction_coefficient": "1"}
    write_tables_mat({"runs": frame}, tmp_path)
    runs = loadmat(tmp_path / "runs.mat", simplify_cells=True)["runs"]
    assert list(runs["run"]) == ["a", "b"]
    np.testing.assert_array_equal(runs["contact_friction_coefficient"], [0.2, np.nan])
    assert runs["units"]["contact_friction_coefficient"] == "1"


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("octave") is None, reason="needs Octave")
def test_octave_reads_a_history(pushed: xr.Dataset, tmp_path: Path) -> None:
    write_history_mat(pushed, tmp_path)
    code = (
        "load('history.mat'); printf('%.17g|%s|%s|%s|%d', history.displacement(end, 1, 2), history.units.stress, "
        "history.site{2}, history.attributes.element, size(history.contact_state, 2));"
    )
    command = ["octave", "--no-gui", "--quiet", "--eval", code]
    printed = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    number, *words = printed.split("|")
    assert float(number) == float(pushed["displacement"].values[-1, 0, 1])
    assert words == ["Pa", "low", pushed.attrs["element"], str(pushed.sizes["contact_node"])]
