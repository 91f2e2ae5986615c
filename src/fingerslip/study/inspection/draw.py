"""``fingerslip show --figure``: a picture of the specimen of a preset or a study."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from matplotlib.figure import Figure

from fingerslip.errors import InputError
from fingerslip.report.figures.specimens import fingertip_figure, tactip_figure
from fingerslip.report.figures.style import save_figure
from fingerslip.specimens.choice import SPECIMENS, presets_of
from fingerslip.storage.files import writing
from fingerslip.study.running.plan import plan_study

__all__ = ["draw_specimen"]

_SUFFIXES = (".png", ".svg", ".pdf")
#: What draws a specimen, by the key that names its kind.
_FIGURES: Mapping[str, Callable[[Any, str], Figure]] = MappingProxyType(
    {"fingertip": fingertip_figure, "tactip": tactip_figure}
)


def draw_specimen(target: str, path: Path) -> None:
    """Draw a fingertip, both sections and the finger in 3D, or a sensor, cut open and its markers."""
    if path.suffix not in _SUFFIXES:
        raise InputError("show --figure", f"got '{path}'", f"needs a file that ends in {', '.join(_SUFFIXES)}")
    kind, specimen = _specimen(target)
    figure = _FIGURES[kind](specimen, Path(target).stem)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    save_figure(figure, path)


def _specimen(target: str) -> tuple[str, Any]:
    """Return the kind of the specimen of a preset or a study, and the specimen."""
    if Path(target).suffix not in (".yaml", ".yml"):
        presets = presets_of(target)
        return next(kind for kind, element in SPECIMENS.items() if element is presets), presets.read(target)
    run = plan_study(target).runs[0]
    kind = run.study.specimen_kind
    if kind is None:
        raise InputError(f"show {target}", "has no specimen to draw", f"needs a study with a {' or '.join(SPECIMENS)}")
    return kind, run.specimen
