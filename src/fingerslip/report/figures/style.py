"""One look for all figures: sizes, panels, legends, files; the axis of time and what is marked on it."""

from __future__ import annotations

import contextlib
import functools
import io
import math
import string
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FuncFormatter
from numpy.typing import NDArray
from PIL import Image

from fingerslip.contact.states import OPEN
from fingerslip.errors import InputError
from fingerslip.history import phase_times
from fingerslip.report.colours import (
    EVENT_COLOURS,
    EVENT_DASHES,
    FIELD_MAP,
    GREY,
    STATE_COLOURS,
    STATE_NAMES,
)
from fingerslip.slip import Events, SlideWindow, SlipEvents, slide_window
from fingerslip.slip.windows import EVENTS
from fingerslip.storage.files import write_bytes

_LEAST_WIDTH = 5.2  # inch
_KEY_WIDTH, _LETTER_WIDTH = 0.5, 0.07  # inch
_BESIDE_PANELS, _KEY_HEIGHT = 0.8, 0.19  # inch: of a figure what is not panels; a row of its legend
_WHITE = 250  # brightness of what is cut off pictures
_LEAST_HEIGHT = 1.0  # inch: of a panel that is scaled to the width of a column
_TITLE_LETTER_WIDTH, _PANEL_TITLE_LETTER_WIDTH, _LABEL_LETTER_WIDTH = 0.09, 0.08, 0.072  # inch
# Width and height of a panel by the number of columns [inch].
_RUN_PANELS = {1: (6.6, 3.0), 2: (3.8, 2.3), 3: (3.3, 2.3)}


@dataclass(frozen=True)
class Look:
    """How figures look in one kind of place."""

    width: float | None = None  # width of figures with several panels beside each other [inch]
    single: float | None = None  # width of figures with one panel beside each other [inch]
    letters: float = 1.0  # factor on the size of letters
    lines: float = 1.0  # factor on the width of lines and the size of marks
    titled: bool = True  # whether figures have a title
    lettered: bool = False  # whether panels have letters, for a caption


#: Looks by name: pages, journal columns of 3.5 and 7.2 inches, and slides of 13.3 inches with room for a heading.
LOOKS: Mapping[str, Look] = {
    "page": Look(),
    "paper": Look(width=7.2, single=3.5, letters=0.85, lines=0.8, titled=False, lettered=True),
    "slides": Look(width=12.0, single=9.0, letters=1.75, lines=1.7),
}
_look: ContextVar[Look] = ContextVar("look", default=LOOKS["page"])

P = ParamSpec("P")
R = TypeVar("R")


@functools.cache
def _style() -> Any:
    sheet = resources.files("fingerslip.report").joinpath("templates", "figures.mplstyle")
    with resources.as_file(sheet) as path:
        return mpl.rc_params_from_file(path, use_default_template=False)


