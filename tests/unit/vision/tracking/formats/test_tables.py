"""CSV files of laboratories."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.laboratories import read_table, write_table


def test_table_comes_back_and_an_empty_file_is_refused(tmp_path: Path) -> None:
    write_table(pd.DataFrame({"a": [1, 2]}), tmp_path / "t.csv")
    assert read_table(tmp_path / "t.csv")["a"].tolist() == [1, 2]
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(InputError, match="is no table"):
        read_table(tmp_path / "empty.csv")
    with pytest.raises(InputError, match="there is no such file"):
        read_table(tmp_path / "none.csv")
