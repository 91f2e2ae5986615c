"""One look for all figures: sizes, panels and legends; the colours are those of :mod:`fingerslip.report.colours`."""

from __future__ import annotations

import contextlib
import functools
import io
import math
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FuncFormatter
from numpy.typing import NDArray

from fingerslip.report.colours import BLACK, FIELD_MAP, GREY, STATE_COLOURS, STATE_NAMES, region_colours
from fingerslip.storage.files import write_bytes

_LEAST_WIDTH = 5.2  # inch
_KEY_WIDTH, _LETTER_WIDTH = 0.5, 0.07  # inch
_BESIDE_PANELS, _KEY_HEIGHT = 0.8, 0.19  # inch: of a figure what is not panels; a row of its legend
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


#: Looks by name: pages, journal columns of 3.5 and 7.2 inches, and slides of 13.3 inches with room for a heading.
LOOKS: Mapping[str, Look] = MappingProxyType(
    {
        "page": Look(),
        "paper": Look(width=7.2, single=3.5, letters=0.85, lines=0.8, titled=False),
        "slides": Look(width=12.0, single=9.0, letters=1.75, lines=1.7),
    }
)
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
) -> tuple[Figure, list[Axes]]:
    """Make a figure of `count` panels, each of a size [inch]; the lowest of every column has the horizontal label."""
    wide = max(min(columns, count), 1)
    rows = max(math.ceil(count / wide), 1)
    look = _look.get()
    size = (max(wide * panel[0] + 0.6, _LEAST_WIDTH), rows * panel[1] + _BESIDE_PANELS)
    if (width := look.single if wide == 1 else look.width) is not None:
        # Scaled to the width of the look.
        scale = (width - 0.6) / (wide * panel[0])
        size = (width, rows * max(panel[1] * scale, _LEAST_HEIGHT) + _BESIDE_PANELS * look.letters)
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    shared_x, shared_y = {"all": (True, True), "x": (True, False), "none": (False, False)}[share]
    grid = figure.subplots(rows, wide, sharex=shared_x, sharey=shared_y, squeeze=False, width_ratios=widths)
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
    if look.titled:
        figure.suptitle(_wrap(title, size[0] / (look.letters * _TITLE_LETTER_WIDTH)), x=0.01, ha="left")
    return figure, panels[:count]


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


def region_keys(names: Sequence[str]) -> dict[str, Artist]:
    """Return keys of layers for a legend."""
    colours = region_colours(names)
    return {name: Patch(facecolor=colour, edgecolor=BLACK, linewidth=0.3) for name, colour in colours.items()}


def state_keys(states: Sequence[int]) -> dict[str, Artist]:
    """Return keys of states of the contact for a legend."""
    return {STATE_NAMES[state]: Patch(color=STATE_COLOURS[state]) for state in states}


def add_field_bar(figure: Figure, panels: Sequence[Axes], label: str, limits: tuple[float, float]) -> None:
    """Put a bar of the colours of a field beside panels."""
    colours = ScalarMappable(Normalize(*limits), FIELD_MAP)
    figure.colorbar(colours, ax=list(panels), label=label, extend="max", shrink=0.8, pad=0.01)


def show_picture(axes: Axes, picture: NDArray[np.uint8], title: str = "") -> None:
    """Fill a panel with a picture."""
    axes.imshow(picture)
    axes.set_axis_off()
    axes.set_title(title)


def join_title(title: str, more: str) -> str:
    """Join the title of a figure with what it is of, such as the title of a run."""
    return f"{title}: {more}" if more else title


_DOTS_PER_INCH = 150
# Text that can be searched and edited: whole fonts, which journals ask for, and words instead of outlines.
_TEXT: Any = {"pdf.fonttype": 42, "svg.fonttype": "none"}


def figure_bytes(figure: Figure, kind: str = "png") -> bytes:
    """Render a figure."""
    stream = io.BytesIO()
    if kind == "png":
        # Drawn once: ``savefig`` draws twice, the first time only to find the layout. A report renders dozens of
        # figures: time counts more than the last kilobytes.
        write: Any = FigureCanvasAgg(figure).print_png
        figure.set_dpi(_DOTS_PER_INCH)
        write(stream, pil_kwargs={"compress_level": 2})
    else:
        with mpl.rc_context(_TEXT):
            figure.savefig(stream, format=kind, dpi=_DOTS_PER_INCH)
    return stream.getvalue()


def save_figure(figure: Figure, path: str | Path) -> None:
    """Save a figure, whole or not at all, to a path whose ending says the format: ``.png``, ``.svg`` or ``.pdf``."""
    path = Path(path)
    write_bytes(path, figure_bytes(figure, path.suffix.removeprefix(".").lower()))