def with_style(draw: Callable[P, R]) -> Callable[P, R]:
    """Run a drawing function under the style of this package, whatever the user's own settings are."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **values: P.kwargs) -> R:
        with mpl.rc_context():
            mpl.rcdefaults()
            look, style = _look.get(), _style()
            letters = {name: look.letters * size for name, size in style.items() if name.endswith("size")}
            lines = {name: look.lines * width for name, width in style.items() if name.endswith("width")}
            mpl.rcParams.update({**style, **letters, **lines, "lines.markersize": look.lines * 6.0})
            figure = draw(*args, **values)
            if isinstance(figure, Figure):
                _write_texts_as_they_are(figure)
            return figure

    return drawn


def _write_texts_as_they_are(figure: Figure) -> None:
    """Keep matplotlib from reading the dollars of titles and names as mathematics; numbers on axes keep theirs."""
    texts = [*figure.texts, *(text for legend in figure.legends for text in legend.get_texts())]
    for axes in figure.axes:
        texts += [artist for artist in axes.get_children() if isinstance(artist, Text)]
        legend = axes.get_legend()
        texts += legend.get_texts() if legend else []
        for axis in (axes.xaxis, axes.yaxis):
            texts.append(axis.label)
            # The formatters of given labels.
            if isinstance(axis.get_major_formatter(), FixedFormatter | FuncFormatter):
                texts += axis.get_ticklabels()
    for text in texts:
        text.set_parse_math(False)


@contextlib.contextmanager
def looking(name: str) -> Iterator[None]:
    """Draw figures with one of :data:`LOOKS` as long as the context lasts."""
    token = _look.set(LOOKS[name])
    try:
        yield
    finally:
        _look.reset(token)


def figure_grid(
    count: int,
    columns: int,
    panel: tuple[float, float],
    title: str,
    labels: tuple[str, str],
    *,
    share: str = "all",
    widths: Sequence[float] | None = None,
    heights: Sequence[float] | None = None,
    lettered: bool = True,
    full: bool = False,
) -> tuple[Figure, list[Axes]]:
    """Make a figure of `count` panels, each of a size [inch]; the lowest of every column has the horizontal label.

    A single column has the width of one in a journal, or the `full` width of a page.
    """
    wide = max(min(columns, count), 1)
    rows = max(math.ceil(count / wide), 1)
    look = _look.get()
    size = (max(wide * panel[0] + 0.6, _LEAST_WIDTH), rows * panel[1] + _BESIDE_PANELS)
    if (width := look.single if wide == 1 and not full else look.width) is not None:
        # Scaled to the width of the look.
        scale = (width - 0.6) / (wide * panel[0])
        size = (width, rows * max(panel[1] * scale, _LEAST_HEIGHT) + _BESIDE_PANELS * look.letters)
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    shared_x, shared_y = {"all": (True, True), "x": (True, False), "none": (False, False)}[share]
    ratios: dict[str, Any] = {"width_ratios": widths, "height_ratios": heights}
    grid = figure.subplots(rows, wide, sharex=shared_x, sharey=shared_y, squeeze=False, **ratios)
    panels: list[Axes] = list(np.asarray(grid).flat)
    for unused in panels[count:]:
        unused.set_visible(False)
    for lowest in panels[max(count - wide, 0) : count]:
        lowest.tick_params(labelbottom=True)
        lowest.set_xlabel(labels[0])
    # The label is as long as the panels, not the figure: the rest holds titles, ticks and the legend.
    room = size[1] - _BESIDE_PANELS * look.letters
    label = _wrap(labels[1], room / (look.letters * _LABEL_LETTER_WIDTH))
    figure.supylabel(label, fontsize=mpl.rcParams["axes.labelsize"])
    if lettered and count > 1:
        letter_panels(panels[:count])
    if look.titled:
        figure.suptitle(_wrap(title, size[0] / (look.letters * _TITLE_LETTER_WIDTH)), x=0.01, ha="left")
    return figure, panels[:count]


def letter_panels(panels: Sequence[Axes]) -> None:
    """Write a, b, c and on at the top left of panels, outside of them, where the look has letters."""
    for letter, axes in zip(string.ascii_lowercase if _look.get().lettered else "", panels, strict=False):
        look: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "right"}
        axes.annotate(letter, (0.0, 1.0), (-4.0, 4.0), fontweight="bold", va="bottom", **look)


def run_panels(titles: Sequence[str], title: str, labels: tuple[str, str]) -> tuple[Figure, list[Axes]]:
    """Make a figure with a panel for each run."""
    columns = columns_for(len(titles))
    figure, panels = figure_grid(len(titles), columns, _RUN_PANELS[columns], title, labels)
    for axes, name in zip(panels, titles, strict=True):
        name_panel(axes, name, columns)
    return figure, panels


def name_panel(axes: Axes, title: str, columns: int) -> None:
    """Write the title of one of some panels beside each other, in as many lines as it needs."""
    figure = axes.get_figure(root=True)
    assert figure is not None  # panels are made with one
    width = (figure.get_figwidth() - 0.6) / columns
    axes.set_title(_wrap(title, width / (_look.get().letters * _PANEL_TITLE_LETTER_WIDTH)))


def _wrap(title: str, letters: float) -> str:
    return textwrap.fill(title, max(int(letters), 20), break_long_words=False)


def add_keys_inside(axes: Axes, **where: Any) -> None:
    """Put a legend into a panel where it covers least, on white so that lines behind it do not cross letters."""
    look = {"loc": "best", "frameon": True, "facecolor": "white", "edgecolor": "none", "framealpha": 1.0, **where}
    axes.legend(**look).set_zorder(6)


def note_below(axes: Axes, text: str) -> None:
    """Write a sentence below the horizontal label of the lowest panel."""
    figure = axes.get_figure(root=True)
    assert figure is not None  # panels are made with one
    wrapped = _wrap(text, (figure.get_figwidth() - 0.6) / (_look.get().letters * _LABEL_LETTER_WIDTH))
    label = axes.get_xlabel()
    axes.set_xlabel(f"{label}\n{wrapped}" if label else wrapped)


def say(axes: Axes, text: str, height: float = 0.5) -> None:
    """Write in the middle of a panel why nothing is drawn in it; `height` is a share of the panel's."""
    axes.text(0.5, height, text, transform=axes.transAxes, ha="center", color=GREY)


