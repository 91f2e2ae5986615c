"""The stress on a cut through the finger over time, as rendered pictures side by side."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fingerslip.report.figure_style import figure_grid, styled
from fingerslip.report.scene import SceneOptions
from fingerslip.report.viewer import stills
from fingerslip.slip import Events, slide_window

__all__ = ["cut_frames_figure"]

_FRAMES = 6
_SIZE = (640, 440)


@styled
def cut_frames_figure(
    history: xr.Dataset, events: Events | None = None, options: SceneOptions | None = None, title: str = ""
) -> Figure:
    """Draw the inside of the finger at six snapshots from the end of the press to after overall slip.

    Parameters
    ----------
    history : xarray.Dataset
        A history with snapshots.
    events : Events, optional
        Slip events; without overall slip the frames go up to the last snapshot.
    options : SceneOptions, optional
        What is shown; without it the von Mises stress on the plane along the finger, seen from the side.
    title : str, optional
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        A picture for each snapshot; they share one colour scale.
    """
    options = options or SceneOptions(cut="z", camera="side", receptors=False)
    places = _places(history, events)
    shown = title or "von Mises stress on a cut along the finger"
    figure, panels = figure_grid(len(places), 3, (3.2, 2.3), shown, ("", ""), share="none")
    for axes, place, picture in zip(panels, places, stills(history, places, options, _SIZE), strict=True):
        axes.imshow(picture)
        axes.set_axis_off()
        axes.set_title(f"{float(history['snapshot_time'][place]):.3f} s", fontsize=8.5)
    return figure


def _places(history: xr.Dataset, events: Events | None) -> list[int]:
    """Return the snapshots to draw, each once."""
    times = history["snapshot_time"].values
    window = slide_window(history)
    start = window.start if window else float(times[0])
    overall = events.overall if events else None
    end = float(times[-1]) if overall is None else min(float(times[-1]), overall + 0.1 * (overall - start))
    wanted = np.linspace(start, end, _FRAMES)
    return sorted({int(np.abs(times - moment).argmin()) for moment in wanted})
