"""All that ``fingerslip validate`` prints: rows of studies that are run, and of parts that are stored."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path

from fingerslip.errors import InputError, shorten
from fingerslip.published import PublishedValue, published_set
from fingerslip.slip.windows import READINGS, event_label
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.shipped import studies_folder
from fingerslip.validation.checks import PHALANX_CHECKS, outcome_of
from fingerslip.validation.evidence import FORMULATION, REFINED, SECTION, SOLID, TABLE2, VARIANT, Evidence, Work, gather
from fingerslip.validation.measures import SOLID_READINGS
from fingerslip.validation.rows import Basis, Comparison, Row, Stored, allowed_geometry, number_row, statement_row
from fingerslip.validation.sensor import detection_rows, pouring_rows, sensor_rows

#: Papers whose values are compared: on fingers, and on a tactile sensor.
PAPERS = ("wang2014", "bulens2023")


# Travel of the plate at 3 mm/s, over a friction coefficient of 0.6 times 1.5 mm.
_TRAVEL_PER_SECOND = 3.0 / (0.6 * 1.5)
# Statements on the phalanges that do not rest on acceleration peaks, of which large strain shows no other ones.
_AT_LARGE_STRAIN = {
    *("overall-order", "latency-order", "edges-first"),
    *("density-rises", "density-then-stays", "density-larger-in-b"),
}


def validate(work: Work, *, papers: Sequence[str] = PAPERS) -> tuple[Row, ...]:
    """Run the shipped studies, as far as they are not finished, and compare them with the values of papers.

    Calibrated rows are first, then the predictions, misses included; those on the sensor are last.
    """
    fingers, sensors = (paper in papers for paper in PAPERS)
    return (*(rows_of(gather(work)) if fingers else ()), *(sensor_rows(work) if sensors else ()))


def rows_of(evidence: Evidence) -> tuple[Row, ...]:
    """Return the rows, calibrated ones first."""
    table, statements = (published_set(f"wang2014-{name}").values for name in ("table2", "qualitative"))
    times = (*table, *(value for value in published_set("wang2014-peaks").values if value.quantity == "three_quarter"))
    overall = [value for value in table if value.quantity == "overall"]
    finite = evidence.at_large_strain()
    rows = (
        *(_time_row(evidence, value, basis="calibrated" if value.calibrated else "predicted") for value in times),
        *(_time_row(evidence, value, "acceleration") for value in times),
        *_travel_rows(evidence),
        *_height_rows(evidence),
        *(_time_row(evidence, value, study=FORMULATION, model="plane strain") for value in overall),
        *(_time_row(evidence, value, study=SECTION, model="transverse") for value in overall),
        *_solid_rows(evidence),
        *(_statement_row(evidence, value, "predicted") for value in statements),
        *(_time_row(finite, value, model="large strain", basis="large strain") for value in table),
        *(_statement_row(finite, value, "large strain") for value in statements if value.id in _AT_LARGE_STRAIN),
    )
    return tuple(sorted(rows, key=lambda row: row.basis != "calibrated"))


def _time_row(
    evidence: Evidence,
    value: PublishedValue,
    reading: str = "slip",
    *,
    study: str = TABLE2,
    model: str = "",
    basis: Basis = "predicted",
) -> Row:
    """Return the row of a published time beside that of a model of the section, in one reading."""
    variant = str(value.conditions[VARIANT])
    run = evidence.one(study, {VARIANT: variant, **REFINED[study]}).run
    ours = run.events.reading(reading).time(value.quantity)
    uncertainty = run.uncertainty.get(f"{reading}.{value.quantity}")
    name = f"{event_label(value.quantity)}, {', '.join(filter(None, (variant, model)))} ({READINGS[reading]})"
    comparable = reading != "slip" or not value.otherwise
    return number_row(name, value, ours, uncertainty, basis=basis, comparable=comparable)


def _travel_rows(evidence: Evidence) -> Iterator[Row]:
    """Yield the travel of the plate at overall slip in units of friction times indentation."""
    for value in published_set("wang2014-derived").values:
        variant = value.conditions[VARIANT]
        ours = evidence.one(TABLE2, {VARIANT: variant})
        error = ours.run.uncertainty.get("slip.overall")
        uncertainty = None if error is None else error * _TRAVEL_PER_SECOND
        name = f"travel of the plate at overall slip / (friction x depth), {variant} (accumulated slip)"
        basis: Basis = "calibrated" if value.calibrated else "predicted"
        yield number_row(name, value, ours.travel, uncertainty, basis=basis)


def _height_rows(evidence: Evidence) -> Iterator[Row]:
    """Yield the heights of the peaks, which are not judged: they depend on mesh, step and numerical damping."""
    for value in published_set("wang2014-peak-acceleration").values:
        ours = evidence.one(TABLE2, {VARIANT: value.conditions[VARIANT]})
        incipient = value.quantity == "incipient_peak"
        peak = ours.incipient_peak if incipient else ours.overall_peak
        uncertainty = None if incipient else ours.run.uncertainty.get("overall_peak_height_m_per_s2")
        name = f"height of the {event_label(value.quantity.removesuffix('_peak'))} peak, {value.conditions[VARIANT]}"
        yield number_row(name, value, None if peak is None else peak.height, uncertainty)


def _solid_rows(evidence: Evidence) -> Iterator[Row]:
    """Yield the times of the fingertip in 3D, each in the reading of the paper.

    Uncertainties are numerical; for reference nodes together with that of the distance they have to leave, and with the
    largest change over the refinements, as `fingerslip converge` knows no reference nodes.
    """
    (measures,) = evidence.measured[SOLID]
    for value in published_set("wang2014-solid").values:
        runs = [entry.run.events.reading(value.reading) for entry in (measures, *evidence.refined_solid)]
        ours, *times = (events.time(value.quantity) for events in runs)
        uncertainty = measures.run.uncertainty.get(f"slip.{value.quantity}")
        if value.reading != "slip":
            changes = [abs(time - ours) for time in times if time is not None and ours is not None]
            reading = measures.node_range(value.quantity) if value.reading == "displacement" else None
            sources = [max(changes) if changes and len(changes) == len(times) else None, reading]
            numbers = [number for number in sources if number is not None]
            uncertainty = math.hypot(*numbers) if numbers else None
        name = f"{event_label(value.quantity)}, fingertip in 3D ({SOLID_READINGS[value.reading]})"
        yield number_row(name, value, ours, uncertainty)


def _statement_row(evidence: Evidence, value: PublishedValue, basis: Basis) -> Row:
    """Return the row of a statement; our latency begins with a share of the area, the paper's with a peak."""
    uncertainty = evidence.spread_of(lambda other: outcome_of(value.id, other)) if value.id in PHALANX_CHECKS else None
    comparable = value.quantity != "latency"
    return statement_row(value, outcome_of(value.id, evidence), uncertainty, basis=basis, comparable=comparable)


