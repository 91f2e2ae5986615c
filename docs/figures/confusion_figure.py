"""Draw the confusion of the published forest beside that of ours, of an evaluation.

Then: python docs/figures/confusion_figure.py EVALUATION docs/figures/detection-confusion.png
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np

from fingerslip.detect.evaluation.figures import confusion_figure
from fingerslip.published import published_set
from fingerslip.report.figures.style import save_figure

# Frames of each class among the published test frames, a tenth of 64,000.
TESTED = np.array([1600, 3200, 1600])


def main() -> None:
    """Draw the figure."""
    with next(Path(sys.argv[1]).glob("*-confusion-frames.csv")).open(encoding="utf-8") as file:
        forest = [row[2:5] for row in csv.reader(file) if row and row[0] == "forest"]
    matrices = {"forest, published": published_matrix(), "forest, ours, trials not seen": np.array(forest, dtype=int)}
    save_figure(confusion_figure(matrices), Path(sys.argv[2]))


def published_matrix() -> np.ndarray:
    """Return the printed matrix from the printed recalls: it takes no frame of slip for rest."""
    values = {value.id: value.value for value in published_set("bulens2023_detection-numbers").values}
    recalls = np.array([values[f"forest-{name}-recall"] for name in ("no-slip", "incipient", "gross")])
    right = np.round(TESTED * recalls).astype(int)
    matrix = np.diag(right)
    matrix[1, 2], matrix[2, 1] = TESTED[1:] - right[1:]
    return matrix


if __name__ == "__main__":
    main()
