"""The folder of a run: what tells its inputs apart, and what is stored beside its history."""

from __future__ import annotations

import json
from importlib import metadata
from pathlib import Path
from typing import Any

from fingerslip.digest import digest
from fingerslip.study.definition.sweep import Run
from fingerslip.study.running.build import mesh_key

__all__ = ["RESULT_FORMAT", "identity", "read_result"]

#: Raised whenever the numerics or the files of a run change, so that older runs are computed again.
RESULT_FORMAT = 5


def identity(run: Run) -> str:
    """Return the hash of everything that decides the result of a run: its values, its mesh files, the program."""
    values = {key: value for key, value in run.resolved().items() if key != "title"}
    values["mesh"] = {"hash": mesh_key(run)}
    made_by = {"format": RESULT_FORMAT, "version": metadata.version("fingerslip")}
    return digest([made_by, values])


def read_result(folder: Path) -> dict[str, Any] | None:
    """Read what is stored beside the history of a finished run; None where there is no finished run."""
    try:
        result: dict[str, Any] = json.loads((folder / "events.json").read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        return None
    return result if (folder / "history.nc").is_file() else None
