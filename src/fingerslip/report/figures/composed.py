"""One figure of a run on one axis of time: what the plate does, the contact, what afferents say, the forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import ConnectionPatch

from fingerslip.afferents.model import Spikes
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import is_solid, nearest_record, nearest_snapshot
from fingerslip.report.colours import GREY
from fingerslip.report.figures import style
from fingerslip.report.figures.bodies import add_stress_bar, draw_contact, has_pictures
from fingerslip.report.figures.patches import slide_moments
from fingerslip.report.figures.signals import (
    add_spike_notes,
    draw_forces,
    draw_raster,
    draw_ratios,
    draw_states,
    draw_stimulus,
    limit_to_slide,
)
from fingerslip.slip import Events
from fingerslip.slip.windows import EVENTS

_STIMULUS, _PICTURES, _STATES, _RASTER, _SERIES = 0.7, 1.7, 1.0, 0.8, 1.0  # inch
_WIDTH = 6.8  # inch
_PICTURES_SHOWN = 5


@style.with_style
def composed_figure(
    history: xr.Dataset,
    events: Events = style.NO_EVENTS,
    spikes: Spikes | None = None,
    title: str = "",
    times_shown: Sequence[float] = (),
    *,
    assumed: bool = False,
) -> Figure:
    """Draw stimulus, pictures of the contact, stick and slip, rasters and forces, all over the same time."""
    times, is_flat = history["time"].values, not is_solid(history)
    kinds = tuple(dict.fromkeys(spikes.kinds)) if spikes else ()
    moments = picture_times(history, events, times_shown) if has_pictures(history) else []
    heights = [_STIMULUS, _PICTURES, *[_STATES] * is_flat, *[_RASTER] * len(kinds), _SERIES, _SERIES]
    heights = [height for height in heights if moments or height != _PICTURES]
    shown = "Stimulus, contact, afferents and forces" if kinds else "Stimulus, contact and forces"
    heading = style.join_title(shown, title)
    size = (_WIDTH, float(np.mean(heights)))
    figure, panels = style.figure_grid(
        len(heights), 1, size, heading, ("time [s]", ""), share="x", heights=heights, lettered=False, full=True
    )
    stimulus, *others, forces, ratios = panels
    lettered = [stimulus]
    if moments:
        pictures = _draw_pictures(figure, others.pop(0), history, moments, below=others[0] if others else forces)
        lettered.append(pictures[0])
    if is_flat:
        draw_states(others[0], history, style.ShownTime(times))
        others[0].set_ylabel("contact\n[mm]")
        # Below: what leads from the pictures to their times is above, and every corner of the panel has contact.
        keys = style.state_keys((OPEN, STICK, SLIP))
        below: dict[str, Any] = {"loc": "upper right", "bbox_to_anchor": (1.0, -0.06), "borderaxespad": 0.0}
        others[0].legend(list(keys.values()), list(keys), ncols=3, **below)
    for axes, kind in zip(others[is_flat:], kinds, strict=True):
        assert spikes is not None  # kinds are theirs
        draw_raster(axes, spikes, history, kind)
    draw_forces(forces, history, times)
    draw_ratios(ratios, history, times)
    ratios.set_ylabel("ratio,\nfraction")
    for axes in (forces, ratios):
        if axes is ratios or others:
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), borderaxespad=0.0, ncols=3)
        else:  # what leads from the pictures to their times is there
            style.add_keys_inside(axes, ncols=2)
    ratios.set_xlim(times[0], times[-1])
    limit_to_slide(ratios, history)
    seen = times <= ratios.get_xlim()[1]
    draw_stimulus(stimulus, history.isel(time=seen), times[seen])
    style.mark_panels([stimulus, *others, forces, ratios], history, events.slip, names=tuple(EVENTS))
    style.letter_panels([*lettered, *others, forces, ratios])
    style.add_legend(figure, {} if is_flat else style.state_keys((STICK, SLIP)))
    if spikes and kinds:
        add_spike_notes(ratios, spikes, history, assumed=assumed)
    return figure


def picture_times(history: xr.Dataset, events: Events, wanted: Sequence[float] = ()) -> list[float]:
    """Return the times of pictures [s]: those wanted, or mid press and evenly from the slide's start on."""
    moments = slide_moments(history, events, _PICTURES_SHOWN - 1)
    nearest, name = (nearest_record, "time") if is_solid(history) else (nearest_snapshot, "snapshot_time")
    numbers = [nearest(history, float(moment)) for moment in wanted or (0.5 * moments[0], *moments)]
    return [float(history[name].values[number]) for number in dict.fromkeys(numbers)]


def _draw_pictures(figure: Figure, row: Axes, history: xr.Dataset, moments: Sequence[float], below: Axes) -> list[Axes]:
    """Draw pictures of the contact beside each other in the place of a panel, each led to its time below."""
    cell = row.get_subplotspec()
    assert cell is not None  # panels are made with one
    grid: Any = cell.subgridspec(1, len(moments))
    row.remove()
    pictures: list[Axes] = [figure.add_subplot(entry) for entry in grid]
    for axes, moment in zip(pictures, moments, strict=True):
        draw_contact(axes, history, moment, scaled=axes is pictures[-1])
        axes.set_title(f"{moment:.2f} s")
        ends = (0.5, 0.0), (moment, 1.0), axes.transAxes, below.get_xaxis_transform()
        line = ConnectionPatch(*ends, color=GREY, linewidth=0.7, zorder=1)
        line.set_in_layout(False)
        figure.add_artist(line)
    add_stress_bar(figure, pictures, history)
    return pictures
