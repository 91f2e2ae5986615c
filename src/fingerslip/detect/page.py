"""The page that says when a clip slips, how sure that is, and shows it; and the folder that it stands in."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.detect.folders import OF_CLIPS, OF_TRACKS, tracks_in
from fingerslip.detect.live import Finding
from fingerslip.detect.model_file import time_error_text
from fingerslip.detect.recordings import read_any_tracks
from fingerslip.detect.residual import STILL, ResidualFinding, ResidualSettings, Slide, slides_of
from fingerslip.detect.timeline import Timeline, mark_events, read_timeline, timeline_figure, write_timeline
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.report.colours import BLACK, GREY, SKY, VERMILLION
from fingerslip.report.figures.markers import SHOWN_UNITS, marker_tracks_figure
from fingerslip.report.figures.style import figure_grid, picture_bytes, say, show_picture, with_style
from fingerslip.report.page.page import Picture, Report, ReportSection, write_page
from fingerslip.storage.files import check_replaceable, new_folder, write_text
from fingerslip.tables.table import Cell, Column, Missing, Table, to_csv
from fingerslip.version import __version__
from fingerslip.vision.fields import rest_positions
from fingerslip.vision.overlay import overlay_frames
from fingerslip.vision.tracks import write_tracks
from fingerslip.vision.video import Frames

_BEFORE, _AFTER = 0.5, 1.0  # seconds of a clip around a moment
_PICTURES = 45  # of a clip at most
_CLIPS = 4
_FILE = "slip.csv"
_HOW = (
    "While all sticks, the markers of a sensor move in one pattern that grows: a motion as one, and how the sensor "
    "yields to it, fitted until noise lets it be known. A marker has left it where what is left of its displacement is "
    "more than {noise:g} times the noise, at rest and of that fit, and more than {growth:g} % of the displacement. "
    "Slip begins where {share:g} % of the markers have; it is gross where all spring back faster than carried."
)
_WHAT_IT_NEEDS = (
    "The clip, or a part of it, has to begin at rest and pressed on what it will slide on. A motion that is not rigid "
    "from its start is taken for a press, and nothing is said of slip until the sensor rests again. So is a slide in "
    "which many markers lie beyond the contact: leave those out with --mask. Slip that grows linearly across the "
    "markers looks like a camera that moves, and is not seen. Markers that spring back because the sensor was pulled "
    "back fast look like gross slip."
)


_COLOURS = (
    " Orange markers differ from the pattern of most, blue ones go with it, white or grey ones are not counted. Orange "
    "is where slipping and sticking markers meet: on which side the slip is, it does not say."
)
_NO_COLOURS = " This detector looks at all markers at once: which of them slip, it does not say."
_SURE_OF_TRAINED = (
    "Sure: the probability that the detector itself gives, at most 99 %; how often it is right on trials that it has "
    "not seen, fingerslip detect evaluate says."
)
_SURE = (
    "Sure: in how many tested clips slip had begun when as many markers had left the pattern; none was real. Gross "
    "slip is told where markers spring back; where they only stop, it is not seen."
)


@dataclass(frozen=True)
class SlipClip:
    """A clip, and what a detector found in it."""

    name: str
    tracks: xr.Dataset  # of its markers
    findings: Sequence[Finding]  # of each time
    latency: Table
    frames: Frames | None = None  # of the video, where there is one
    time_error: Sequence[float] = ()  # of the time of slip, as its detector has it
    source: str = ""  # its file
    detector: str = ""  # what looked at it
    about: Table | None = None  # what that is, of a trained one

    @property
    def slides(self) -> tuple[Slide, ...]:
        """What happens from rest to rest; all that a detector without rests found is one slide."""
        return slides_of(self.findings)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is wrong with its tracks."""
        return tuple(filter(None, str(self.tracks.attrs.get("warnings", "")).split("\n")))

    @property
    def residual(self) -> Sequence[ResidualFinding]:
        """The findings, where they say what each marker does; else none."""
        return [entry for entry in self.findings if isinstance(entry, ResidualFinding)]

    @property
    def rest(self) -> Floats:
        """Places of the internal markers at rest, (n_markers, 2), in the unit of the tracks."""
        inside = self.tracks.isel(marker=np.flatnonzero(self.tracks["kind"].values.astype(str) == "internal"))
        return rest_positions(inside["position"].values[:, :, :2], 5)

    @property
    def moments(self) -> dict[str, int]:
        """Numbers of the frames that show what happened first, by their names."""
        time = np.array([entry.time for entry in self.findings])
        slide = next((slide for slide in self.slides if slide.onsets.first is not None), None)
        if slide is None:
            moved = [entry.displacement for entry in self.residual]
            return {"at rest": 0, **({"most displaced": int(np.argmax(moved))} if moved else {})}
        onsets = slide.onsets
        times = {"at rest": slide.start, "slip begins": onsets.incipient, "gross slip begins": onsets.gross}
        numbers = {name: int(np.searchsorted(time, value)) for name, value in times.items() if value is not None}
        numbers["at rest"] = max(numbers["at rest"] - 2, 0)
        first = numbers.get("slip begins", numbers["at rest"])
        end = len(time) if slide.end is None else int(np.searchsorted(time, slide.end))
        last = numbers.get("gross slip begins", end - 1)
        between = {"between" if "gross slip begins" in numbers else "later": (first + last) // 2}
        return dict(sorted({**numbers, **between}.items(), key=lambda pair: pair[1]))


def write_slip_page(clip: SlipClip, folder: Path) -> Path:
    """Write a folder with the page, the times and, of a video, its tracks, whole or not at all; return the page."""
    check_replaceable(folder, _FILE)
    with new_folder(folder) as partial:
        table = slide_table(clip)
        with_units = tuple(Column(column.heading) for column in table.columns)
        write_text(partial / _FILE, to_csv(replace(table, columns=with_units)))
        if clip.frames is not None:
            write_tracks(clip.tracks, partial / "tracks.nc")
        write_timeline(timeline_of(clip), partial, {"source": clip.source, "detector": clip.detector})
        write_page(slip_report(clip), partial / "slip.html")
    return folder / "slip.html"


def slide_table(clip: SlipClip) -> Table:
    """Return what happened from rest to rest."""
    rows: list[tuple[Cell, ...]] = []
    for slide in clip.slides:
        no_event = Missing.NO_EVENT if slide.is_judged else Missing.NOT_JUDGED
        incipient, gross = (no_event if time is None else time for time in vars(slide.onsets).values())
        sure = _sureness(clip, slide) if slide.is_judged else no_event
        if clip.residual and slide.onsets.first is not None and slide.onsets.gross is None:
            gross = Missing.NOT_JUDGED
        motion: tuple[Cell, ...] = (slide.start, slide.end, "not rigid" if slide.is_press else "slide")
        rows.append((*motion, incipient, gross, sure))
    seconds = [Column(name, "s", digits=3) for name in ("begins", "ends", "slip", "gross slip")]
    columns = (*seconds[:2], Column("what"), *seconds[2:], Column("sure", "%"))
    if not clip.residual:  # it knows no rests
        return Table("What was found", columns[3:], tuple(row[3:] for row in rows), _SURE_OF_TRAINED)
    title = "What happened from rest to rest" if rows else "The markers never moved"
    return Table(title, columns, tuple(rows), _SURE if rows else "")


def _sureness(clip: SlipClip, slide: Slide) -> int | None:
    """Return the largest probability of slip in a slide from its onset on, in whole per cent and at most 99."""
    first, end = slide.onsets.first, np.inf if slide.end is None else slide.end
    if first is None:
        return None
    odds = [entry.slip for entry in clip.findings if first <= entry.time <= end]
    return min(int(100.0 / (1.0 + np.exp(-max(odds)))), 99) if odds else 0


def answer_of(clip: SlipClip) -> tuple[str, ...]:
    """Return when it slipped and how sure that is, in sentences."""
    slips = [slide for slide in clip.slides if slide.onsets.first is not None]
    presses = sum(slide.is_press for slide in clip.slides)
    sentences = []
    for slide in slips[:3]:
        gross = "" if slide.onsets.gross is None else f", gross slip at {slide.onsets.gross:.2f} s"
        begin = f"Slip begins at {slide.onsets.first:.2f} s{gross}"
        sentences.append(f"{begin}; slip: {_sureness(clip, slide)} %.")
    if len(slips) > 3:
        sentences.append(f"Slip in {len(slips) - 3} further slides: see the table.")
    if slips:
        sentences.append(_time_error(clip))
    slides = (slide for slide in clip.slides if not slide.is_press)
    behind = max(slides, key=lambda slide: (not slide.is_judged, slide.behind), default=None)
    if not slips and (not clip.slides or any(slide.is_judged for slide in clip.slides)):
        sentences.append("No slip was found." if clip.slides else "No slide was found.")
    if behind and behind.behind:
        left_out = f"In a slide {behind.behind} of {behind.markers} markers stay behind and are not counted"
        sentences.append(f"{left_out}{'' if behind.is_judged else ': of slip in it nothing is said'}.")
    if presses:
        words = "1 motion is" if presses == 1 else f"{presses} motions are"
        rest = f"Hold still for {STILL:g} s between press and slide; leave out markers beyond the contact with --mask."
        sentences.append(f"Not judged: {words} not rigid from the start, as a press is. {rest}")
    return tuple(sentences)


def _time_error(clip: SlipClip) -> str:
    """Return how far times of slip were off in tests, where that is known."""
    if not clip.residual:
        return f"Error of the time of slip: {time_error_text(clip.time_error)}."
    errors = [f"{_error(slip, ' s', 1)} on {name}" for name, slip, _ in _TIMED]
    line = f"Error of the time when slip begins, in tests: {', '.join(errors)}."
    if all(slide.onsets.gross is None for slide in clip.slides):
        return line
    errors = [_error(gross, " s", 1) for *_, gross in _TIMED]
    told, clips = next((row[6], row[1]) for row in TESTED if row[6])
    return f"{line} Of gross slip: {', '.join(errors)}; false in {told} of {clips} clips in which a part always stuck."


def slip_report(clip: SlipClip) -> Report:
    """Return the page."""
    has_reasons = bool(clip.residual)
    colours = _COLOURS if has_reasons else _NO_COLOURS
    caption = "Dashed: slip begins. Full line: it is gross. Grey: nothing is said of slip."
    timeline = Picture("timeline", caption, timeline_figure(timeline_of(clip)))
    hero, sections = [], [ReportSection("When", (), (slide_table(clip),), warnings=clip.warnings)]
    if clip.frames is not None:
        caption = f"Frames of the video; lines lead from where each marker rested.{colours}"
        hero.append(Picture("moments", caption, stills_figure(clip)))
    sections.append(ReportSection("Timeline", pictures=(timeline,)))
    if has_reasons and any(not slide.is_press for slide in clip.slides):
        caption = "What the pattern leaves of each marker's displacement, at its place at rest."
        field = Picture("field", f"{caption}{colours}", field_figure(clip))
        caption = "The same for each marker over time, by its distance from the middle."
        order = Picture("markers", caption, map_figure(clip))
        sections.append(ReportSection("Which markers", pictures=(field, order)))
    if clip.frames is not None:
        text = f"Slowed down; they begin {_BEFORE:g} s before.{colours}"
        sections.append(ReportSection("The moments around", (text,), body=_clips_html(clip)))
    if has_reasons:
        settings = ResidualSettings()
        numbers = {"noise": settings.noise, "growth": 100 * settings.growth, "share": 100 * settings.share}
        sections.append(ReportSection("How it was found", (_HOW.format(**numbers), _WHAT_IT_NEEDS), (tested_table(),)))
    if clip.about:
        sections.append(ReportSection("How it was found", tables=(clip.about,)))
    sections.append(ReportSection("Speed", tables=(clip.latency,)))
    provenance = {"fingerslip": __version__, "source": str(clip.tracks.attrs.get("source", clip.name))}
    question = "When did it slip, and how sure is that?"
    return Report(f"Slip in {clip.name}", tuple(sections), provenance, question, answer_of(clip), tuple(hero))


_Errors = tuple[float, float, float] | None
_EARLY = 0.1  # by how much more than this alarms come before slip that count here [s]
#: What the detector that ships was tested on: clips, in how many slip was found, alarms that were false or early by
#: more, median and 5 to 95 % of the error [s]; in how many gross slip was told, in how many falsely, its error.
TESTED: Sequence[tuple[str, int, int, int, _Errors, int, int, _Errors]] = (
    ("analytic slides of a disc", 64, 64, 0, (0.03, 0.00, 0.10), 64, 0, (0.00, 0.00, 0.00)),
    ("the same without slip", 24, 0, 0, None, 0, 0, None),
    ("sticking pads that yield", 72, 0, 0, None, 0, 0, None),
    ("simulated slides, ridged skin", 16, 16, 0, (4.32, 3.09, 6.32), 15, 0, (-0.15, -0.36, 1.96)),
    ("the same, so much friction that a part always sticks", 5, 5, 0, (9.20, 6.39, 9.67), 5, 5, None),
    ("simulated slides, smooth skin", 12, 12, 0, (3.43, 2.45, 4.41), 12, 0, (0.43, 0.14, 1.29)),
    ("pins filmed under lamps", 20, 20, 0, (0.17, 0.00, 0.44), 20, 0, (0.03, 0.03, 0.10)),
    ("the same without slip", 20, 0, 0, None, 0, 0, None),
)


# Of these the answer says how far times are off.
_TIMED = [(row[0], row[4], row[7]) for row in TESTED if row[4] and row[7]][:2]


def tested_table() -> Table:
    """Return the error rates of the detector that ships, on what it was tested on."""
    names = (
        "tested on",
        "clips",
        "slip found",
        f"false or over {_EARLY:g} s early",
        "error [s]",
        "gross slip told",
        "falsely",
        "error [s]",
    )
    rows = [tuple(_error(cell) if isinstance(cell, tuple) else cell for cell in row) for row in TESTED]
    note = (
        "Error: median and 5 to 95 %, of five clips all. Slip counts from when a twentieth of the contact slips, which "
        "sensors with thick gel show late. Pads yield by 0 to 25 % at the rim, at 6 to 72 px/s and 0.005 to 0.1 px of "
        "noise. Pins: 91, moulded, tracked. Recordings of real sensors with a truth were not at hand, so none is here."
    )
    return Table("Error rates", tuple(map(Column, names)), tuple(rows), note)


def _error(error: tuple[float, float, float], unit: str = "", digits: int = 2) -> str:
    middle, low, high = (f"{value:.{digits}f}" for value in error)
    return f"{middle}{unit} ({low} to {high})"


def timeline_of(clip: SlipClip) -> Timeline:
    """Return what was found in a clip over time."""
    unit, scale = SHOWN_UNITS[str(clip.tracks["position"].attrs["units"])]
    odds = np.clip([entry.slip for entry in clip.findings], -50, 50)
    values = pd.DataFrame({"time [s]": [entry.time for entry in clip.findings]})
    values["sure of slip [%]"] = np.round(100.0 / (1.0 + np.exp(-odds)), 2)
    if clip.residual:
        values[f"displaced [{unit}]"] = [scale * entry.displacement for entry in clip.residual]
        values["left pattern [%]"] = [100 * entry.share for entry in clip.residual]
    for slide in clip.slides:
        if not slide.is_judged:
            end = np.inf if slide.end is None else slide.end
            values.loc[values["time [s]"].between(slide.start, end), ["sure of slip [%]", "left pattern [%]"]] = np.nan
    return Timeline(clip.name, clip.slides, values)


@with_style
def field_figure(clip: SlipClip) -> Figure:
    """Draw what the pattern leaves of the markers' displacements at the moments of the first slip."""
    rest, unit, moments = clip.rest, str(clip.tracks["position"].attrs["units"]), clip.moments
    panel, columns = (3.6, 3.0), min(len(moments), 2)
    figure, panels = figure_grid(len(moments), columns, panel, "What leaves the pattern", ("", ""), share="none")
    largest = max(float(np.nanmax(np.hypot(*clip.residual[k].residual.T), initial=1.0)) for k in moments.values())
    apart = float(np.nanmedian(np.sort(np.linalg.norm(rest[:, None] - rest, axis=2), axis=1)[:, 1]))
    for axes, (name, number) in zip(panels, moments.items(), strict=True):
        left = clip.residual[number].residual
        beyond = np.hypot(*left.T)
        colours = np.select([beyond > 1.0, beyond <= 1.0], [VERMILLION, SKY], GREY)
        axes.scatter(rest[:, 0], rest[:, 1], s=14, color=colours)
        arrows = left * (1.2 * apart / largest)
        axes.quiver(*rest.T, *arrows.T, angles="xy", scale_units="xy", scale=1, width=0.008, color=BLACK)
        share = f"{100 * clip.residual[number].share:.0f} % left it"
        axes.set_title(f"{name}, {clip.findings[number].time:.2f} s: {share}")
        axes.set(xlabel=f"x at rest [{unit}]", ylabel=f"y at rest [{unit}]", aspect="equal")
        if unit == "px":
            axes.invert_yaxis()
    return figure


@with_style
def map_figure(clip: SlipClip) -> Figure:
    """Draw for each marker over time how far it left the pattern, from the middle of the markers outwards."""
    figure, (axes,) = figure_grid(1, 1, (7.2, 2.6), "Markers over time", ("time [s]", "markers, middle first"))
    order = np.argsort(np.linalg.norm(clip.rest - np.nanmean(clip.rest, axis=0), axis=1))
    left = np.stack([np.hypot(*entry.residual.T) for entry in clip.residual])[:, order].T
    time = [entry.time for entry in clip.findings]
    extent = (time[0], time[-1], len(order) - 0.5, -0.5)
    # Blue is within the limit and red beyond it.
    look: dict[str, Any] = {"cmap": "RdBu_r", "norm": LogNorm(0.1, 10.0), "interpolation": "nearest"}
    drawn = axes.imshow(np.maximum(left, 1e-3), aspect="auto", extent=extent, **look)
    axes.grid(visible=False)
    mark_events(axes, clip.slides)
    figure.colorbar(drawn, ax=axes, label="residual over limit", extend="both", pad=0.01)
    return figure


@with_style
def stills_figure(clip: SlipClip) -> Figure:
    """Draw the frames of the moments of the first slip, with the markers on them."""
    moments = clip.moments
    figure, panels = figure_grid(len(moments), min(len(moments), 2), (3.7, 2.9), "", ("", ""))
    for axes, (name, number) in zip(panels, moments.items(), strict=True):
        pictures = _pictures(clip, [number])
        if pictures:
            show_picture(axes, pictures[0][:, :, ::-1], f"{name}, {clip.findings[number].time:.2f} s")
        else:
            say(axes, "no such frame")
    return figure


def _pictures(clip: SlipClip, numbers: Sequence[int]) -> list[NDArray[np.uint8]]:
    """Return some frames, by their numbers in rising order, with their markers (height, width, 3), blue first."""
    assert clip.frames is not None
    tracks, wanted = clip.tracks, set(numbers)
    if "image_position" in tracks:
        tracks = tracks.assign(position=tracks["image_position"].assign_attrs(tracks["position"].attrs))
    frames = [
        frame for number, frame in zip(range(max(numbers) + 1), clip.frames.read(), strict=False) if number in wanted
    ]
    chosen = tracks.isel(time=list(numbers))
    moved = chosen["position"].values - rest_positions(tracks["position"].values, 5)
    marked = np.full(moved.shape[:2], np.nan)
    if clip.residual:
        left = np.array([np.hypot(*clip.residual[number].residual.T) for number in numbers])
        marked = np.where(np.isnan(left), np.nan, left > 1.0)
    return list(overlay_frames(frames, chosen, arrows=moved, marked=marked))


def _clips_html(clip: SlipClip) -> str:
    """Return moving pictures of the moments around the first slips, as HTML."""
    time = np.array([entry.time for entry in clip.findings])
    moments = [when for slide in clip.slides for when in vars(slide.onsets).values() if when is not None]
    figures = []
    for when in moments[:_CLIPS] or [float(time[clip.moments.get("most displaced", 0)])]:
        numbers = np.flatnonzero((time > when - _BEFORE) & (time < when + _AFTER))
        numbers = numbers[:: max(1, -(-len(numbers) // _PICTURES))]
        pictures = [np.ascontiguousarray(picture[:, :, ::-1]) for picture in _pictures(clip, numbers.tolist())]
        data = base64.b64encode(picture_bytes(pictures, ".webp")).decode("ascii")
        words = f"Around {when:.2f} s"
        source = f'<img alt="{words}" src="data:image/webp;base64,{data}">'
        figures.append(f"<figure>{source}<figcaption>{words}.</figcaption></figure>")
    return f'<div style="display:flex;flex-wrap:wrap;gap:1em">{"".join(figures)}</div>'


def draw(folder: Path, kind: str) -> Figure:
    """Draw a figure of what a detector or the tracker wrote."""
    if kind in OF_TRACKS:
        return marker_tracks_figure(read_any_tracks(tracks_in(folder)))
    if kind in OF_CLIPS:
        return timeline_figure(read_timeline(folder))
    from fingerslip.detect.evaluation.figures import figures_of, read_judged

    judged, labels = read_judged(folder)
    kinds = figures_of(judged)
    if kind not in kinds:
        raise InputError(str(folder), f"has no figure {kind}: trials were judged whole", f"needs {', '.join(kinds)}")
    return kinds[kind](judged, labels)
