"""One look for all figures: sizes, panels, legends, files; the axis of time and what is marked on it."""

from __future__ import annotations

import contextlib
import functools
import io
import itertools
import math
import string
import textwrap
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
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
from fingerslip.report import colours as palette
from fingerslip.slip import Events, SlideWindow, SlipEvents, slide_window
from fingerslip.slip.windows import EVENTS
from fingerslip.storage.files import write_bytes

_LEAST_WIDTH, _LEAST_HEIGHT = 5.2, 1.0  # inch: of a figure; of a panel that is scaled to the width of a column
_KEY_WIDTH, _LETTER_WIDTH = 0.5, 0.07  # inch
_BESIDE_PANELS, _KEY_HEIGHT = 0.8, 0.19  # inch: of a figure what is not panels; a row of its legend
_TITLE_LETTER_WIDTH, _PANEL_TITLE_LETTER_WIDTH, _LABEL_LETTER_WIDTH = 0.09, 0.08, 0.072  # inch


@dataclass(frozen=True)
class Look:
    """How figures look in one kind of place."""

    width: float | None = None  # width of figures with several panels beside each other [inch]
    single: float | None = None  # width of figures with one panel beside each other [inch]
    letters: float = 1.0  # factor on the size of letters
    lines: float = 1.0  # factor on the width of lines and the size of marks
    titled: bool = True  # whether figures have a title; without one their panels have letters, for a caption


#: Looks by name: pages, journal columns of 3.5 and 7.2 inches, and slides of 13.3 inches with room for a heading.
LOOKS: Mapping[str, Look] = {
    "page": Look(),
    "paper": Look(width=7.2, single=3.5, letters=0.85, lines=0.8, titled=False),
    "slides": Look(width=12.0, single=9.0, letters=1.75, lines=1.7),
}
_look: ContextVar[Look] = ContextVar("look", default=LOOKS["page"])

P = ParamSpec("P")
R = TypeVar("R")


with resources.as_file(resources.files("fingerslip.report") / "templates" / "figures.mplstyle") as _sheet:
    _STYLE: Any = mpl.rc_params_from_file(_sheet, use_default_template=False)


def with_style(draw: Callable[P, R]) -> Callable[P, R]:
    """Run a drawing function under the style of this package, whatever the user's own settings are."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **values: P.kwargs) -> R:
        with mpl.rc_context():
            mpl.rcdefaults()
            look = _look.get()
            letters = {name: look.letters * size for name, size in _STYLE.items() if name.endswith("size")}
            lines = {name: look.lines * width for name, width in _STYLE.items() if name.endswith("width")}
            mpl.rcParams.update({**_STYLE, **letters, **lines, "lines.markersize": look.lines * 6.0})
            figure = draw(*args, **values)
            if isinstance(figure, Figure):
                _write_texts_as_they_are(figure)
            return figure

    return drawn


def _write_texts_as_they_are(figure: Figure) -> None:
    """Keep matplotlib from reading the dollars of titles and names as mathematics; numbers on axes keep theirs."""
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes)]
    texts = [*figure.texts, *(text for legend in legends if legend for text in legend.get_texts())]
    for axes in figure.axes:
        texts += [artist for artist in axes.get_children() if isinstance(artist, Text)]
        for axis in (axes.xaxis, axes.yaxis):
            has_words = isinstance(axis.get_major_formatter(), FixedFormatter | FuncFormatter)
            texts += [axis.label, *(axis.get_ticklabels() if has_words else ())]
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
    label = _wrap(labels[1], (size[1] - _BESIDE_PANELS * look.letters) / (look.letters * _LABEL_LETTER_WIDTH))
    figure.supylabel(label, fontsize=mpl.rcParams["axes.labelsize"])
    if lettered and count > 1:
        letter_panels(panels[:count])
    if look.titled:
        figure.suptitle(_wrap(title, size[0] / (look.letters * _TITLE_LETTER_WIDTH)), x=0.01, ha="left")
    return figure, panels[:count]


def letter_panels(panels: Sequence[Axes]) -> None:
    """Write a, b, c and on at the top left of panels, outside of them, where the look has letters."""
    look: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "right", "va": "bottom"}
    for letter, axes in zip("" if _look.get().titled else string.ascii_lowercase, panels, strict=False):
        axes.annotate(letter, (0.0, 1.0), (-4.0, 4.0), fontweight="bold", **look)


def _widths(axes: Axes) -> tuple[float, int]:
    """Return the width of the figure of a panel [inch], and how many panels are beside each other in it."""
    figure, cell = axes.get_figure(root=True), axes.get_subplotspec()
    assert figure is not None  # panels are made with one
    return figure.get_figwidth(), cell.get_gridspec().ncols if cell else 1


def name_panel(axes: Axes, title: str) -> None:
    """Write the title of one of some panels beside each other, in as many lines as it needs."""
    width, columns = _widths(axes)
    axes.set_title(_wrap(title, (width - 0.6) / columns / (_look.get().letters * _PANEL_TITLE_LETTER_WIDTH)))


def _wrap(title: str, letters: float) -> str:
    return textwrap.fill(title, max(int(letters), 20), break_long_words=False)


def add_keys_inside(axes: Axes, **where: Any) -> None:
    """Put a legend into a panel where it covers least, on white so that lines behind it do not cross letters."""
    look = {"loc": "best", "frameon": True, "facecolor": "white", "edgecolor": "none", "framealpha": 1.0, **where}
    axes.legend(**look).set_zorder(6)


def note_below(axes: Axes, text: str) -> None:
    """Write a sentence below the horizontal label of the lowest panel."""
    wrapped = _wrap(text, (_widths(axes)[0] - 0.6) / (_look.get().letters * _LABEL_LETTER_WIDTH))
    axes.set_xlabel("\n".join(filter(None, (axes.get_xlabel(), wrapped))))


def say(axes: Axes, text: str, height: float = 0.5) -> None:
    """Write in the middle of a panel why nothing is drawn in it; `height` is a share of the panel's."""
    axes.text(0.5, height, text, transform=axes.transAxes, ha="center", color=palette.GREY)


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
    """Return keys of states of the contact for a legend; what is open is as white as the page, and has an edge."""
    colours = {state: palette.STATE_COLOURS[state] for state in states}
    return {
        palette.STATE_NAMES[state]: Patch(facecolor=colour, edgecolor="#999999" if state == OPEN else colour)
        for state, colour in colours.items()
    }


