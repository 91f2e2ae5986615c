"""Figures of reactions: critical latencies over friction and rate of the load, what a latency costs; and their page."""

from __future__ import annotations

import base64
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from itertools import cycle
from pathlib import Path
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from fingerslip.arrays import Flags, Floats
from fingerslip.contact.states import SLIP, STICK
from fingerslip.react.results import FILM, STILL, Reactions, answer, cell_table, paper_table, source_table, trial_table
from fingerslip.react.settings import ReactionSettings
from fingerslip.report.citations import bibtex_entries
from fingerslip.report.colours import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, STATE_COLOURS, VERMILLION
from fingerslip.report.content import ReportContent
from fingerslip.report.figures.style import add_legend, figure_grid, name_panel, with_style
from fingerslip.report.page.assemble import uncertainty_section
from fingerslip.report.page.page import Picture, Report, ReportSection
from fingerslip.report.tables.parameters import value_tables
from fingerslip.tables.table import Table

_PANEL, _PANEL_OF_LINES = (2.6, 2.2), (3.6, 2.8)  # inch
_MAP_COLOURS = "cividis"
_LEAST = 10e-3  # [s], the dark end of the colours
_TICKS = (10e-3, 30e-3, 100e-3, 300e-3)
# Frontiers on the map, of up to three reactions: what is to the right of one is too fast for that reaction.
# Where they share an edge, the thinner lie on the wider.
_FRONTIERS: tuple[dict[str, Any], ...] = (
    {"color": GREEN, "linestyle": "solid", "linewidth": 5.0},
    {"color": VERMILLION, "linestyle": "solid", "linewidth": 2.5},
    {"color": BLACK, "linestyle": (0, (3, 2)), "linewidth": 1.2},
)
# Lines at the delays of up to five reactions beside latencies.
_REACTIONS: Sequence[Any] = [
    {"color": colour, "linestyle": dashes, "linewidth": 0.9, "zorder": 1}
    for colour, dashes in ((GREY, "solid"), (BLACK, "dashed"), (GREY, "dashed"), (BLACK, "dotted"), (GREY, "dashdot"))
]
_DOT: dict[str, Any] = {"marker": "o", "markersize": 4.0, "markeredgecolor": "white", "color": VERMILLION}
_LOWEST = 4.0  # [ms], the lower end of the axis of critical latencies
# Lines that cover each other are ever thinner, so that all can be seen. Looks are cycled through by numbers without a
# common factor: the first 21 panels and 20 detectors differ.
_PANEL_COLOURS, _PANEL_WIDTHS = (BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY, BLACK), (2.2, 1.4, 0.8)
_DASHES: Sequence[Any] = ("solid", (0, (5, 2)), (0, (1.2, 1.4)), (0, (5, 1.5, 1, 1.5)))
_MARKERS = ("o", "s", "^", "D", "v")


