"""Make again all that the documentation takes from runs: results/reference, the tables in docs, the figures.

python docs/figures/make_reference.py [RESULTS]

Runs what is not in RESULTS yet; from nothing it takes about half an hour on two quiet cores. What the prose of
docs/validation.md, docs/solid.md and README.md quotes has to be looked over by hand afterwards.
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import make_details
import make_figures
import shrink

from fingerslip.study.convergence import converge
from fingerslip.study.definition.runs import plan_studies
from fingerslip.study.running.runner import run_plans
from fingerslip.tables.table import to_page
from fingerslip.validation.comparison import validate
from fingerslip.validation.evidence import Work
from fingerslip.validation.rows import rows_mapping, rows_markdown

ROOT = Path(__file__).parents[2]
REFERENCE, STUDIES = ROOT / "results" / "reference", ROOT / "studies"
#: Studies that the pages quote and `validate` does not run.
DETAILS = (
    *("wang2014_calibration", "wang2014_direction", "wang2014_peaks", "wang2014_accidents", "wang2014_thickness"),
    *("wang2014_damping", "stick_slip_friction", "slip_weakening", "wang2014_3d_tetrahedra", "wang2014_3d_patch"),
)
#: Figures of the study of Table 2 that the pages show, by their names in docs/figures.
PICTURES = {
    "section.png": "figures/section-variant-original.png",
    "slip-maps.png": "figures/slip-maps.png",
    "convergence-original.png": "convergence/figures/variant-original.png",
}
MADE = "fingerslip converge studies/wang2014_table2.yaml --markdown"


def main(results: Path) -> None:
    """Run everything and write everything."""
    rows = validate(Work(STUDIES, results))
    text = rows_markdown(rows)
    (REFERENCE / "validation.md").write_text(text, encoding="utf-8")
    (REFERENCE / "validation.json").write_text(json.dumps(rows_mapping(rows), indent=2) + "\n", encoding="utf-8")
    refined = to_page(converge(STUDIES / "wang2014_table2.yaml", results_dir=results).tables)
    heading = f"# Numerical uncertainty of the slip events of Table 2\n\nMade by `{MADE}`.\n\n"
    (REFERENCE / "convergence.md").write_text(f"{heading}{refined.rstrip()}\n", encoding="utf-8")
    renew_rows(ROOT / "docs" / "convergence.md", table_of(refined, "| quantity | unit |"))
    run_plans(plan_studies([STUDIES / f"{name}.yaml" for name in DETAILS], results))
    make_details.main(results)
    make_figures.main(results)
    for name, source in PICTURES.items():
        shutil.copyfile(results / "wang2014_table2" / source, Path(__file__).with_name(name))
    shrink.main()


def table_of(text: str, start: str) -> list[str]:
    """Return the lines of the first table in a text that begins with some words."""
    lines = text.splitlines()
    first = next(number for number, line in enumerate(lines) if line.startswith(start))
    last = next((number for number in range(first, len(lines)) if not lines[number].startswith("|")), len(lines))
    return lines[first:last]


def renew_rows(page: Path, table: list[str]) -> None:
    """Put the rows of a table in the place of those on a page that begin with the same cell."""
    rows = {row.split("|")[1]: row for row in table}
    lines = page.read_text(encoding="utf-8").splitlines()
    renewed = (rows.get(line.split("|")[1], line) if line.startswith("| ") else line for line in lines)
    page.write_text("\n".join(renewed) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "results"))
