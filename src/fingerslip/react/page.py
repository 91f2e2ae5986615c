"""The folder and the page of a map: answer, figures, a film, tables with sources."""

from __future__ import annotations

import base64
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

from fingerslip.react.answer import answer, cell_table, error_table, paper_table, source_table, trial_table
from fingerslip.react.figures import map_figure, margin_figure, outcome_figure
from fingerslip.react.film import SHOWN_FILM, film_frames, write_film
from fingerslip.react.mapping import MapResult, grasp_of, reaction_map, read_reaction_map
from fingerslip.react.reflex import Reaction, reaction
from fingerslip.report.figures.motion import Film
from fingerslip.report.page.page import Picture, Report, ReportSection, write_page
from fingerslip.storage.files import write_bytes, write_text
from fingerslip.tables.table import to_csv
from fingerslip.version import __version__

__all__ = ["filmed_reactions", "map_file", "map_report", "write_map"]

_FILM, _MINUTE = "reaction-film.mp4", "%Y-%m-%d %H:%M %Z"
_FILM_WORDS = (
    "The object between two fingers; colours are stress, dots on the skin stick or slip. Below: what the load pulls,"
    " and what friction bears; the object slides where the load is more. Slowed down."
)


def filmed_reactions(result: MapResult) -> dict[str, Reaction]:
    """Return the slowest reaction that saves the object of the centre, and the quickest that loses it, by title."""
    tried = [trial for trial in result.trials if trial.detector == result.settings.detector and not trial.since_load]
    ordered = sorted(tried, key=lambda trial: trial.delay)
    saved, lost = ([trial for trial in ordered if trial.outcome.saved is kind] for kind in (True, False))
    return {
        f"{trial.reaction}, {1e3 * trial.delay:.0f} ms": reaction(trial.reaction) for trial in (*saved[-1:], *lost[:1])
    }


def map_report(result: MapResult, film: tuple[bytes, bytes] | None = None, study: str = "") -> Report:
    """Assemble the page of a map, with a film, the file and its last frame as PNG, and the text of the study file."""
    settings, held = result.settings, result.settings.held
    centre = settings.centre
    margin = f"{100 * held.margin:.0f} % more than the least grip"
    grip = margin if held.grip is None else f"{held.grip:g} N"
    question = (
        f"Two fingers hold an object of {1e3 * held.mass:g} g with {grip}. Its load grows; something notices slip. How "
        f"late may the grip begin to rise before the object has travelled {1e3 * held.travel_limit:g} mm and is lost?"
    )
    at = f"friction {centre.friction:g}, {centre.load_rate:g} N/s, {centre.phalanx} phalanx"
    map_words = (
        f"Longest latency after '{settings.detector}' that saves the object; lines bound what some reactions save."
    )
    margin_words = "Critical latency against the rate of the load, and the travel that a latency costs."
    outcome_words = f"What comes of each reaction after each detector, at {at}: time to spare, and travel."
    sections = (
        ReportSection("Saved and lost", body=_film_html(film) if film else ""),
        ReportSection(
            "What a latency costs", pictures=(Picture("reaction-margin", margin_words, margin_figure(result)),)
        ),
        ReportSection(
            "Which reactions save it",
            tables=(trial_table(result),),
            pictures=(Picture("reaction-outcome", outcome_words, outcome_figure(result)),) if result.trials else (),
        ),
        ReportSection("Numerical uncertainty", tables=(error_table(result),)),
        ReportSection("Reactions and their sources", tables=(source_table(), paper_table()), folded=True),
        ReportSection("All cells of the map", tables=(cell_table(result),), folded=True),
        ReportSection("The study file", code=study, folded=True),
    )
    return Report(
        settings.title or "Reactions",
        tuple(section for section in sections if not section.is_empty),
        {"page of": time.strftime(_MINUTE), "fingerslip": __version__},
        question=question,
        answer=answer(result),
        hero=(Picture("reaction-map", map_words, map_figure(result)),),
    )


def _film_html(film: tuple[bytes, bytes]) -> str:
    """Return a film and its last frame as HTML without any file beside it."""
    video, still = (base64.b64encode(part).decode("ascii") for part in film)
    look = 'style="width:100%" controls muted loop playsinline'
    player = f'<video {look} poster="data:image/png;base64,{still}" src="data:video/mp4;base64,{video}"></video>'
    return f"<figure>{player}<figcaption>{_FILM_WORDS}</figcaption></figure>"


def write_map(result: MapResult, folder: str | Path, film: Film | None = None, study: str = "") -> Path:
    """Write answer, tables, figures, a film and the page of a map into a folder, and return it.

    Without a :class:`~fingerslip.report.figures.motion.Film` there is no film; `study` is the text of the study file.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "answer.txt", "".join(f"{sentence}\n" for sentence in answer(result)))
    for name, table in (("cells", cell_table(result)), ("trials", trial_table(result)), ("sources", source_table())):
        write_text(folder / f"{name}.csv", to_csv(table))
    reactions, path, shown = filmed_reactions(result), folder / _FILM, None
    if film is not None and reactions:
        with grasp_of(result.settings, result.settings.centre) as grasp:
            still = write_film(path, film_frames(grasp, result.settings.detector, reactions, film), film)
        write_bytes(path.with_suffix(".png"), still)
        shown = path.read_bytes(), still
    report = map_report(result, shown, study)
    for picture in report.pictures:
        write_bytes(folder / f"{picture.name}.png", picture.png)
    write_page(report, folder / "report.html")
    return folder


def map_file(path: Path, results: Path, workers: int, progress: Callable[[float], None]) -> tuple[MapResult, Path]:
    """Compute the map of a file and write it into a folder of its name; return it and the folder."""
    result = reaction_map(read_reaction_map(path), workers=workers, progress=progress)
    # Films are written by OpenCV, of the extra `vision`.
    film = SHOWN_FILM if find_spec("cv2") else None
    return result, write_map(result, results / path.stem, film, path.read_text(encoding="utf-8"))
