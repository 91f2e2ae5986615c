"""Write results/reference/validation-details.md: the numbers of docs/validation.md that are not in the table of rows.

`python docs/figures/make_reference.py` runs what this needs, and this with it. By hand:
First: fingerslip validate
       fingerslip run studies/wang2014_{calibration,direction,peaks,accidents,thickness,damping}.yaml
       fingerslip run studies/{stick_slip_friction,slip_weakening,wang2014_3d_tetrahedra,wang2014_3d_patch}.yaml
Then: python docs/figures/make_details.py [RESULTS]
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.signal import find_peaks

from fingerslip.contact.states import OPEN
from fingerslip.history import read_history
from fingerslip.report.tables.runs import events_table
from fingerslip.results import HISTORY
from fingerslip.slip import (
    EventSettings,
    acceleration_peaks,
    find_events,
    peak_signal,
    reference_events,
    slide_window,
    slipped_fraction,
)
from fingerslip.study.storage.reporting import read_results
from fingerslip.tables.table import Cell, Column, Missing, Table, to_markdown
from fingerslip.validation.measures import NODE_TOLERANCES, REFERENCE_NODES, measure

ROOT = Path(__file__).parents[2]
SETTINGS = EventSettings()
# After the transition from press to slide (at alpha = -0.05 it rings to 1.22 s), and before overall slip [s].
BEFORE_OVERALL = (1.25, 1.66)
# The same with friction that drops, where overall slip comes earlier [s].
BEFORE_DROP = (1.25, 1.55)
LEAST_PEAK = 0.01
EVENTS_OF = ("calibration", "direction", "formulation", "section", "friction", "fingerprint", "thickness")
MOMENTS = (1.48, 1.50, 1.53)
PUBLISHED_INCIPIENT = {"original": 1.53, "flattened": 1.50, "scaled": 1.48}
NODES = NODE_TOLERANCES
AT_LIMIT = 0.99


def main(results: Path) -> None:
    """Write all tables."""
    tables = (
        *(events(results / f"wang2014_{name}") for name in EVENTS_OF),
        fits(results / "wang2014_friction"),
        forces(results / "wang2014_formulation"),
        peaks(results / "wang2014_peaks", BEFORE_OVERALL),
        peaks(results / "stick_slip_friction", BEFORE_DROP),
        drops(results / "stick_slip_friction"),
        peaks(results / "slip_weakening", BEFORE_DROP),
        drops(results / "slip_weakening"),
        slipped(results / "wang2014_table2"),
        receptors(results / "wang2014_table2"),
        densities(results / "wang2014_table2"),
        vibrations(results),
        accidents(results / "wang2014_accidents"),
        nodes(results),
    )
    text = "".join(f"\n## {table.title}\n\n{to_markdown(table)}" for table in tables)
    path = ROOT / "results" / "reference" / "validation-details.md"
    path.write_text(f"# Details of the validation\n\nMade by `python docs/figures/make_details.py`.\n{text}")


def events(study: Path) -> Table:
    """List the slip events of a study."""
    stored = read_results(study)
    table = events_table(stored.runs)
    return Table(f"{stored.title}: {table.title.lower()}", table.columns, table.rows)


def fits(study: Path) -> Table:
    """Fit straight lines through the moments of slip against friction."""
    columns = (
        *(Column("moment"), Column("slope", "s", 3), Column("at no friction", "s", 3)),
        Column("coefficient of determination", digits=5),
    )
    runs = read_results(study).runs
    friction = np.array([float(run.swept["contact.friction_coefficient"]) for run in runs])
    rows = []
    for name in ("incipient", "overall"):
        moments = np.array([getattr(run.events.slip, name) for run in runs], dtype=float)
        slope, start = np.polyfit(friction, moments, 1)
        left = moments - start - slope * friction
        rows.append((name, float(slope), float(start), 1.0 - float(left @ left) / float(moments.var() * moments.size)))
    return Table("Straight lines through the moments against friction", columns, tuple(rows))


def forces(study: Path) -> Table:
    """Give the normal force at the start of the slide, and the travel of the plate up to overall slip."""
    columns = (
        *(Column("formulation"), Column("phalanx"), Column("normal force", "N", 3)),
        Column("travel of the plate to overall slip", "mm", 2),
    )
    rows = []
    for run in read_results(study).runs:
        history = read_history(study / run.name / HISTORY)
        window = slide_window(history)
        assert window is not None
        overall = find_events(history).overall or np.nan
        travel = np.abs(history["counterface_displacement"].values[:, 0, 0])
        normal = float(history["counterface_force"].values[window.first, 0, 1])
        rows.append((*run.swept.values(), normal, 1e3 * float(np.interp(overall, history["time"], travel))))
    return Table("Normal force and travel of the plate", columns, tuple(rows))


def peaks(study: Path, between: tuple[float, float]) -> Table:
    """Count the acceleration peaks before overall slip against what the study sweeps."""
    stored = read_results(study)
    columns = (
        *(Column(path.rpartition(".")[2].replace("_", " ")) for path in stored.runs[0].swept),
        *(Column("nodes in contact"), Column("peaks")),
        *(Column(name, "m/s²", 4) for name in ("smallest", "largest", "median of the signal")),
    )
    rows = tuple(_peak_row(study / run.name, tuple(run.swept.values()), between) for run in stored.runs)
    title = f"{stored.title}: peaks from {between[0]} to {between[1]} s with a prominence of {LEAST_PEAK} m/s² or more"
    return Table(title, columns, rows)


def drops(study: Path) -> Table:
    """Give overall slip and what friction carries at its largest and at the end."""
    stored = read_results(study)
    columns = (
        *(Column(path.rpartition(".")[2].replace("_", " ")) for path in stored.runs[0].swept),
        *(Column("overall slip", "s", 3), Column("largest friction force over normal force", digits=3)),
        Column("mean of it from 2.5 s on", digits=3),
    )
    rows = []
    for run in stored.runs:
        history = read_history(study / run.name / HISTORY).sel(time=slice(1.0, None))
        force = history["counterface_force"].values[:, 0]
        ratio = np.abs(force[:, 0]) / force[:, 1]
        late = float(ratio[history["time"].values > 2.5].mean())
        rows.append((*run.swept.values(), run.events.slip.overall, float(ratio.max()), late))
    return Table(f"{stored.title}: overall slip and friction force", columns, tuple(rows))


def _peak_row(folder: Path, swept: tuple[Cell, ...], between: tuple[float, float]) -> tuple[Cell, ...]:
    history = read_history(folder / HISTORY)
    signal = peak_signal(history, SETTINGS.peaks)
    window = slide_window(history)
    assert signal is not None
    assert window is not None
    values = signal.sel(time=slice(*between)).values
    heights = values[find_peaks(values, prominence=LEAST_PEAK)[0]]
    touching = int((history["contact_state"].values[window.first] != OPEN).sum())
    ends = (float(heights.min()), float(heights.max())) if heights.size else (None, None)
    return (*swept, touching, heights.size, *ends, float(np.median(values)))


def slipped(study: Path) -> Table:
    """Give the slipped fraction at the published incipient moments, and the force when slip is incipient with us."""
    columns = (
        Column("phalanx"),
        *(Column(f"slipped fraction at {moment:.2f} s", digits=2) for moment in MOMENTS),
        Column("fraction slipped by more than 20 µm at 1.1 s", digits=2),
        Column("fraction slipped at all at 1.1 s", digits=2),
        Column("friction force over its limit at incipient slip", digits=2),
    )
    return Table("How much had slipped", columns, tuple(_slipped_rows(study)))


def _slipped_rows(study: Path) -> Iterator[tuple[Cell, ...]]:
    for run in read_results(study).runs:
        history = read_history(study / run.name / HISTORY)
        window = slide_window(history)
        assert window is not None
        fraction = slipped_fraction(history, window, SETTINGS.slip_tolerance)
        at_all = slipped_fraction(history, window, 1e-9)
        slide = history.isel(time=window.records)
        force = slide["counterface_force"].values[:, 0]
        limit = float(history["counterface_friction_coefficient"].values[0]) * force[:, 1]
        ratio = np.interp(find_events(history).incipient or np.nan, slide["time"], np.abs(force[:, 0]) / limit)
        given = (float(np.interp(moment, fraction["time"], fraction)) for moment in (*MOMENTS, 1.1))
        yield (*run.swept.values(), *given, float(np.interp(1.1, at_all["time"], at_all)), float(ratio))


def receptors(study: Path) -> Table:
    """List the largest accelerations by receptor type."""
    kinds = ("FA-I", "SA-I", "SA-II", "FA-II")
    rows = []
    for run in read_results(study).runs:
        largest = measure(run, read_history(study / run.name / HISTORY)).largest_acceleration
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
    for run in read_results(study).runs:
        found = measure(run, read_history(study / run.name / HISTORY)).densities
        assert found is not None
        rows += [
            (*run.swept.values(), *pair, found.mean_after[pair], found.growth[pair], found.range_after[pair])
            for pair in found.growth
        ]
    return Table("Strain energy density", columns, tuple(rows))


def vibrations(results: Path) -> Table:
    """List noise, peak and vibration after overall slip against friction and fingerprint."""
    columns = (
        *(Column("study"), Column("run"), Column("noise floor", "m/s²", 4), Column("overall peak", "m/s²", 3)),
        Column("root mean square after overall slip", "m/s²", 4),
    )
    rows: list[tuple[Cell, ...]] = []
    for name in ("friction", "damping", "fingerprint"):
        study = results / f"wang2014_{name}"
        for run in read_results(study).runs:
            found = measure(run, read_history(study / run.name / HISTORY))
            peak = found.overall_peak
            rows.append(
                (name, run.name, found.peaks.noise_floor, peak.height if peak else Missing.NO_EVENT, found.rms_after)
            )
    return Table("Noise, peak of overall slip, and vibration after it", columns, tuple(rows))


def accidents(study: Path) -> Table:
    """List the first peak, the one nearest to the published incipient time, and that of overall slip."""
    columns = (
        *(Column("contact elements"), Column("phalanx"), Column("peaks before overall slip")),
        *(Column("first", "s", 4), Column("height", "m/s²", 3), Column("median step between peaks", "ms", 0)),
        *(Column("nearest to the published time", "s", 4), Column("its height", "m/s²", 3)),
        *(Column("overall", "s", 4), Column("height of overall", "m/s²", 2)),
    )
    rows: list[tuple[Cell, ...]] = []
    for run in read_results(study).runs:
        found = acceleration_peaks(read_history(study / run.name / HISTORY))
        assert found.largest is not None
        before = [peak for peak in found.peaks if peak.time < found.largest.time]
        published = PUBLISHED_INCIPIENT[str(run.swept["fingertip.phalanx.variant"])]
        near = min(before, key=lambda peak: abs(peak.time - published))
        steps = 1e3 * np.diff([peak.time for peak in before])
        first = (before[0].time, before[0].height, float(np.median(steps)))
        overall = (found.largest.time, found.largest.height)
        rows.append((*run.swept.values(), len(before), *first, near.time, near.height, *overall))
    return Table("Acceleration peaks on contact elements of 0.5 to 0.7 mm, steps of 2.5 ms", columns, tuple(rows))


def nodes(results: Path) -> Table:
    """List when the eight reference nodes leave the plate's line, and the size of the contact."""
    columns = (
        *(Column("study"), Column("run"), Column("nodes of the mesh")),
        *(Column(f"{which} at {1e6 * tolerance:.0f} µm", "s", 3) for which in ("first", "last") for tolerance in NODES),
        *(Column("10 % of the area", "s", 3), Column("all of it", "s", 3)),
        *(Column("length of the contact", "mm", 1), Column("width", "mm", 1), Column("area at the limit", "%", 0)),
        Column("stepping, CPU", "s", 0),
    )
    rows: list[tuple[Cell, ...]] = []
    for name in ("wang2014_3d", "wang2014_3d_tetrahedra", "wang2014_3d_patch"):
        for run in read_results(results / name).runs:
            history = read_history(results / name / run.name / HISTORY)
            read = [reference_events(history, REFERENCE_NODES, EventSettings(displacement_tolerance=t)) for t in NODES]
            times = (*(one.incipient for one in read), *(one.overall for one in read))
            mesh = (name, run.name, history.sizes["node"])
            events = run.events.slip
            cost = float(history.attrs["cpu_seconds_stepping"])
            rows.append((*mesh, *times, events.incipient, events.overall, *contact_size(history), cost))
    title = "The fingertip in 3D: eight reference nodes, and the contact when the slide begins"
    return Table(title, columns, tuple(rows))


def contact_size(history: xr.Dataset) -> tuple[float, float, float]:
    """Return length and width of the contact [mm] when the slide begins, and the share of its area at the limit [%]."""
    window = slide_window(history)
    assert window is not None
    touching = history["contact_state"].values[window.first] != OPEN
    along, _, across = np.ptp(history["contact_position"].values[touching], axis=0)
    tangential = np.linalg.norm(history["tangential_traction"].values[window.first][touching], axis=-1)
    friction = float(history["counterface_friction_coefficient"].values[0])
    limit = friction * history["normal_traction"].values[window.first][touching]
    area = history["contact_area"].values[touching]
    return 1e3 * along, 1e3 * across, 100.0 * float(area[tangential > AT_LIMIT * limit].sum() / area.sum())


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results"))