def crop(pictures: Iterable[NDArray[np.uint8]]) -> list[NDArray[np.uint8]]:
    """Cut the white margins off pictures (height, width, 3) of one size, the same off all of them."""
    whole = list(pictures)
    inked = np.any([(picture < 250).any(axis=2) for picture in whole], axis=0)  # of 255, which is white
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


_ENDINGS, _DOTS_PER_INCH, _FEWEST_DOTS, _MOST_DOTS = (".png", ".svg", ".pdf"), 150, 50, 1200


def pixels(figure: Figure) -> NDArray[np.uint8]:
    """Draw a figure once, and return it as a picture (height, width, 3)."""
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def figure_bytes(figure: Figure, kind: str = "png", dpi: int | None = None) -> bytes:
    """Render a figure."""
    stream = io.BytesIO()
    if kind == "png":
        # Drawn once, where ``savefig`` draws twice, and packed quickly: a report renders dozens of figures.
        dots = dpi or _DOTS_PER_INCH
        figure.set_dpi(dots)
        Image.fromarray(pixels(figure)).save(stream, "png", compress_level=2, dpi=(dots, dots))
    else:
        # Text can be searched and edited: whole fonts, which journals ask for, and words. Fields are pixels, for print.
        with mpl.rc_context({"pdf.fonttype": 42, "svg.fonttype": "none"}):
            figure.savefig(stream, format=kind, dpi=dpi or 2 * _DOTS_PER_INCH)
    return stream.getvalue()


def final_bytes(figure: Figure) -> bytes:
    """Render a figure that stays as it is, some per cent faster: labels without text have their places."""
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) if not axis.get_label_text()):
        axis.set_label_coords(0.5, 0.5)
    return figure_bytes(figure)


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
_LABEL_GAP, _NAME_ABOVE = 0.4, 4.0  # between names of events [inch], and from their panel up to them [points]
_SHOWN_AFTER = 0.35  # of the time from the start of the slide to overall slip
# Records of steps that follow a hold grow apart by orders of magnitude, even ones by rounding.
_GROWTH = 20.0


@dataclass(frozen=True)
class ShownTime:
    """The time of a history's records as a figure shows it."""

    values: NDArray[np.float64]  # (n_times,), [s]
    logarithmic: bool = False  # whether the axis is
    label: str = "time [s]"  # of the axis

    def fit(self, axes: Axes) -> None:
        """Give a panel its axis of time, from the first record that is shown to the last."""
        if self.logarithmic:
            axes.set_xscale("log")
        axes.set_xlim(np.nanmin(self.values), np.nanmax(self.values))


def shown_time(history: xr.Dataset) -> ShownTime:
    """Return the time that figures of a history show.

    Where records grow twentyfold apart and nothing slides it is logarithmic, from the last hold or the start.
    """
    times, holds = history["time"].values, phase_times(history, "hold")
    is_held = bool(holds) and all(end <= holds[-1][0] for _, end in phase_times(history, "slide"))
    since = times - (holds[-1][0] if is_held else 0.0)
    later = since > 1e-9 * times[-1]
    lengths = np.diff(since[later])
    if lengths.size < 2 or lengths.max() < _GROWTH * lengths.min():
        return ShownTime(times)
    return ShownTime(np.where(later, since, np.nan), True, "time since the hold began [s]" if is_held else "time [s]")


