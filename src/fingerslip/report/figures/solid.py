"""The fingertip in 3D: views, a cut with its stress, and reference nodes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fingerslip.history import nearest_snapshot, site_kinds, sites_of_kinds
from fingerslip.report.colours import BLACK, BLUE, FIELD_MAP, ORANGE, STATE_COLOURS, STATE_NAMES, region_colours
from fingerslip.report.figures.deformed import snapshots_at
from fingerslip.report.figures.marks import event_keys, events_that_happen, mark_run
from fingerslip.report.figures.style import add_legend, columns_for, figure_grid, join_title, name_panel, with_style
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import COLOUR_MAP, field_limits, region_names
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import Events, slide_tangent, slide_window
from fingerslip.slip.windows import EVENTS

__all__ = [
    "crop",
    "cut_frames_figure",
    "reference_kinds",
    "reference_nodes_figure",
    "solid_views_figure",
    "view_times",
]


Pixels = NDArray[np.uint8]

_FRAMES = 6
_SIZE = (960, 660)
_PANEL = (3.2, 1.75)
_WHITE = 250


@with_style
def cut_frames_figure(
    history: xr.Dataset, events: Events | None = None, options: SceneOptions | None = None, title: str = ""
) -> Figure:
    """Draw the inside of the finger at six snapshots from the end of the press to after overall slip."""
    options = options or SceneOptions(cut="z", camera="side", receptors=False, written=False)
    numbers = _snapshots(history, events)
    heading = join_title("Stress on a cut along the finger", title)
    figure, panels = figure_grid(len(numbers), 3, _PANEL, heading, ("", ""), share="none")
    pictures = crop(stills(history, numbers, options, _SIZE))
    for axes, number, picture in zip(panels, numbers, pictures, strict=True):
        axes.imshow(picture)
        axes.set_axis_off()
        axes.set_title(f"{float(history['snapshot_time'][number]):.3f} s")
    if options.scalar != "region":
        colours = ScalarMappable(Normalize(*field_limits(history, options)), COLOUR_MAP)
        label = SCALARS[options.scalar][0]
        figure.colorbar(colours, ax=panels, label=label, extend="max", shrink=0.8, pad=0.01)
    return figure


def crop(pictures: Iterable[Pixels]) -> list[Pixels]:
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


_SIZE_SOLID_VIEWS = (1200, 900)


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


@with_style
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
    numbers = snapshots_at(history, view_times(history, events) if times is None else dict.fromkeys(times, ""))
    pictures = crop(stills(history, list(numbers), options, _SIZE_SOLID_VIEWS))
    columns, ratio = columns_for(len(numbers)), pictures[0].shape[0] / pictures[0].shape[1]
    heading = join_title(f"Deformed body, {SCALARS[options.scalar][0].partition(' [')[0]}", title)
    width = 3.2 if columns > 1 else 6.0
    figure, panels = figure_grid(len(numbers), columns, (width, width * ratio + 0.35), heading, ("", ""), share="none")
    for axes, picture, name in zip(panels, pictures, numbers.values(), strict=True):
        axes.imshow(picture)
        axes.set_axis_off()
        name_panel(axes, name, columns)
    keys: dict[str, Artist] = {}
    if options.scalar == "region":
        colour_of_region = region_colours(region_names(history))
        keys = {
            name: Patch(facecolor=colour, edgecolor=BLACK, linewidth=0.3) for name, colour in colour_of_region.items()
        }
    else:
        colours = ScalarMappable(Normalize(*field_limits(history, options)), FIELD_MAP)
        figure.colorbar(colours, ax=panels, label=SCALARS[options.scalar][0], extend="max", shrink=0.8, pad=0.01)
    if options.contact:
        keys |= {STATE_NAMES[state]: Patch(color=STATE_COLOURS[state]) for state in (1, 2)}
    add_legend(figure, keys)
    return figure


Floats = NDArray[np.float64]

_JERK = 0.05  # s
_COLUMNS = 4
# Darker than the lines, so that small letters can be read.
ORANGE_TEXT = "#8a5a00"


def reference_kinds(history: xr.Dataset) -> list[str]:
    """Return the kinds of the recorded reference nodes, those that end in ``surface``."""
    return [kind for kind in dict.fromkeys(map(str, site_kinds(history))) if kind.endswith("surface")]


@with_style
def reference_nodes_figure(history: xr.Dataset, events: Events | None = None, title: str = "") -> Figure:
    """Draw displacement and acceleration of the recorded reference nodes along the slide, a panel for each node.

    Units: returns [mm].
    """
    rows = sites_of_kinds(history, reference_kinds(history))
    labels = ("time [s]", "displacement along the slide [mm]")
    heading = join_title("Reference nodes along the slide", title)
    figure, panels = figure_grid(len(rows), _COLUMNS, (2.2, 1.35), heading, labels)
    tangent = slide_tangent(history)
    moved = 1e3 * history["displacement"].values @ tangent
    pushed = np.array(history["acceleration"].values @ tangent)
    plate = 1e3 * history["counterface_displacement"].values[:, 0] @ tangent
    pushed[_in_jerk(history)] = np.nan
    top = 1.3 * float(np.nanmax(np.abs(pushed[:, rows]), initial=0.0)) or 1.0
    for axes, row in zip(panels, rows, strict=True):
        axes.plot(history["time"], moved[:, row], color=BLUE)
        axes.plot(history["time"], plate, color=BLACK, linestyle=":", linewidth=1.0)
        axes.set_title(_name(history, int(row)))
        mark_run(axes, history, events.slip if events else None)
        right = _right_axis(axes, top, is_labelled=axes is panels[min(_COLUMNS, len(rows)) - 1])
        right.plot(history["time"], pushed[:, row], color=ORANGE, linewidth=0.7)
    reach = 1.2 * float(np.abs(moved[:, rows]).max()) or 1.0
    panels[0].set_ylim(*((-reach, 0.1 * reach) if plate.sum() < 0.0 else (-0.1 * reach, reach)))
    happening = event_keys(events_that_happen([events.slip] if events else ()))
    add_legend(figure, {**_keys(), **(happening if slide_window(history) else {})})
    return figure


def _name(history: xr.Dataset, row: int) -> str:
    """Return the name of a node, and the kind of surface on which it is."""
    kind = str(site_kinds(history)[row])
    return f"{str(history['site'].values[row]).rpartition('-')[2]}, {kind.removesuffix(' surface')}"


def _right_axis(axes: Axes, top: float, is_labelled: bool) -> Axes:
    """Return the axis of accelerations of a panel."""
    right: Axes = axes.twinx()
    right.set_ylim(-top, top)
    right.grid(visible=False)
    right.spines["right"].set_visible(True)
    right.tick_params(colors=ORANGE_TEXT, labelright=is_labelled)
    if is_labelled:
        right.set_ylabel("acceleration [m/s²]", color=ORANGE_TEXT)
    return right


def _keys() -> dict[str, Artist]:
    return {
        "displacement": Line2D([], [], color=BLUE),
        "plate": Line2D([], [], color=BLACK, linestyle=":", linewidth=1.0),
        "acceleration (without the jerk at the start)": Line2D([], [], color=ORANGE, linewidth=0.9),
    }


def _in_jerk(history: xr.Dataset) -> NDArray[np.bool_]:
    """Tell which records lie in the jerk at the start of the slide, whose accelerations are far larger than others."""
    window, times = slide_window(history), history["time"].values
    start = window.start if window else np.inf
    mask: NDArray[np.bool_] = (times >= start) & (times <= start + _JERK)
    return mask if not mask.all() else np.zeros_like(mask)