def columns_for(count: int) -> int:
    """Return how many panels of `count` go beside each other: at most three, and four as two by two."""
    return 2 if count == 4 else max(min(count, 3), 1)


def add_legend(figure: Figure, keys: Mapping[str, Artist]) -> None:
    """Put a legend below all panels, in as many columns as the width of the figure holds; none without keys.

    The figure grows by the rows behind the first, so that the panels keep their height.
    """
    if not keys:
        return
    widths = [_look.get().letters * (_KEY_WIDTH + _LETTER_WIDTH * len(name)) for name in keys]
    columns = len(widths)
    # The widest keys of all columns have to fit, filled column by column as matplotlib shares keys out.
    while columns > 1 and sum(float(part.max()) for part in np.array_split(widths, columns)) > figure.get_figwidth():
        columns -= 1
    rows, row = math.ceil(len(keys) / columns), _KEY_HEIGHT * _look.get().letters
    figure.set_figheight(figure.get_figheight() + (rows - 1) * row)
    # The label of the vertical axes stays in the middle of what is above the legend.
    middle = 0.5 + 0.5 * rows * row / figure.get_figheight()
    figure.supylabel(figure.get_supylabel(), y=middle, fontsize=mpl.rcParams["axes.labelsize"])
    figure.legend(list(keys.values()), list(keys), loc="outside lower left", ncols=columns, columnspacing=1.4)


def layer_keys(colours: Mapping[str, str], edge: str, **look: Any) -> dict[str, Artist]:
    """Return keys of layers for a legend."""
    return {name: Patch(facecolor=colour, edgecolor=edge, **look) for name, colour in colours.items()}


def state_keys(states: Sequence[int]) -> dict[str, Artist]:
    """Return keys of states of the contact for a legend."""
    colours = {state: STATE_COLOURS[state] for state in states}
    # What is open is as white as the page.
    edges = colours | dict.fromkeys({OPEN} & colours.keys(), "#999999")
    return {STATE_NAMES[state]: Patch(facecolor=colours[state], edgecolor=edges[state]) for state in states}


def add_field_bar(figure: Figure, panels: Sequence[Axes], label: str, limits: tuple[float, float]) -> None:
    """Put a bar of the colours of a field beside panels."""
    colours = ScalarMappable(Normalize(*limits), FIELD_MAP)
    figure.colorbar(colours, ax=list(panels), label=label, extend="max", shrink=0.8, pad=0.01)


def crop(pictures: Iterable[NDArray[np.uint8]]) -> list[NDArray[np.uint8]]:
    """Cut the white margins off pictures (height, width, 3) of one size, the same off all of them."""
    whole = list(pictures)
    inked = np.any([(picture < _WHITE).any(axis=2) for picture in whole], axis=0)
    rows, columns = np.flatnonzero(inked.any(axis=1)), np.flatnonzero(inked.any(axis=0))
    if rows.size == 0:
        return whole
    return [picture[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] for picture in whole]