@with_style
def map_figure(reactions: Reactions, *, saves: Mapping[str, Flags] = MappingProxyType({})) -> Figure:
    """Draw the longest latency after the first alarm that saves the object, over friction and rate of the load.

    A dot marks what another controller saves, by its name, (n_frictions, n_rates).
    """
    detector = reactions.settings.detector
    latencies, delays = reactions.panels(detector), _delays(reactions.settings)
    finite = np.concatenate([values[np.isfinite(values)] for values in latencies.values()])
    largest = max(float(finite.max(initial=_LEAST)), 2 * _LEAST)
    colours = ScalarMappable(LogNorm(_LEAST, largest), _MAP_COLOURS)
    rate = reactions.settings.actuator.force_rate
    title = f"Longest latency after '{detector}' that saves the object, with a grip that rises at {rate:g} N/s"
    labels = ("rate of the load [N/s]", "friction coefficient [-]")
    figure, panels = figure_grid(len(latencies), 3, _PANEL, title, labels)
    for axes, (heading, values) in zip(panels, latencies.items(), strict=True):
        _draw_cells(axes, values, colours)
        for delay, look in zip(delays.values(), _FRONTIERS, strict=False):
            _draw_frontier(axes, 1e3 * values >= delay, **look)
        for saved in saves.values():
            rows, columns = np.nonzero(saved)
            axes.plot(columns, rows - 0.28, linestyle="none", **_DOT)
        axes.set_title(heading)
        axes.set_xticks(range(len(reactions.load_rates)), [f"{rate:g}" for rate in reactions.load_rates])
        axes.set_yticks(range(len(reactions.frictions)), [f"{friction:g}" for friction in reactions.frictions])
        _only_cells(axes)
    bar = figure.colorbar(colours, ax=panels, label="critical latency [ms]", shrink=0.9, pad=0.01, extend="min")
    ticks = [tick for tick in _TICKS if tick <= largest]
    bar.set_ticks(ticks, labels=[f"{1e3 * tick:g}" for tick in ticks])
    bar.minorticks_off()
    keys: dict[str, Artist] = {}
    for (name, delay), look in zip(delays.items(), _FRONTIERS, strict=False):
        saved = np.concatenate([1e3 * values.ravel() >= delay for values in latencies.values()])
        has_line = saved.any() and not saved.all()
        which = "the objects to the left" if has_line else "all" if saved.any() else "none"
        keys[f"{name}, {delay:.0f} ms: saves {which}"] = Line2D([], [], **(look if has_line else {"linestyle": "none"}))
    keys |= {f"{name} saves it": Line2D([], [], linestyle="none", **_DOT) for name in saves}
    if any(np.isnan(values).any() for values in latencies.values()):
        keys["– no latency is short enough"] = Line2D([], [], linestyle="none")
    add_legend(figure, keys)
    return figure


def _delays(settings: ReactionSettings) -> dict[str, float]:
    """Return the delays after an alarm of reactions that are tried [ms]: first the study's own, then some."""
    tried, first = settings.named_reactions, ("this reflex", "robot-piezo", "human-slip", "servo", "prosthesis")
    names = [
        name for name in {**dict.fromkeys(first), **tried} if name in tried and tried[name].reflex.since == "alarm"
    ]
    return {name: 1e3 * tried[name].delay for name in names}


def _only_cells(axes: Axes) -> None:
    """Leave out what coloured cells need not: ticks, grid and frame."""
    axes.tick_params(length=0.0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)


def _draw_cells(axes: Axes, values: Floats, colours: ScalarMappable) -> None:
    """Draw critical latencies (n_frictions, n_rates) [s] as cells that say them in ms; NaN where none saves."""
    bounded = np.where(np.isnan(values), _LEAST / 10, np.minimum(values, 1e3))
    lightness: Floats = np.asarray(colours.norm(bounded), dtype=np.float64)
    axes.imshow(colours.to_rgba(bounded), origin="lower", aspect="auto")
    size = max(0.8 * mpl.rcParams["ytick.labelsize"], 6.0)  # journals print none smaller
    for (row, column), value in np.ndenumerate(values):
        text = "–" if np.isnan(value) else "∞" if np.isinf(value) else f"{1e3 * value:.0f}"
        colour = "white" if lightness[row, column] < 0.5 else BLACK
        axes.text(column, row, text, ha="center", va="center", fontsize=size, color=colour)


def _draw_frontier(axes: Axes, saved: Flags, **look: Any) -> None:
    """Draw the edge between cells that are saved and those that are not, (n_frictions, n_rates)."""
    style: dict[str, Any] = {**look, "solid_capstyle": "butt"}
    for row, column in np.argwhere(saved[:, :-1] != saved[:, 1:]):
        axes.plot([column + 0.5] * 2, [row - 0.5, row + 0.5], **style)
    for row, column in np.argwhere(saved[:-1] != saved[1:]):
        axes.plot([column - 0.5, column + 0.5], [row + 0.5] * 2, **style)


