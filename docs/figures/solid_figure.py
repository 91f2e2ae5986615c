"""Draw docs/figures/solid.png, the fingertip in 3D cut open during the slide, and solid-directions.png.

First: fingerslip run studies/wang2014_3d.yaml studies/directions_3d.yaml
Then: python docs/figures/solid_figure.py [RESULTS]
"""

from __future__ import annotations

import sys
from pathlib import Path

from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch as Swatch

from fingerslip.history import nearest_record, read_history
from fingerslip.report.colours import FIELD_MAP, STATE_COLOURS, STATE_NAMES
from fingerslip.report.figures.bodies import draw_contact
from fingerslip.report.figures.patches import slip_onset_figure
from fingerslip.report.figures.style import crop
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import field_limits
from fingerslip.report.scene.viewer import still

TIME = 0.9
DOTS_PER_INCH = 150
NAMES = {
    "1_0_0": "towards the tip",
    "1_0_1": "obliquely to the tip, +z",
    "0_0_1": "across, +z",
    "-1_0_1": "obliquely to the palm, +z",
    "-1_0_0": "towards the palm",
    "-1_0_-1": "obliquely to the palm, -z",
    "0_0_-1": "across, -z",
    "1_0_-1": "obliquely to the tip, -z",
}


def main(results: Path) -> None:
    """Draw both figures from stored runs."""
    draw_finger(results / "wang2014_3d" / "run")
    folder = results / "directions_3d"
    directions = {name: read_history(folder / f"direction-{way}" / "history.nc") for way, name in NAMES.items()}
    slip_onset_figure(directions).savefig(Path(__file__).with_name("solid-directions.png"), dpi=DOTS_PER_INCH)


def draw_finger(run: Path) -> None:
    """Draw the finger cut open, and its contact."""
    history = read_history(run / "history.nc")
    figure = Figure(figsize=(9.0, 3.1))
    left, right = figure.add_axes((0.0, 0.24, 0.52, 0.76)), figure.add_axes((0.59, 0.16, 0.4, 0.74))
    bar = figure.add_axes((0.11, 0.17, 0.3, 0.035))
    options = SceneOptions(cut="z", receptors=False, written=False)
    left.imshow(crop([still(history, TIME, options, (1400, 1050))])[0])
    left.set_axis_off()
    colours = ScalarMappable(Normalize(*field_limits(history, options)), FIELD_MAP)
    figure.colorbar(colours, cax=bar, label=SCALARS[options.scalar][0], orientation="horizontal", extend="max")
    draw_contact(right, history, nearest_record(history, TIME))
    right.set_title(f"contact from below, t = {TIME:g} s", fontsize=10)
    keys = [Swatch(color=colour, label=STATE_NAMES[state]) for state, colour in STATE_COLOURS.items()]
    right.legend(handles=keys, ncols=3, fontsize=8, loc="upper left", bbox_to_anchor=(0.0, 0.0), frameon=False)
    figure.savefig(Path(__file__).with_name("solid.png"), dpi=DOTS_PER_INCH)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results"))