def show_picture(axes: Axes, picture: NDArray[np.uint8], title: str = "") -> None:
    """Fill a panel with a picture."""
    axes.imshow(picture)
    axes.set_axis_off()
    axes.set_title(title)


def join_title(title: str, more: str) -> str:
    """Join the title of a figure with what it is of, such as the title of a run."""
    return f"{title}: {more}" if more else title


_DOTS_PER_INCH = 150
_FEWEST_DOTS, _MOST_DOTS = 50, 1200
_ENDINGS = (".png", ".svg", ".pdf")
# Text that can be searched and edited: whole fonts, which journals ask for, and words instead of outlines.
_TEXT: Any = {"pdf.fonttype": 42, "svg.fonttype": "none"}


def figure_bytes(figure: Figure, kind: str = "png", dpi: int | None = None) -> bytes:
    """Render a figure."""
    stream = io.BytesIO()
    if kind == "png":
        # Drawn once: ``savefig`` draws twice, the first time only to find the layout. A report renders dozens of
        # figures: time counts more than the last kilobytes.
        canvas: Any = FigureCanvasAgg(figure)
        dots = dpi or _DOTS_PER_INCH
        figure.set_dpi(dots)
        canvas.draw()
        opaque = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])
        opaque.save(stream, "png", compress_level=2, dpi=(dots, dots))
    else:
        with mpl.rc_context(_TEXT):
            # Fields are pixels there too, for print.
            figure.savefig(stream, format=kind, dpi=dpi or 2 * _DOTS_PER_INCH)
    return stream.getvalue()


def picture_bytes(pictures: Iterable[NDArray[np.uint8]], ending: str) -> bytes:
    """Return a picture (height, width, 3) as a file of an ending such as ``.png``; several move, 80 ms each."""
    stream, (first, *others) = io.BytesIO(), map(Image.fromarray, pictures)
    moving: dict[str, Any] = {"save_all": True, "append_images": others, "duration": 80, "loop": 0}
    first.save(stream, Image.registered_extensions()[ending.lower()], **(moving if others else {}))
    return stream.getvalue()


def save_figure(figure: Figure, path: str | Path, dpi: int | None = None) -> None:
    """Save a figure, whole or not at all, with text that stays text.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        The figure.
    path : str or Path
        Where; its ending says the format, ``.png``, ``.svg`` or ``.pdf``. PDF has TrueType fonts, SVG words.
    dpi : int, optional
        Dots per inch: 150 of ``.png``, and 300 of fields in the others, without it. Journals ask for 300 to 600.

    Raises
    ------
    InputError
        For another ending, and for fewer than 50 or more than 1,200 dots, which would take gigabytes.
    ResultError
        Where the file cannot be written.

    Examples
    --------
    For a paper::

        fs.save_figure(fs.draw(history, style="paper"), "slip.pdf")
    """
    path = Path(path)
    if path.suffix.lower() not in _ENDINGS:
        raise InputError("save_figure", f"got '{path}'", f"needs a file that ends in {', '.join(_ENDINGS)}")
    if dpi is not None and not _FEWEST_DOTS <= dpi <= _MOST_DOTS:
        allowed = f"needs {_FEWEST_DOTS} to {_MOST_DOTS} dots per inch"
        raise InputError("save_figure.dpi", f"got {dpi}", allowed, "journals ask for 300 to 600")
    # The layout of panels to scale settles in a second pass, which a file is worth.
    figure.draw_without_rendering()
    write_bytes(path, figure_bytes(figure, path.suffix.removeprefix(".").lower(), dpi))