@with_style
def margin_figure(reactions: Reactions) -> Figure:
    """Draw critical latency against rate of the load at the friction of the centre, and travel against latencies."""
    settings, result = reactions.settings, reactions.result
    others = "; others: see the map" if len(reactions.frictions) > 1 else ""
    title = f"Friction {result.friction:g}, {1e3 * settings.mass:g} g{others}"
    count = 2 if result.travels else 1  # without latencies nothing is known of travels
    figure, (rates, *rest) = figure_grid(count, 2, _PANEL_OF_LINES, "What a latency costs", ("", ""), share="none")
    name_panel(rates, title)
    row = reactions.frictions.index(result.friction)
    keys: dict[str, Artist] = {}
    for detector, dashes, marker in zip(settings.detectors, cycle(_DASHES), cycle(_MARKERS), strict=False):
        looks = zip(cycle(_PANEL_COLOURS), cycle(_PANEL_WIDTHS), strict=False)
        for (heading, values), (colour, width) in zip(reactions.panels(detector).items(), looks, strict=False):
            look: dict[str, Any] = {"color": colour, "marker": marker, "markersize": 1.0 + 2.0 * width}
            look["linewidth"] = width * mpl.rcParams["lines.linewidth"]
            rates.plot(reactions.load_rates, 1e3 * values[row], linestyle=dashes, **look)
            if heading:
                keys.setdefault(heading, Line2D([], [], **look))
        keys[f"after '{detector}'"] = Line2D([], [], color=GREY if heading else colour, linestyle=dashes, marker=marker)
    delays = dict(zip(_delays(settings).items(), _REACTIONS, strict=False))
    _finish_rates(rates, reactions.load_rates, max((delay for _, delay in delays), default=_LOWEST))
    for travels in rest:
        latencies, ways = 1e3 * np.array(list(result.travels)), 1e3 * np.array(list(result.travels.values()))
        limit = 1e3 * settings.travel_limit
        last = int(np.searchsorted(ways, limit)) + 1
        travels.plot(latencies[:last], ways[:last], color=_PANEL_COLOURS[0], marker="o")
        _finish_travels(travels, limit, f"{reactions.where}, after '{settings.detector}'")
    for (name, delay), look in delays.items():
        keys[f"{name}, {delay:.0f} ms"] = rates.axhline(delay, **look)
        for travels in (axes for axes in rest if delay < axes.get_xlim()[1]):
            travels.axvline(delay, **look)
    if any(np.isnan(curve.get_ydata()).any() for curve in rates.lines):
        keys["no mark: no latency is short enough"] = Line2D([], [], linestyle="none")
    add_legend(figure, keys)
    return figure


@with_style
def outcome_figure(reactions: Reactions) -> Figure:
    """Draw what comes of every reaction after every detector at the centre: saved or lost, and by how much time."""
    detectors, trials = list(reactions.settings.detectors), reactions.result.trials
    labels = {
        trial.reaction: f"{trial.reaction}, {1e3 * trial.delay:.0f} ms{trial.since}, {trial.force_rate:g} N/s"
        for trial in sorted(trials, key=lambda trial: -trial.delay)
    }
    title = f"At {reactions.where}: time to spare, and travel"
    size = (max(1.75 * len(detectors), 3.4), 0.42 * len(labels))
    figure, (axes,) = figure_grid(1, 1, size, title, ("detector", ""))
    for trial in trials:
        row, column = list(labels).index(trial.reaction), detectors.index(trial.detector)
        colour = STATE_COLOURS[STICK if trial.saved else SLIP]
        axes.add_patch(Rectangle((column - 0.5, row - 0.5), 1.0, 1.0, facecolor=colour, edgecolor="white", linewidth=2))
        spare = "–" if trial.spare is None else f"{1e3 * trial.spare:+.0f} ms".replace("-", "−")
        travel = f"{1e3 * trial.travel:.1f} mm" if trial.saved else "lost"
        axes.text(column, row, f"{spare}\n{travel}", ha="center", va="center", fontsize=7.5, linespacing=1.1)
    axes.set(xlim=(-0.5, len(detectors) - 0.5), ylim=(-0.5, len(labels) - 0.5))
    axes.set_xticks(range(len(detectors)), detectors)
    axes.set_yticks(range(len(labels)), list(labels.values()))
    _only_cells(axes)
    add_legend(figure, {name: Patch(color=STATE_COLOURS[key]) for name, key in (("saved", STICK), ("lost", SLIP))})
    return figure


def _finish_rates(axes: Axes, rates: Sequence[float], highest: float) -> None:
    """Give critical latencies their axes, up to the highest line [ms] at least."""
    axes.set(xscale="log", yscale="log", xlabel="rate of the load [N/s]", ylabel="critical latency [ms]")
    axes.set_xticks(rates, [f"{rate:g}" for rate in rates], minor=False)
    axes.set_xticks([], minor=True)
    axes.set_ylim(_LOWEST, 1.3 * max(axes.dataLim.y1, highest, _LOWEST))
    axes.yaxis.set_major_formatter("{x:g}")


