"""The figure of the stress on a cut through the finger over time, rendered pictures side by side."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingerslip.history import nearest_snapshot
from fingerslip.report.figures.style import figure_grid, styled, titled
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import COLOUR_MAP, field_limits
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import Events, slide_window

__all__ = ["cropped", "cut_frames_figure"]

Pixels = NDArray[np.uint8]

_FRAMES = 6
_SIZE = (960, 660)
_PANEL = (3.2, 1.75)
_WHITE = 250


@styled
def cut_frames_figure(
    history: xr.Dataset, events: Events | None = None, options: SceneOptions | None = None, title: str = ""
) -> Figure:
    """Draw the inside of the finger at six snapshots from the end of the press to after overall slip."""
    options = options or SceneOptions(cut="z", camera="side", receptors=False, written=False)
    numbers = _snapshots(history, events)
    shown = titled("Stress on a cut along the finger", title)
    figure, panels = figure_grid(len(numbers), 3, _PANEL, shown, ("", ""), share="none")
    pictures = cropped(stills(history, numbers, options, _SIZE))
    for axes, number, picture in zip(panels, numbers, pictures, strict=True):
        axes.imshow(picture)
        axes.set_axis_off()
        axes.set_title(f"{float(history['snapshot_time'][number]):.3f} s")
    if options.scalar != "region":
        colours = ScalarMappable(Normalize(*field_limits(history, options)), COLOUR_MAP)
        label = SCALARS[options.scalar][0]
        figure.colorbar(colours, ax=panels, label=label, extend="max", shrink=0.8, pad=0.01)
    return figure


def cropped(pictures: Iterable[Pixels]) -> list[Pixels]:
    """Cut the white margins off pictures of one size, the same off all of them.

    Arrays: pictures (height, width, 3); returns (h, w, 3).
    """
    whole = list(pictures)
    inked = np.any([(picture < _WHITE).any(axis=2) for picture in whole], axis=0)
    rows, columns = np.flatnonzero(inked.any(axis=1)), np.flatnonzero(inked.any(axis=0))
    if rows.size == 0:
        return whole
    return [picture[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] for picture in whole]


def _snapshots(history: xr.Dataset, events: Events | None) -> list[int]:
    """Return the numbers of the snapshots to draw, each once."""
    times = history["snapshot_time"].values
    window = slide_window(history)
    start = window.start if window else float(times[0])
    overall = events.overall if events else None
    end = float(times[-1]) if overall is None else min(float(times[-1]), overall + 0.1 * (overall - start))
    return sorted({nearest_snapshot(history, moment) for moment in np.linspace(start, end, _FRAMES)})
