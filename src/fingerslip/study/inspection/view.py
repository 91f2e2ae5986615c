"""``fingerslip view``: a stored run in a window, a picture or a film."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fingerslip.errors import InputError, ResultError
from fingerslip.history import read_history
from fingerslip.parameters import from_mapping
from fingerslip.report.scene.options import SceneOptions, Served, require_free
from fingerslip.results import HISTORY, RESULT, stored_result
from fingerslip.slip import find_events
from fingerslip.study.inspection.times import time_of_run

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["view_result"]


def view_result(
    target: str | Path,
    options: Mapping[str, Any],
    *,
    time: str = "",
    screenshot: Path | None = None,
    movie: Path | None = None,
    served: Served | None = None,
) -> tuple[Path, ...]:
    """Show a stored run."""
    chosen = from_mapping(SceneOptions, dict(options), "view")
    if served is not None:
        require_free(served)
    history = _stored_history(Path(target))
    moment = time_of_run(history, time, "view: --time") if time else None
    # Libraries that draw are slow to load: what is wrong with the result is said before.
    from fingerslip.report.scene.viewer import save_movie, save_still

    if screenshot is not None:
        save_still(history, screenshot, moment, chosen)
    if movie is not None:
        save_movie(history, movie, chosen)
    if screenshot is None and movie is None:
        _look(history, chosen, f"fingerslip: {target}", served)
    return tuple(path for path in (screenshot, movie) if path is not None)


def _look(
    history: xr.Dataset,
    options: SceneOptions,
    title: str,
    served: Served | None,
) -> None:
    """Open a window, or serve a browser."""
    from fingerslip.report.scene.viewer import open_window
    from fingerslip.report.scene.web import serve

    events = find_events(history)
    if served is None:
        open_window(history, options, title, events)
    else:
        serve(history, events, options, title, served)


def _stored_history(target: Path) -> xr.Dataset:
    if target.is_file():
        return read_history(target)
    if (target / HISTORY).is_file():
        return _whole_history(target)
    runs = sorted(path.parent.name for path in target.glob(f"*/{HISTORY}"))
    if len(runs) == 1:
        return _whole_history(target / runs[0])
    if runs:
        raise InputError(str(target), f"holds {len(runs)} runs", f"needs one of {', '.join(runs)}", "name its folder")
    raise ResultError(f"{target}: holds no run; needs a folder that fingerslip run wrote")


def _whole_history(folder: Path) -> xr.Dataset:
    """Read the history of a run, not one that is known to be damaged."""
    if (folder / RESULT).exists():
        stored_result(folder)
    return read_history(folder / HISTORY)