def _finish_travels(axes: Axes, limit: float, title: str) -> None:
    """Give travels their axes, and the limit [mm]."""
    axes.set(xlabel="latency [ms]", ylabel="largest travel [mm]", ylim=(0.0, 1.15 * limit))
    name_panel(axes, title)
    axes.axhline(limit, color=VERMILLION, linewidth=0.9)
    axes.text(axes.get_xlim()[0], limit, "  lost", va="bottom", color=VERMILLION, fontsize=7.5)


_FILM_WORDS = (
    "The object and what holds it; colours are stress, dots on the skin stick or slip. Below: what the load pulls,"
    " and what friction bears; the object slides where the load is more. Slowed down."
)


def reaction_tables(reactions: Reactions) -> tuple[Table, ...]:
    """Return the tables that the command line prints: all runs, and the answer with the reactions at the centre."""
    trials, said = trial_table(reactions), " ".join(answer(reactions))
    tables = (cell_table(reactions), *((trials,) if trials.rows else ()))
    return (*tables[:-1], dataclasses.replace(tables[-1], note=f"{said} {tables[-1].note}"))


def reaction_figures(reactions: Reactions) -> Mapping[str, Callable[[Reactions], Figure]]:
    """Return what draws the figures for which there are results, by the names of their kinds."""
    has_map = bool(reactions.panels(reactions.settings.detector))
    drawn = {
        "reaction-map": (map_figure, has_map),
        "reaction-margin": (margin_figure, has_map or reactions.result.travels),
        "reaction-outcome": (outcome_figure, trial_table(reactions).rows),
    }
    return {name: draw for name, (draw, results) in drawn.items() if results}


def reaction_report(content: ReportContent, reactions: Reactions) -> Report:
    """Assemble the page of a study with reactions."""
    settings, study = reactions.settings, content.study
    centre = study.folder / reactions.runs[reactions.centre].name
    trials, figures = trial_table(reactions), reaction_figures(reactions)
    map_words = (
        f"Longest latency after '{settings.detector}' that saves the object; lines bound what some reactions save."
    )
    travels = ", and the travel that a latency costs" if reactions.result.travels else ""
    margin_words = f"Critical latency against the rate of the load{travels}."
    outcome_words = f"What comes of each reaction after each detector, at {reactions.where}: time to spare, and travel."

    def picture(name: str, words: str) -> tuple[Picture, ...]:
        return (Picture(name, words, figures[name](reactions)),) if name in figures else ()

    sections = (
        ReportSection("Saved and lost", body=_film_html(centre / FILM, centre / STILL)),
        ReportSection("What a latency costs", pictures=picture("reaction-margin", margin_words)),
        ReportSection(
            "Which reactions save it",
            tables=(trials,) if trials.rows else (),
            pictures=picture("reaction-outcome", outcome_words),
        ),
        uncertainty_section(content),
        ReportSection("Reactions and their sources", tables=(source_table(), paper_table()), folded=True),
        ReportSection("All runs", tables=(cell_table(reactions),), folded="reaction-map" in figures),
        ReportSection("Notes", body=content.notes),
        ReportSection("Values and their sources", tables=tuple(value_tables(content.values)), folded=True),
        ReportSection("Citations", code=bibtex_entries(content.values, ()), folded=True),
    )
    return Report(
        content.title,
        tuple(section for section in sections if not section.is_empty),
        content.provenance,
        question=study.description,
        answer=answer(reactions),
        hero=picture("reaction-map", map_words) if len(reactions.runs) > 1 else (),  # a map of one cell tells nothing
    )


def _film_html(film: Path, still: Path) -> str:
    """Return a film and its last frame as HTML without any file beside it; nothing without a film."""
    if not film.is_file():
        return ""
    video, poster = (base64.b64encode(path.read_bytes()).decode("ascii") for path in (film, still))
    look = 'style="width:100%" controls muted loop playsinline'
    player = f'<video {look} poster="data:image/png;base64,{poster}" src="data:video/mp4;base64,{video}"></video>'
    return f"<figure>{player}<figcaption>{_FILM_WORDS}</figcaption></figure>"