#: Of a run whose events are not known.
NO_EVENTS = Events()
_SLIDE = "slide starts"
_MARKED = tuple(EVENTS)
_DOTS = (0, (1, 1.5))
_LABEL_GAP = 0.4  # inch
_NAME_ABOVE = 4.0  # points, of the name of an event above its panel
_SHOWN_AFTER = 0.35  # of the time from the start of the slide to overall slip
# Records of steps that follow a hold grow apart by orders of magnitude, even ones by rounding.
_GROWTH = 20.0


@dataclass(frozen=True)
class ShownTime:
    """The time of a history's records as a figure shows it."""

    values: NDArray[np.float64]  # (n_times,), [s]
    logarithmic: bool = False  # whether the axis is
    since_hold: bool = False  # whether the time is counted from the start of a hold

    @property
    def label(self) -> str:
        """Label of the axis."""
        return "time since the hold began [s]" if self.since_hold else "time [s]"

    def fit(self, axes: Axes) -> None:
        """Give a panel its axis of time, from the first record that is shown to the last."""
        if self.logarithmic:
            axes.set_xscale("log")
        axes.set_xlim(np.nanmin(self.values), np.nanmax(self.values))


def shown_time(history: xr.Dataset) -> ShownTime:
    """Return the time that figures of a history show.

    It is logarithmic where the time between records grows twentyfold and more and nothing slides then: from the start
    of the last hold, or of the run where there is none.
    """
    times, holds = history["time"].values, phase_times(history, "hold")
    is_held = bool(holds) and all(end <= holds[-1][0] for _, end in phase_times(history, "slide"))
    since = times - (holds[-1][0] if is_held else 0.0)
    later = since > 1e-9 * times[-1]
    lengths = np.diff(since[later])
    if lengths.size < 2 or lengths.max() < _GROWTH * lengths.min():
        return ShownTime(times)
    return ShownTime(np.where(later, since, np.nan), logarithmic=True, since_hold=is_held)


def shown_times(histories: Iterable[xr.Dataset]) -> tuple[ShownTime, ...]:
    """Return the times of histories that share an axis: logarithmic where those of all are, from holds or from none."""
    histories = tuple(histories)
    time_axes = tuple(map(shown_time, histories))
    if all(time_axis.logarithmic for time_axis in time_axes) and len({axis.since_hold for axis in time_axes}) == 1:
        return time_axes
    return tuple(ShownTime(history["time"].values) for history in histories)


def is_held(history: xr.Dataset) -> bool:
    """Tell whether a counterface presses and nothing slides."""
    return bool(history.sizes.get("counterface", 0)) and not phase_times(history, "slide")


def event_times(events: SlipEvents, names: Iterable[str] = _MARKED) -> dict[str, float]:
    """Return the times of the named events that happened [s]."""
    times = {name: events.time(name) for name in names}
    return {name: time for name, time in times.items() if time is not None}


def mark_events(axes: Axes, events: SlipEvents, names: Iterable[str] = _MARKED) -> None:
    """Draw a vertical line at every event that happened, on a panel with time in seconds from left to right."""
    for name, time in event_times(events, names).items():
        axes.axvline(time, color=EVENT_COLOURS[name], linewidth=1.3, linestyle=(0, EVENT_DASHES[name]), zorder=4)


def mark_run(axes: Axes, history: xr.Dataset, events: SlipEvents, names: Iterable[str] = _MARKED) -> None:
    """Draw vertical lines at the start of a run's slide, and at its events where they are known."""
    window = slide_window(history)
    if window is not None:
        axes.axvline(window.start, color=GREY, linewidth=1.0, linestyle=_DOTS, zorder=3)
    mark_events(axes, events, names)


def mark_panels(
    panels: Sequence[Axes],
    history: xr.Dataset,
    events: SlipEvents,
    named: int = 1,
    names: Sequence[str] = _MARKED,
) -> None:
    """Mark a run in panels that have their axis of time, see :func:`mark_run`, and write the names above the first."""
    window = slide_window(history)
    for axes in panels:
        mark_run(axes, history, events, names)
    for axes in panels[:named]:
        name_events(axes, window.start if window else None, events, names)


