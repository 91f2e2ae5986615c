"""CSV files of laboratories, with errors that say what is wrong."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fingerslip.errors import InputError, ResultError, shortened
from fingerslip.files import frame_csv, write_text

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["read_table", "write_table"]


def read_table(path: Path) -> pd.DataFrame:
    """Read a CSV file with a line of names."""
    import pandas as pd

    if not path.is_file():
        raise InputError(str(path), "there is no such file", "needs a CSV file with a line of names")
    try:
        return pd.read_csv(path)
    except OSError as error:
        raise ResultError(f"{path}: cannot be read ({error.strerror}); name a file that can be") from error
    except ValueError as error:
        raise InputError(str(path), f"is no table ({shortened(str(error))})", "needs CSV with names") from error


def write_table(table: pd.DataFrame, path: Path) -> None:
    """Write a table as CSV, whole or not at all; raise ResultError where it cannot be written."""
    write_text(path, frame_csv(table))