def shown_times(histories: Collection[xr.Dataset]) -> tuple[ShownTime, ...]:
    """Return the times of histories that share an axis: logarithmic where those of all are, from holds or from none."""
    times = tuple(map(shown_time, histories))
    if all(time.logarithmic for time in times) and len({time.label for time in times}) == 1:
        return times
    return tuple(ShownTime(history["time"].values) for history in histories)


def event_times(events: SlipEvents, names: Iterable[str] = tuple(EVENTS)) -> dict[str, float]:
    """Return the times of the named events that happened [s]."""
    return {name: time for name in names if (time := events.time(name)) is not None}


def times_near(history: xr.Dataset, moments: Iterable[float], axis: str) -> list[float]:
    """Return the times [s] of records or snapshots nearest to times [s], each once."""
    times = history[axis].values
    return list(dict.fromkeys(float(times[np.abs(times - moment).argmin()]) for moment in moments))


def titles_at(history: xr.Dataset, moments: Mapping[float, str], axis: str) -> dict[int, str]:
    """Return the records or snapshots nearest to times [s], each once: their own times, how far from what happens."""
    times, titles = history[axis].values, dict[int, str]()
    for moment, words in moments.items():
        number = int(np.abs(times - moment).argmin())
        time, apart = times[number], round(1e3 * float(times[number] - moment))
        away = f"{abs(apart)} ms {'before' if apart < 0 else 'after'} {words or f'{moment:.3f} s'}" if apart else words
        titles[number] = ", ".join(filter(None, (titles.get(number, f"{time:.3f} s"), away)))
    return titles


def mark_panels(
    panels: Sequence[Axes], history: xr.Dataset | None, events: SlipEvents, named: int = 1, rasters: Sequence[Axes] = ()
) -> None:
    """Draw lines at events and the start of a slide in panels over time, pale and behind spikes; name them above."""
    window = None if history is None else slide_window(history)
    times = ({_SLIDE: window.start} if window else {}) | event_times(events)
    for axes, (name, time) in itertools.product(panels, times.items()):
        behind = {"linewidth": 0.7, "alpha": 0.4, "zorder": 1}
        look = behind if axes in rasters else {"zorder": 4 if name in EVENTS else 3}
        axes.axvline(time, **(_line_look(name) | look))
    for axes in panels[:named]:
        _name_times(axes, times)


def _line_look(name: str) -> dict[str, Any]:
    """Return how the line of an event looks, or that of the start of the slide."""
    if name == _SLIDE:
        return {"color": palette.GREY, "linewidth": 1.0, "linestyle": (0, (1, 1.5))}
    return {"color": palette.EVENT_COLOURS[name], "linewidth": 1.3, "linestyle": (0, palette.EVENT_DASHES[name])}


def _name_times(axes: Axes, times: Mapping[str, float]) -> None:
    """Write the names of times [s] above a panel: each beside its line, or led to it from beyond its neighbour."""
    (left, right), (width, columns) = axes.get_xlim(), _widths(axes)
    size = 0.94 * FontProperties(size=mpl.rcParams["legend.fontsize"]).get_size_in_points()
    reached = -np.inf
    for name, time in sorted(times.items(), key=lambda item: item[1]):
        if not left <= time <= right:
            continue
        fraction = (time - left) / (right - left)
        position = max(fraction, reached)
        reached = position + _LABEL_GAP * columns / width
        colour = palette.EVENT_COLOURS.get(name, palette.GREY)
        look: dict[str, Any] = {"fontsize": size, "color": colour, "rotation_mode": "anchor", "rotation": 32}
        look |= {"xycoords": "axes fraction", "textcoords": ("axes fraction", "offset points")}
        if position > fraction:
            leader = {"arrowstyle": "-", "relpos": (0.0, 0.0), "shrinkA": 0.0, "shrinkB": 0.0, "patchA": None}
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
    if windows:
        start, end = shown_span(windows, [events.get(label, NO_EVENTS).slip for label in histories])
        times = [time for events_read in marked for time in event_times(events_read).values()]
        end = max([end, *(time + before * (time - start) for time in times)])
        axes.set_xlim(max(0.0, start - before * (end - start)), end)


def shown_span(windows: Sequence[SlideWindow], events: Sequence[SlipEvents]) -> tuple[float, float]:
    """Return the time to show [s]: from the first slide to a while after the last overall slip, or its end."""
    start, end = min(window.start for window in windows), max(window.end for window in windows)
    overall = [times.overall for times in events if times.overall is not None]
    if len(overall) < len(events):
        return start, end
    return start, min(end, max(overall) + _SHOWN_AFTER * (max(overall) - start))


def event_keys(events: Iterable[SlipEvents]) -> dict[str, Artist]:
    """Return keys of the marked lines for a legend: of the start of the slide, and of events that any run has."""
    happened = {name for each in events for name in event_times(each)}
    keys: dict[str, Artist] = {_SLIDE: Line2D([], [], **{**_line_look(_SLIDE), "linewidth": 1.2})}
    return keys | {EVENTS[name]: Line2D([], [], **_line_look(name)) for name in EVENTS if name in happened}
