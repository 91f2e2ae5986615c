"""Write results/reference/geometry.md, the figures of docs/geometry.md and the intervals of `fingerslip validate`.

First: fingerslip run studies/wang2014_geometry.yaml studies/wang2014_geometry_3d.yaml
Then: python docs/figures/make_geometry.py [RESULTS]
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from fingerslip.published import published_set
from fingerslip.report.figures.style import save_figure
from fingerslip.report.page.samples import tornado_pictures
from fingerslip.report.tables.samples import intervals_table, sensitivity_table
from fingerslip.results import StudyResult
from fingerslip.sampling.sensitivity import Fit, fits_of
from fingerslip.study.storage.reporting import read_results
from fingerslip.study.storage.store import SENSITIVITY
from fingerslip.tables.table import Table, to_markdown
from fingerslip.validation.evidence import Work
from fingerslip.validation.rows import GEOMETRY, GEOMETRY_FILE, allowed_geometry, geometry_table

FOLDER = Path(__file__).parent
ROOT = FOLDER.parents[1]
REFERENCE = ROOT / "results" / "reference"


def main() -> None:
    """Write all tables and figures; runs that are not there are computed."""
    results = Path(sys.argv[1] if len(sys.argv) > 1 else "results")
    rows = allowed_geometry(Work(ROOT / "studies", results, workers=1), compute=True).rows
    shutil.copyfile(results / GEOMETRY_FILE.name, REFERENCE / GEOMETRY_FILE.name)
    parts = [part(geometry_table(rows))]
    for name in GEOMETRY:
        study = read_results(results / name)
        shutil.copyfile(study.folder / SENSITIVITY, REFERENCE / f"{name}-{SENSITIVITY}")
        fits = [fit for fit in fits_of(study) if (fit.reading, fit.time) == ("slip", "overall")]
        parts += [part(sensitivity_table(fit)) for fit in fits]
        parts += [f"\n{refused(study)}\n"]
        draw(study, fits)
        parts += [part(intervals_table(study.runs))]
    text = f"# What the unknown geometry allows\n\nMade by `python docs/figures/make_geometry.py`.\n{''.join(parts)}"
    (REFERENCE / "geometry.md").write_text(text, encoding="utf-8")


def part(table: Table) -> str:
    """Return a table under its title."""
    return f"\n## {table.title}\n\n{table.note}\n\n{to_markdown(table)}"


def refused(study: StudyResult) -> str:
    """Say how many samples were computed."""
    return f"{study.folder.name}: {len(study.runs)} runs, {len(study.refused)} refused."


def draw(study: StudyResult, fits: list[Fit]) -> None:
    """Draw the tornado figure of overall slip."""
    references = [published_set(name) for name in study.compare]
    (picture,) = tornado_pictures(study.runs, fits, references)
    save_figure(picture.figure, FOLDER / f"{study.folder.name.replace('_', '-')}-tornado.png")


if __name__ == "__main__":
    main()
