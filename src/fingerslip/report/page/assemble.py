"""The report of a study, with the user's notes and citations, and that of two studies side by side."""

from __future__ import annotations

import base64
import dataclasses
import math
import mimetypes
import re
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from urllib.parse import unquote, urlparse

from markdown_it import MarkdownIt
from markdown_it.token import Token

from fingerslip.errors import ResultError
from fingerslip.report.citations import bibtex_entries
from fingerslip.report.content import MOST_RUNS, ReportContent, RunPictures, RunSubject, has_receptors
from fingerslip.report.figures.signals import energy_figure
from fingerslip.report.figures.study import Pair, convergence_figure, paired_figure, time_into_slide
from fingerslip.report.labels import of_histories, of_runs, prose, run_title, swept_text
from fingerslip.report.page.answer import answer, definitions, quotable
from fingerslip.report.page.motion import run_motions
from fingerslip.report.page.page import Picture, Report, ReportSection
from fingerslip.report.page.pictures import (
    hero_pictures,
    model_pictures,
    overview_pictures,
    run_pictures,
    swept_pictures,
)
from fingerslip.report.page.samples import sample_sections, samples_in_motion
from fingerslip.report.tables import compare
from fingerslip.report.tables import runs as run_tables
from fingerslip.report.tables.parameters import conditions_table, models_table, value_tables
from fingerslip.results import RunResult, StudyResult
from fingerslip.slip import acceleration_peaks
from fingerslip.slip.windows import EVENTS, LATENCY, NOTICED_NOTE, READINGS
from fingerslip.tables.table import Column, Missing, Table


def study_report(content: ReportContent) -> Report:
    """Assemble the report of a study: of samples, or of runs with a section each for the first of them."""
    if content.study.ranges:
        sections = [*sample_sections(content), samples_in_motion(content), *_description(content), _values(content)]
    else:
        sections = [*_results(content), *_description(content), *_model(content), _values(content)]
        sections += [run_section(content, run) for run in content.detailed_runs]
    text = "What these results rest on, as BibTeX. fingerslip cite adds a paragraph of methods."
    code = bibtex_entries(content.values, content.references)
    citations = ReportSection("Citations", (text,), code=code, folded=True)
    return Report(
        content.title,
        tuple(section for section in (*sections, citations) if not section.is_empty),
        content.provenance,
        question=content.study.description,
        answer=answer(content.study, content.starts, content.references),
        quote=quotable(content),
        hero=() if content.study.ranges else tuple(hero_pictures(content)),
    )


def _results(content: ReportContent) -> Iterator[ReportSection]:
    """Yield the sections on what runs did: their events beside published ones, in motion, and side by side."""
    runs, titles = content.study.runs, content.titles
    recorded = [name for name in READINGS if any(run.events.reading(name).recorded for run in runs)]
    text = (f"No times from {READINGS[name]}: no run records the signals." for name in READINGS if name not in recorded)
    begin = {f"{start:.3f}" for start in content.starts.values()}
    counted = (prose("sections", "begin", {"start": begin.pop()}),) if len(begin) == 1 else ()
    events = tuple(run_tables.events_table(runs, name) for name in recorded)
    yield ReportSection("Slip events", (*counted, *text), events)
    sentences = definitions(content.settings)
    body = "".join(f"<p>{escape(of_runs(sentences[name], runs))}</p>" for name in (*recorded, "latency"))
    yield ReportSection("How slip events are defined", body=body, folded=True)
    beside = [compare.compare_table(runs, reference) for reference in content.references]
    beside += map(compare.statements_table, content.references)
    notes = tuple(dict.fromkeys(reference.note for reference in content.references))
    yield ReportSection("Comparison with published values", notes, tuple(table for table in beside if table.rows))
    motions = run_motions((content.histories[run.name], run.events, titles[run.name]) for run in content.drawn)
    paragraphs = [f"{prose('sections', 'motion')} {NOTICED_NOTE}"]
    if len(motions) < len(runs):
        paragraphs.append(prose("sections", "fewer", {"count": len(motions), "runs": len(runs)}))
    yield ReportSection("In motion", tuple(paragraphs), motions=motions)
    first = runs[:MOST_RUNS]
    measures = (run_tables.measures_table(first, [titles[run.name] for run in first]),) if len(first) > 1 else ()
    pictures = (*swept_pictures(content, slice(1, None)), *overview_pictures(content))
    yield ReportSection("The runs side by side", (), measures, pictures)
    if content.films:
        # What cameras saw is slow to import.
        from fingerslip.report.page.sensor import cameras_section

        yield cameras_section(content)


def _description(content: ReportContent) -> Iterator[ReportSection]:
    """Yield the sections on what was run, by the program and by the user."""
    table = conditions_table(content.values, content.titled_histories())
    yield ReportSection("What was run", (), (table,) if content.values else ())
    yield ReportSection("Notes", body=content.notes)