#: Parts that take so long that they are stored, and the paper that each of them is compared with.
PARTS: Mapping[str, str] = {"geometry": "wang2014", "pouring": "bulens2023", "detection": "bulens2023"}
_ROWS: Mapping[str, Callable[..., Stored[Row]]] = {"pouring": pouring_rows, "detection": detection_rows}


def compare(
    studies: str | Path | None = None,
    results: str | Path = "results",
    workers: int = 2,
    progress: StudyProgress | None = None,
    *,
    only: str | None = None,
    computed: Collection[str] = (),
) -> Comparison:
    """Compare the shipped studies with published values: of all papers or `only` one of them.

    The :data:`PARTS` in `computed` are computed; rows of the others are read where they are stored.
    """
    if only not in (None, *PAPERS):
        raise InputError("--only", f"got {shorten(only)!r}", f"needs one of {', '.join(PAPERS)}")
    if others := [part for part in computed if only not in (None, PARTS[part])]:
        fault = f"is of {PARTS[others[0]]}"
        raise InputError(f"--{others[0]}", fault, f"needs no --only {only}", "leave one of them out")
    papers = PAPERS if only is None else (only,)
    work = Work(studies_folder() if studies is None else Path(studies), Path(results), workers, progress)
    # Stored rows first: a damaged file is told before anything is computed.
    geometry = allowed_geometry(work, compute="geometry" in computed) if "wang2014" in papers else None
    row_groups = [rows(work, compute=part in computed) for part, rows in _ROWS.items() if PARTS[part] in papers]
    rows = (*validate(work, papers=papers), *(row for part in row_groups for row in part.rows))
    return Comparison(rows, tuple(part.origin for part in row_groups if part.origin), geometry)
