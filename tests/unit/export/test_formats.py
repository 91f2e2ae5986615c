"""What can be written for other programs."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.errors import InputError, ResultError
from fingerslip.export.formats import FORMATS, export_tables

Read = Callable[[Path], pd.DataFrame]


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_leaves_a_folder(pushed: xr.Dataset, tmp_path: Path, kind: str) -> None:
    folder = fs.export_history(pushed, tmp_path / kind, kind)
    assert any(folder.iterdir())
    assert [path.name for path in tmp_path.iterdir()] == [kind]


@pytest.mark.parametrize(
    ("kind", "read"), [("csv", partial(pd.read_csv, keep_default_na=False)), ("parquet", pd.read_parquet)]
)
def test_tables_read_back_the_same(pushed: xr.Dataset, tmp_path: Path, kind: str, read: Read) -> None:
    folder = fs.export_history(pushed, tmp_path / kind, kind)
    for name, frame in fs.history_tables(pushed).items():
        back = getattr(pd, f"read_{kind}")(
            folder / f"{name}.{kind}", **({"keep_default_na": False} if kind == "csv" else {})
        )
        pd.testing.assert_frame_equal(back, frame, check_dtype=False)


def test_json_has_columns_units_and_null(tmp_path: Path) -> None:
    frame = pd.DataFrame({"run": ["a"], "overall_s": [float("nan")]})
    frame.attrs["units"] = {"overall_s": "s"}
    export_tables({"runs": frame}, tmp_path / "json", "json")
    found = json.loads((tmp_path / "json" / "runs.json").read_text(encoding="utf-8"))
    assert found == {"units": {"overall_s": "s"}, "columns": {"run": ["a"], "overall_s": [None]}}


def test_a_format_that_is_not_known_leaves_nothing(pushed: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="format: got 'xls', needs one of csv, json, mat, parquet"):
        fs.export_history(pushed, tmp_path / "out", "xls")
    with pytest.raises(ResultError):
        fs.export_history(pushed.isel(snapshot_time=slice(0, 0)), tmp_path / "out", "vtu")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_package_is_named(pushed: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r'needs pyarrow; install it: pip install "fingerslip\[export\]"'):
        fs.export_history(pushed, tmp_path / "out", "parquet")
    assert list(tmp_path.iterdir()) == []


def test_an_export_is_replaced_and_nothing_else(pushed: xr.Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    fs.export_history(pushed, folder, "csv")
    fs.export_history(pushed, folder, "mat")
    assert sorted(path.name for path in folder.iterdir()) == ["fingerslip-export.json", "history.mat"]
    own = tmp_path / "mine"
    own.mkdir()
    (own / "thesis.txt").write_text("years", encoding="utf-8")
    for target in (own, own / "thesis.txt"):
        with pytest.raises(InputError, match="needs a"):
            fs.export_history(pushed, target, "csv")
    assert (own / "thesis.txt").read_text(encoding="utf-8") == "years"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "out"]