def _model(content: ReportContent) -> Iterator[ReportSection]:
    """Yield the sections on how far results can be trusted: energies, refinements, the model at the start."""
    if histories := content.titled_histories():
        title, history = next(iter(histories.items()))
        more = "" if len(histories) == 1 else title
        caption = of_histories(prose("captions", "energy", {"run": f": {more}" if more else ""}), [history])
        picture = Picture("energy-balance", caption, energy_figure(history, more))
        yield ReportSection("Energy balance", (), (run_tables.energies_table(histories),), (picture,))
    yield uncertainty_section(content)
    models: list[Picture] = []
    for run in (run for run in content.modelled_runs if run.name in content.histories):
        drawn = content.pictures.get(run.name, RunPictures()).model
        models += model_pictures(_subject(content, run)) if drawn is None else drawn
    yield ReportSection("The model", pictures=tuple(models))


def uncertainty_section(content: ReportContent) -> ReportSection:
    """Return the section on the refinements of runs."""
    refined = [(name, content.titles[name], item) for name, item in [*content.convergences.items()][:MOST_RUNS]]
    tables = tuple(compare.convergence_table(quantities, title) for _, title, quantities in refined)
    convergences = tuple(
        Picture(f"{name}-convergence", prose("captions", "convergence"), convergence_figure(quantities, title))
        for name, title, quantities in refined
    )
    return ReportSection("Numerical uncertainty", (), tables, convergences, folded=True)


def _values(content: ReportContent) -> ReportSection:
    tables, computed = value_tables(content.values), models_table(content.titled_histories())
    text = (prose("sections", "values"),) if tables else ()
    return ReportSection("Values and their sources", text, (*tables, computed) if computed.rows else tables)


def run_section(content: ReportContent, run: RunResult) -> ReportSection:
    """Assemble the section of one run: all readings of its events, its measures, and its pictures; folded."""
    history, drawn = content.histories[run.name], content.pictures.get(run.name, RunPictures()).contact
    tables = [run_tables.readings_table(run), run_tables.measures_table([run], ["value"])]
    if has_receptors(history):
        tables.append(run_tables.peaks_table(acceleration_peaks(history, content.settings.peaks)))
    pictures = run_pictures(_subject(content, run)) if drawn is None else drawn
    return ReportSection(run_title(run, "The run"), (), tuple(tables), tuple(pictures), folded=True)


def _subject(content: ReportContent, run: RunResult) -> RunSubject:
    return RunSubject(content.histories[run.name], run.events, name=run.name, title=content.titles[run.name])


#: File in the folder of a study's results, and the folder of figures beside it.
NOTES, PICTURES = "notes.md", "notes"

_TYPES = {".png", ".jpg", ".jpeg", ".gif", ".webp", ".svg"}
# Headings of the notes stand below the page's own.
_DEEPER = 2


def notes_html(folder: Path) -> str:
    """Return the notes of a study as HTML without any file beside it; empty where there are none.

    ``notes.md`` is Markdown; HTML in it is shown as text. Its pictures are files of the folder. Figures in ``notes/``
    that it does not show follow below it, each with its name.
    """
    embedded: set[Path] = set()
    path = folder / NOTES
    try:
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
    except (OSError, UnicodeDecodeError) as error:
        raise ResultError(f"{path}: cannot be read as text ({error})") from None
    body = _render(text, folder, embedded) if text else ""
    others = (path for path in sorted((folder / PICTURES).glob("*")) if path.suffix.lower() in _TYPES)
    figures = [
        f'<figure><img alt="{name}" src="{_data(path)}"><figcaption>{name}</figcaption></figure>'
        for path in others
        if path.resolve() not in embedded
        for name in [escape(re.sub(r"[-_]+", " ", path.stem))]
    ]
    return "\n".join(filter(None, (body, *figures)))


def _render(text: str, folder: Path, embedded: set[Path]) -> str:
    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse(text)
    for token in tokens:
        if token.type.startswith("heading_"):
            token.tag = f"h{min(int(token.tag[1]) + _DEEPER, 6)}"
        for child in token.children or ():
            if child.type == "image":
                embedded.add(_embed_picture(child, folder))
    page = str(reader.renderer.render(tokens, reader.options, {}))
    return page.replace("<table>", '<div class="table"><table>').replace("</table>", "</table></div>")


def _embed_picture(image: Token, folder: Path) -> Path:
    """Put the bytes of a picture into its link, and return its path."""
    source = str(image.attrs["src"])
    shows = f"{folder / NOTES}: shows '{source}'"
    if urlparse(source).scheme:
        raise ResultError(f"{shows}; a report needs no network: save the picture beside the notes")
    path = (folder / unquote(source)).resolve()
    if not path.is_file() or path.suffix.lower() not in _TYPES:
        needs = f"needs a file that ends in {', '.join(sorted(_TYPES))}, named from {folder}"
        raise ResultError(f"{shows}, which is not there; {needs}")
    image.attrs["src"] = _data(path)
    return path


