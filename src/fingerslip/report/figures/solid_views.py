"""Lit views of a solid with a field, cut open or whole, at several times: small multiples with one colour bar."""

from __future__ import annotations

from collections.abc import Sequence

import xarray as xr
from matplotlib.artist import Artist
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from fingerslip.report.colours import BLACK, FIELD_MAP, STATE_COLOURS, STATE_NAMES, region_colours
from fingerslip.report.figures.cut import cropped
from fingerslip.report.figures.deformed import snapshots_at
from fingerslip.report.figures.style import add_legend, columns_for, figure_grid, name_panel, styled, titled
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import field_limits, region_names
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import Events, slide_window
from fingerslip.slip.names import EVENTS

__all__ = ["solid_views_figure", "view_times"]

_SIZE = (1200, 900)


def view_times(history: xr.Dataset, events: Events | None) -> dict[float, str]:
    """Return times to show [s] and what happens then: the start of the slide and the main events."""
    window = slide_window(history)
    if window is None:
        return {float(history["snapshot_time"].values[-1]): ""}
    named = {window.start: "start of slide"}
    for name in ("incipient", "overall"):
        time = events.slip.time(name) if events else None
        if time is not None:
            named[time] = EVENTS[name]
    return named


@styled
def solid_views_figure(
    history: xr.Dataset,
    events: Events | None = None,
    options: SceneOptions | None = None,
    times: Sequence[float] | None = None,
    title: str = "",
) -> Figure:
    """Draw views of a solid, a panel for each time.

    Units: times [s].
    """
    options = options or SceneOptions(cut="z", written=False)
    shown = snapshots_at(history, view_times(history, events) if times is None else dict.fromkeys(times, ""))
    pictures = cropped(stills(history, list(shown), options, _SIZE))
    columns, ratio = columns_for(len(shown)), pictures[0].shape[0] / pictures[0].shape[1]
    heading = titled(f"Deformed body, {SCALARS[options.scalar][0].partition(' [')[0]}", title)
    width = 3.2 if columns > 1 else 6.0
    figure, panels = figure_grid(len(shown), columns, (width, width * ratio + 0.35), heading, ("", ""), share="none")
    for axes, picture, name in zip(panels, pictures, shown.values(), strict=True):
        axes.imshow(picture)
        axes.set_axis_off()
        name_panel(axes, name, columns)
    keys: dict[str, Artist] = {}
    if options.scalar == "region":
        own = region_colours(region_names(history))
        keys = {name: Patch(facecolor=colour, edgecolor=BLACK, linewidth=0.3) for name, colour in own.items()}
    else:
        colours = ScalarMappable(Normalize(*field_limits(history, options)), FIELD_MAP)
        figure.colorbar(colours, ax=panels, label=SCALARS[options.scalar][0], extend="max", shrink=0.8, pad=0.01)
    if options.contact:
        keys |= {STATE_NAMES[state]: Patch(color=STATE_COLOURS[state]) for state in (1, 2)}
    add_legend(figure, keys)
    return figure
