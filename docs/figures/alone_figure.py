"""Draw the rows of trials alone, such as those of other moduli or shapes, of a table of fingerslip detect vary.

First: fingerslip detect vary TRIALS --each CONDITION ... --output FOLDER
Then: python docs/figures/alone_figure.py FOLDER docs/figures/detection-shape.png
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

from fingerslip.detect.evaluation.figures import assumption_figure
from fingerslip.detect.evaluation.scores import Estimate
from fingerslip.report.figures.style import save_figure

_WORDS = 4


def main() -> None:
    """Draw the first row, all trials together, and those of each combination alone."""
    folder, target = map(Path, sys.argv[1:3])
    with (folder / "assumptions.csv").open(newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    chosen = [("all together", rows[0]), *((row[1], row) for row in rows if row[0] == "trials alone of")]
    drawn = [(words, dict(zip(names[_WORDS::3], estimates(row[_WORDS:]), strict=True))) for words, row in chosen]
    save_figure(assumption_figure(drawn), target)


def estimates(cells: list[str]) -> list[Estimate]:
    """Return estimates from their cells: value, low and high of one after the other."""
    return [Estimate(*map(float, cells[first : first + 3])) for first in range(0, len(cells), 3)]


if __name__ == "__main__":
    main()