def _data(path: Path) -> str:
    kind = mimetypes.guess_type(path.name)[0] or "image/png"
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def pairs_of(first: StudyResult, second: StudyResult) -> tuple[Pair, ...]:
    """Return the runs that two studies have in common: with the same swept values, or the only run of each."""
    if len(first.runs) == len(second.runs) == 1:
        return (Pair("the run", (first.runs[0], second.runs[0])),)

    def key(run: RunResult) -> frozenset[tuple[str, str]]:
        return frozenset((path, str(swept_text(value))) for path, value in run.swept.items())

    others = {key(run): run for run in second.runs}
    both = ((run, others[key(run)]) for run in first.runs if key(run) in others)
    return tuple(Pair(run_title(runs[0], "the run"), runs) for runs in both)


def comparison_report(first: ReportContent, second: ReportContent) -> Report:
    """Assemble the report of two studies."""
    sides, pairs = {"A": first, "B": second}, pairs_of(first.study, second.study)
    names = (f"A: {first.title}", f"B: {second.title}")
    values = compare.compared_values(first.values, second.values)
    differing = compare.differences_table(*values, same="Both studies have the same values.")
    hero: tuple[Picture, ...] = ()
    if pairs:
        figure = paired_figure(pairs, names, (first.starts, second.starts))
        hero = (Picture("paired", "Runs that both studies have.", figure),)
    tables = (
        dataclasses.replace(run_tables.events_table(side.study.runs), title=f"{name}: {side.title}")
        for name, side in sides.items()
    )
    sections = (
        ReportSection("Differences of slip events", names, (_differences(pairs),) if pairs else ()),
        ReportSection("Values that differ", (), (differing,)),
        ReportSection("Slip events of each study", (), tuple(tables)),
        ReportSection("Citations", code=bibtex_entries([*first.values, *second.values], ()), folded=True),
    )
    caveats = (f"{name}: {said}" for name, side in sides.items() for said in run_tables.run_caveats(side.study.runs))
    count = len(differing.rows)
    name = "no-difference" if not count else "one-difference" if count == 1 else "differences"
    said = prose("sections", name, {"count": count})
    if count and all(str(row[0]).startswith("mesh.") for row in differing.rows):
        said += " Only the mesh differs: B - A is what its element sizes change, if both are of one body."
    return Report(
        f"{first.title} beside {second.title}",
        tuple(section for section in sections if not section.is_empty),
        {f"{name}: {key}": value for name, side in sides.items() for key, value in side.provenance.items()},
        answer=(said, _change(pairs, first, second), *caveats),
        hero=hero,
    )


def _change(pairs: Sequence[Pair], first: ReportContent, second: ReportContent) -> str:
    """Say how much later overall slip of the second study comes."""
    if not pairs:
        return "The studies have no runs with the same swept values, so that none can be compared one by one."
    starts = (first.starts, second.starts)
    times = [[time_into_slide(*both) for both in zip(pair.runs, starts, strict=True)] for pair in pairs]
    changes = [1e3 * (late - early) for early, late in times if math.isfinite(late - early)]
    many = f"{len(pairs)} runs" if len(pairs) > 1 else "the run"
    if not changes:
        return f"Of {many} that both studies have, none reaches overall slip in both."
    ends = (min(changes), max(changes))
    if max(map(abs, ends)) < 0.5:
        return f"In {many} that both studies have, overall slip comes at the same time, to the millisecond."
    words = (f"{abs(change):.0f} ms {'later' if change >= 0.0 else 'earlier'}" for change in ends)
    span = " to ".join(dict.fromkeys(words))
    return f"In {many} that both studies have, overall slip of B comes {span} into the slide than that of A."


def _differences(pairs: Sequence[Pair]) -> Table:
    columns = (Column("run"), Column("event"), Column("A", "s", 3), Column("B", "s", 3), Column("B - A", "ms", 0))
    rows = tuple(
        (pair.title, name, first, second, next(missing, None) or compare.difference_cell(first, second, 1e3))
        for pair in pairs
        for time, name in {**EVENTS, LATENCY: LATENCY}.items()
        for first, second in [[run_tables.time_cell(run, "slip", time) for run in pair.runs]]
        for missing in [(cell for cell in (first, second) if isinstance(cell, Missing))]
    )
    marked = tuple(number for number, row in enumerate(rows) if compare.exceeds_uncertainty(row[2], row[3]))
    note = " ".join(filter(None, (NOTICED_NOTE, compare.marked_notes([run for pair in pairs for run in pair.runs]))))
    return Table("Slip events from accumulated slip, from the start of the run", columns, rows, note, marked)
