"""``fingerslip show --figure``: a picture of the fingertip of a preset or a study."""

from __future__ import annotations

from pathlib import Path

from fingerslip.errors import InputError
from fingerslip.files import writing
from fingerslip.report.figures.fingertip import fingertip_figure
from fingerslip.report.figures.save import save_figure
from fingerslip.specimens.fingertip import Fingertip, preset
from fingerslip.study.running.plan import plan_study

__all__ = ["draw_fingertip"]

_SUFFIXES = (".png", ".svg", ".pdf")


def draw_fingertip(target: str, path: Path) -> None:
    """Draw both sections of a fingertip and, where it has a shape in space, the finger itself.

    Parameters
    ----------
    target : str
        Name of a preset, or a study file (of a sweep its first run).
    path : Path
        The picture, of a type that the suffix names: ``.png``, ``.svg`` or ``.pdf``.

    Raises
    ------
    InputError
        Where there is no such preset or study, it has no fingertip, or the suffix is another.
    ResultError
        Where the file cannot be written.
    """
    if path.suffix not in _SUFFIXES:
        raise InputError("show --figure", f"got '{path}'", f"needs a file that ends in {', '.join(_SUFFIXES)}")
    figure = fingertip_figure(_fingertip(target), Path(target).stem)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    save_figure(figure, path)


def _fingertip(target: str) -> Fingertip:
    if Path(target).suffix not in (".yaml", ".yml"):
        return preset(target)
    specimen = plan_study(target).runs[0].specimen
    if not isinstance(specimen, Fingertip):
        raise InputError(f"show {target}", "has no fingertip to draw", "needs a study with a fingertip")
    return specimen
