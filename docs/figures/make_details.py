"""Write results/reference/validation-details.md: the numbers of docs/validation.md that are not in the table of rows.

First: fingerslip validate && fingerslip run studies/wang2014_peaks.yaml
Then: python docs/figures/make_details.py [RESULTS]
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.signal import find_peaks

from fingerslip.history import OPEN, read_history
from fingerslip.report.tables import Cell, Column, Table, to_markdown
from fingerslip.report.tables_events import events_table
from fingerslip.slip import EventSettings, find_events, peak_signal, slide_window, slipped_fraction
from fingerslip.study.reporting import read_stored
from fingerslip.study.validation.measures import measure

ROOT = Path(__file__).parents[2]
SETTINGS = EventSettings()
# After the transition from press to slide (at alpha = -0.05 it rings to 1.22 s), and before overall slip [s].
BEFORE_OVERALL = (1.25, 1.66)
LEAST_PEAK = 0.01
MOMENTS = (1.48, 1.50, 1.53)


def main() -> None:
    """Write all tables."""
    results = Path(sys.argv[1] if len(sys.argv) > 1 else "results")
    tables = (
        *(events(results / f"wang2014_{name}") for name in ("formulation", "section", "friction", "fingerprint")),
        peaks(results / "wang2014_peaks"),
        slipped(results / "wang2014_table2"),
        receptors(results / "wang2014_table2"),
        densities(results / "wang2014_table2"),
        vibrations(results),
    )
    text = "".join(f"\n## {table.title}\n\n{to_markdown(table)}" for table in tables)
    path = ROOT / "results" / "reference" / "validation-details.md"
    path.write_text(f"# Details of the validation\n\nMade by `python docs/figures/make_details.py`.\n{text}")


def events(study: Path) -> Table:
    """List the slip events of a study."""
    stored = read_stored(study)
    table = events_table(stored.runs)
    return Table(f"{stored.title}: {table.title.lower()}", table.columns, table.rows)


def peaks(study: Path) -> Table:
    """Count the acceleration peaks before overall slip, against contact size and numerical damping."""
    columns = (
        *(Column("contact elements"), Column("alpha"), Column("nodes in contact"), Column("peaks")),
        *(Column(name, "m/s²", 4) for name in ("smallest", "largest", "median of the signal")),
    )
    rows = tuple(_peak_row(study / run.label, tuple(run.swept.values())) for run in read_stored(study).runs)
    low, high = BEFORE_OVERALL
    return Table(
        f"Acceleration peaks from {low} to {high} s whose prominence is {LEAST_PEAK} m/s² or more", columns, rows
    )


def _peak_row(folder: Path, swept: tuple[Cell, ...]) -> tuple[Cell, ...]:
    history = read_history(folder / "history.nc")
    signal = peak_signal(history, SETTINGS.peaks)
    window = slide_window(history)
    assert signal is not None
    assert window is not None
    values = signal.sel(time=slice(*BEFORE_OVERALL)).values
    heights = values[find_peaks(values, prominence=LEAST_PEAK)[0]]
    touching = int((history["contact_state"].values[window.first] != OPEN).sum())
    ends = (float(heights.min()), float(heights.max())) if heights.size else (None, None)
    return (*swept, touching, heights.size, *ends, float(np.median(values)))


def slipped(study: Path) -> Table:
    """Give the slipped fraction at the published incipient moments, and the force when slip is incipient with us."""
    columns = (
        Column("phalanx"),
        *(Column(f"slipped fraction at {moment:.2f} s", digits=2) for moment in MOMENTS),
        Column("fraction slipped at all at 1.1 s", digits=2),
        Column("friction force over its limit at incipient slip", digits=2),
    )
    return Table("How much had slipped", columns, tuple(_slipped_rows(study)))


def _slipped_rows(study: Path) -> Iterator[tuple[Cell, ...]]:
    for run in read_stored(study).runs:
        history = read_history(study / run.label / "history.nc")
        window = slide_window(history)
        assert window is not None
        fraction = slipped_fraction(history, window, SETTINGS.slip_tolerance)
        at_all = slipped_fraction(history, window, 1e-9)
        slide = history.isel(time=window.records)
        force = slide["body_force"].values[:, 0]
        limit = float(history["body_friction_coefficient"].values[0]) * force[:, 1]
        ratio = np.interp(find_events(history).incipient or np.nan, slide["time"], np.abs(force[:, 0]) / limit)
        given = (float(np.interp(moment, fraction["time"], fraction)) for moment in MOMENTS)
        yield (*run.swept.values(), *given, float(np.interp(1.1, at_all["time"], at_all)), float(ratio))


def receptors(study: Path) -> Table:
    """List the largest accelerations by receptor type."""
    kinds = ("FA-I", "SA-I", "SA-II", "FA-II")
    rows = []
    for run in read_stored(study).runs:
        largest = measure(run, read_history(study / run.label / "history.nc")).largest_acceleration
        rows.append((*run.swept.values(), *(largest[kind] for kind in kinds)))
    columns = (Column("phalanx"), *(Column(kind, "m/s²", 3) for kind in kinds))
    return Table("Largest tangential acceleration after the transition", columns, tuple(rows))


def densities(study: Path) -> Table:
    """List the strain energy density by receptor type and area, original and scaled phalanx."""
    columns = (
        *(Column("phalanx"), Column("type"), Column("area")),
        *(Column("mean after overall slip", "J/m³", 0), Column("over that at the start of the slide", digits=2)),
        Column("range after overall slip over mean", digits=4),
    )
    rows: list[tuple[Cell, ...]] = []
    for run in read_stored(study).runs:
        found = measure(run, read_history(study / run.label / "history.nc")).densities
        assert found is not None
        rows += [
            (*run.swept.values(), *place, found.mean_after[place], found.growth[place], found.range_after[place])
            for place in found.growth
        ]
    return Table("Strain energy density", columns, tuple(rows))


def vibrations(results: Path) -> Table:
    """List noise, peak and vibration after overall slip against friction and fingerprint."""
    columns = (
        *(Column("study"), Column("run"), Column("noise floor", "m/s²", 4), Column("overall peak", "m/s²", 3)),
        Column("root mean square after overall slip", "m/s²", 4),
    )
    rows: list[tuple[Cell, ...]] = []
    for name in ("friction", "fingerprint"):
        study = results / f"wang2014_{name}"
        for run in read_stored(study).runs:
            found = measure(run, read_history(study / run.label / "history.nc"))
            peak = found.overall_peak
            rows.append((name, run.label, found.peaks.noise_floor, peak.height if peak else None, found.rms_after))
    return Table("Noise, peak of overall slip, and vibration after it", columns, tuple(rows))


if __name__ == "__main__":
    main()