def name_events(axes: Axes, start: float | None, events: SlipEvents, names: Iterable[str] = _MARKED) -> None:
    """Write the names of the marked events and of the start of the slide [s] above a panel.

    Each stands beside its line, or is led to it from beyond its neighbour; those beyond the panel have no name.
    """
    times = ({} if start is None else {_SLIDE: start}) | event_times(events, names)
    left, right = axes.get_xlim()
    figure, grid = axes.get_figure(root=True), axes.get_subplotspec()
    columns = grid.get_gridspec().ncols if grid else 1
    gap = _LABEL_GAP * columns / figure.get_figwidth() if figure else 0.0
    size = 0.94 * FontProperties(size=mpl.rcParams["legend.fontsize"]).get_size_in_points()
    reached = -np.inf
    for name, time in sorted(times.items(), key=lambda item: item[1]):
        if not left <= time <= right:
            continue
        fraction = (time - left) / (right - left)
        position = max(fraction, reached)
        reached = position + gap
        colour = EVENT_COLOURS.get(name, GREY)
        look: dict[str, Any] = {"fontsize": size, "color": colour, "rotation_mode": "anchor", "rotation": 32}
        look |= {"xycoords": "axes fraction", "textcoords": ("axes fraction", "offset points")}
        if position > fraction:
            leader = {"arrowstyle": "-", "relpos": (0.0, 0.0), "shrinkA": 0.0, "shrinkB": 0.0}
            look["arrowprops"] = {**leader, "color": colour, "linewidth": 0.7}
        axes.annotate(EVENTS.get(name, name), (fraction, 1.0), (position, _NAME_ABOVE), **look)


def limit_to_slides(
    axes: Axes,
    histories: Mapping[str, xr.Dataset],
    events: Mapping[str, Events],
    before: float = 0.06,
    marked: Iterable[SlipEvents] = (),
) -> None:
    """Show the slides of some runs until a while after overall slip; all panels that share the axis follow."""
    windows = [window for history in histories.values() if (window := slide_window(history)) is not None]
    end = shown_until(windows, [events.get(label, NO_EVENTS).slip for label in histories])
    if end is not None:
        start = min(window.start for window in windows)
        times = [time for events_read in marked for time in event_times(events_read).values()]
        end = max([end, *(time + before * (time - start) for time in times)])
        axes.set_xlim(max(0.0, start - before * (end - start)), end)


def shown_until(windows: Sequence[SlideWindow], events: Sequence[SlipEvents]) -> float | None:
    """Return the end of the time to show [s]: a while after the last overall slip, or the end of the slides."""
    if not windows:
        return None
    end, start = max(window.end for window in windows), min(window.start for window in windows)
    overall = [times.overall for times in events if times.overall is not None]
    if len(overall) < len(events):
        return end
    return min(end, max(overall) + _SHOWN_AFTER * (max(overall) - start))


def run_keys(
    histories: Mapping[str, xr.Dataset], events: Mapping[str, Events], names: Sequence[str] = _MARKED
) -> dict[str, Artist]:
    """Return keys for the lines that :func:`mark_run` draws from accumulated slip; none where nothing slides."""
    if all(slide_window(history) is None for history in histories.values()):
        return {}
    return event_keys((event.slip for event in events.values()), names)


def event_keys(events: Iterable[SlipEvents] | None = None, names: Sequence[str] = _MARKED) -> dict[str, Artist]:
    """Return keys of the marked lines for a legend: of events that happened in any of some runs, or of all events."""
    marked = set(names) if events is None else {name for each in events for name in event_times(each, names)}
    keys: dict[str, Artist] = {_SLIDE: Line2D([], [], color=GREY, linewidth=1.2, linestyle=_DOTS)}
    for name in (name for name in names if name in marked):
        keys[EVENTS[name]] = Line2D([], [], color=EVENT_COLOURS[name], linewidth=1.3, linestyle=(0, EVENT_DASHES[name]))
    return keys
