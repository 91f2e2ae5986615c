"""Figures of the folders that detectors write."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fingerslip.detect.folders import OF_CLIPS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(folder: Path, kind: str) -> Figure:
    """Draw a figure of a folder that a detector wrote."""
    if kind in OF_CLIPS:
        from fingerslip.detect.timeline import read_timeline, timeline_figure

        return timeline_figure(read_timeline(folder))
    from fingerslip.detect.evaluation.page import FIGURES
    from fingerslip.detect.evaluation.stored import read_judged

    return FIGURES[kind][1](*read_judged(folder))
