"""A study before it is run: whether it can be, what it costs, its mesh, and its specimen drawn."""

from __future__ import annotations

import dataclasses
import difflib
import itertools
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from fingerslip.dynamics.recording.schedule import record_bytes, step_times
from fingerslip.dynamics.system.scheme import has_inertia
from fingerslip.errors import InputError, Mistakes
from fingerslip.mesh.io import write_mesh
from fingerslip.mesh.source import MeshFile
from fingerslip.model.model import Model
from fingerslip.model.programme import CONSTANT
from fingerslip.model.timing import Adaptive, QuasiStatic
from fingerslip.results import REPEAT, SAMPLE
from fingerslip.slip.measures import resolution_warnings
from fingerslip.specimens.choice import SPECIMENS, preset_names, presets_of
from fingerslip.specimens.protocol import Specimen
from fingerslip.storage.files import csv_text, write_text, writing
from fingerslip.study.convergence import refinement_warnings
from fingerslip.study.definition.runs import Plan, plan_study
from fingerslip.study.running.build import Job, groups, inspect_mesh, prepare_samples
from fingerslip.study.running.cost import compiling_words, estimated_seconds, kinds_to_compile, process_bytes
from fingerslip.tables.table import Column, Table
from fingerslip.units import LengthUnit, metres, millimetres

# What numbers samples and repeats in the names of runs.
_NUMBER = re.compile(rf"({SAMPLE}|{REPEAT})-\d+")

_Row: TypeAlias = tuple[str, str, str, int, int, int | str, float]

_LARGEST_FRICTION = 2.0
_AT_ONCE = " It acts at once, so that the plate rings: give it a ramp."
_WIDTH = 0.01  # about that of the contact of a fingertip, across it [m]
_COLUMNS = (
    *map(Column, ("study", "run", "state", "degrees of freedom", "records", "steps")),
    Column("estimated time", "s", 0),
)
_CONTROLLED = (
    " With step: auto the number of steps is known only afterwards. 'At least' means one for each record, two where"
    " quasi-static, and the time is that of so many."
)


def check_plans(plans: Sequence[Plan], mistakes: Mistakes | None = None) -> Table:
    """Check studies, and estimate the size and time of every run.

    Mistakes are collected where that is asked for and a study is without; else they are raised.
    """
    rows: list[_Row] = []
    job_groups: list[list[Job]] = []
    doubts: list[str] = []
    drives: list[str] = []
    collected = Mistakes() if mistakes is None else mistakes
    for plan in plans:
        with collected.collect():
            finished, name = plan.finished_runs(), plan.source.name
            jobs, refused = prepare_samples(plan, plan.runs)
            for job in jobs:
                rows.append((name, job.run.name, "finished" if job.run.name in finished else "to do", *_size(job)))
                doubts += [f"{name}: {doubt.text}" for doubt in job.doubts]
            rows += [(name, sample.name, f"refused: {sample.reason}", 0, 0, 0, 0.0) for sample in refused]
            doubts += [f"{name}: {warning}" for warning in (*refinement_warnings(plan), *_doubts_of(plan))]
            measured = resolution_warnings({title: result.numbers for title, result in finished.items()})
            doubts += [f"{name}: {warning.rstrip('.')}" for warning in measured]
            drives += dict.fromkeys(drive for job in jobs for drive in _drives(job.model))
            job_groups += groups([job for job in jobs if job.run.name not in finished])
    if mistakes is None or not rows:
        collected.raise_all()
    warnings = list(dict.fromkeys(doubts))
    title = "Checked: the others have mistakes" if collected.found else "Checked: no mistakes found"
    title += f", {len(warnings)} warning{'s' * (len(warnings) != 1)}" * bool(warnings)
    note = "\n".join(
        (_note(rows, job_groups), *dict.fromkeys(drives), *(f"WARNING: {warning}." for warning in warnings))
    )
    return Table(title, _COLUMNS, tuple(rows), note)


def _drives(model: Model) -> Iterator[str]:
    """Yield what forces on the counterfaces of a section would be on a finger."""
    for number, contact in enumerate(model.contacts):
        if contact.drive is not None and model.mesh.dim() == 2:
            force, per_metre = contact.drive.force, contact.drive.force / model.depth
            yield (
                f"contacts.{number}.drive: {force:.4g} N on a section {millimetres(model.depth)} deep is "
                f"{1e-3 * per_metre:.3g} N per mm: as much as {per_metre * _WIDTH:.4g} N on a finger that touches over "
                f"{millimetres(_WIDTH)}.{_AT_ONCE * (contact.drive.ramp == CONSTANT and has_inertia(model))}"
            )


def _doubts_of(plan: Plan) -> Iterator[str]:
    """Yield what is doubtful in a study as it is written."""
    small = [run.study.mesh for run in plan.runs if run.study.kinematics == "small"]
    if any(getattr(mesh, "file", "").lower().endswith(".feb") for mesh in small):
        yield "kinematics: is small, and FEBio computes at large strain: write kinematics: finite to compare with it"
    # A comma for a decimal point makes three coefficients: [0.3, 0,6].
    values = [run.swept[path] for run in plan.runs for path in run.swept if path.endswith("friction_coefficient")]
    swept = sorted({float(value) for value in values if isinstance(value, int | float)})
    if swept and (swept[-1] > _LARGEST_FRICTION or (swept[0] <= 0.0 and len(swept) > 1)):
        listed = ", ".join(f"{value:g}" for value in swept)
        yield f"sweep: has friction coefficients of {listed}: if one is 0.6, write a point, as 0,6 is two numbers"
    # Latencies that no run lasts, such as seconds for milliseconds.
    pairs = [(run.study.reaction, run.study.held_object) for run in plan.runs]
    lasting = max((held.duration for _, held in pairs if held), default=0.0)
    latencies = (time for reaction, _ in pairs if reaction for time in (reaction.reflex.latency, *reaction.latencies))
    if (longest := max(latencies, default=0.0)) > lasting:
        yield f"reaction: has a latency of {longest:g} s, and no run lasts over {lasting:g} s after its load begins"
    for held in filter(None, (held for _, held in pairs)):
        if 0.0 < _MOST_WEIGHTS * held.first_load < (load := max(map(abs, held.load.series()[1]))):
            yield f"reaction.load: reaches {load:g} N, over {_MOST_WEIGHTS:g} times the weight; are these mN?"


def fold_samples(table: Table) -> Table:
    """Return a table of checks for people: one row for neighbouring samples, or repeats, that cost the same."""
    rows: list[tuple[Any, ...]] = []
    for _, alike in itertools.groupby(table.rows, lambda row: (_NUMBER.sub("", str(row[1])), row[0], row[2:])):
        group = list(alike)
        if _NUMBER.search(str(group[0][1])) and len(group) > 1:
            study, name, *others = group[0]
            group = [(study, f"{len(group)} runs: {name} to {group[-1][1]}", *others)]
        rows += (
            (*row[:-1], "under 1" if isinstance(time := row[-1], float) and 0.0 < time < 1.0 else time) for row in group
        )
    return dataclasses.replace(table, rows=tuple(rows))


def _note(rows: Sequence[_Row], job_groups: Sequence[Sequence[Job]]) -> str:
    """Say how long all runs take, and what the groups need that are computed together."""
    to_do = [row for row in rows if row[2] == "to do"]
    controlled, seconds = any(isinstance(row[-2], str) for row in rows), sum(row[-1] for row in to_do)
    about = "at least" if any(isinstance(row[-2], str) for row in to_do) else "about"
    runs = f"{len(rows)} run{'s' * (len(rows) != 1)}"
    models = [job.model for jobs in job_groups for job in jobs]
    more = "Meshing, reduced bases" if any(model.basis for model in models) else "Meshing"
    note = f"{runs}, {about} {max(seconds / 60, 0.1):.1f} min of computing in one process."
    note += f" {more} and the report come on top."
    if compiling := compiling_words(kinds_to_compile(models)):
        note += f" Before the first run: {compiling}."
    shared = [len(part) for part in job_groups if len(part) > 1]
    if shared:
        matrices = f"{len(shared)} group{'s' * (len(shared) != 1)}"
        note += f" {sum(shared)} of those to do are computed in {matrices} with one matrix each."
    memory = []
    for jobs in job_groups:
        n_dofs, dim = jobs[0].n_dofs, jobs[0].model.mesh.dim()
        records = sum(record_bytes(job.model, n_dofs // dim, job.contact_nodes) for job in jobs)
        memory.append(process_bytes(n_dofs, records, dim))
    note += f" Each process takes about {max(memory) / 1e9:.1f} GB." if memory else ""
    return note + _CONTROLLED * controlled


def _size(job: Job) -> tuple[int, int, int | str, float]:
    """Return the unknowns, records behind the start, steps (in words where the error decides) and seconds of a run."""
    model, reaction = job.model, job.run.study.reaction
    unknowns, records, time = job.n_dofs, step_times(model).size - 1, model.time
    # Steps that control their error are halved where quasi-static.
    halved = isinstance(time, Adaptive) and time.scheme == "quasi_static"
    steps, is_static = records * (2 if halved else 1), halved or isinstance(time, QuasiStatic)
    count = f"at least {steps:,}" if isinstance(time, Adaptive) else steps
    how = {"is_static": is_static, "in_basis": model.basis is not None}
    seconds = estimated_seconds(unknowns, steps, model.mesh.dim(), model.kinematics, **how)
    return unknowns, records, count, seconds * (reaction.computed_runs if reaction else 1)


_STUDIES = (".yaml", ".yml")
_MOST_WEIGHTS = 100.0  # load of a held object over its weight
_LIKELY = (1e-4, 0.5)  # extents of a body that nobody doubts [m]
_PICTURES = (".png", ".svg", ".pdf")


def save_meshes(
    targets: Sequence[str], output: Path | None, unit: LengthUnit | None, show: Callable[[Sequence[Table]], None]
) -> None:
    """Write or draw meshes as :func:`save_mesh`; tables are shown before anything is drawn."""
    if output is not None and len(targets) > 1:
        fault = f"got {output} for {len(targets)} meshes"
        raise InputError("mesh --output", fault, "needs a single mesh", "leave it out: files go to meshes/")
    others: dict[str, str] = {}
    for target in targets:
        path = Path(target)
        other = others.setdefault(path.stem if path.suffix in _STUDIES else path.name, target)
        if other != target:
            fault = f"would be written over {other}, which has the same name"
            raise InputError(f"mesh {target}", fault, "needs a name of its own", "mesh it alone, with --output")
    pictures: list[Callable[[], None]] = []
    show([table for target in targets for table in save_mesh(target, output, unit, pictures.append)])
    for draw in pictures:
        draw()


def save_mesh(
    target: str,
    path: Path | None = None,
    unit: LengthUnit | None = None,
    draw: Callable[[Callable[[], None]], object] = lambda picture: picture(),
) -> tuple[Table, ...]:
    """Write or draw the mesh of a study (of its first run), of a preset or of a file, and say what to know of it."""
    name, names, suffix = target, preset_names(), None
    if unit is not None and (name in names or Path(target).suffix in _STUDIES):
        raise InputError("mesh --unit", f"got {unit!r} beside {target}", "belongs to mesh files alone", "leave it out")
    if Path(target).suffix in _STUDIES:
        name, inspected = Path(target).stem, inspect_mesh(plan_study(target).runs[0])
    elif name in names:
        specimen: Specimen = presets_of(name).read(name)
        inspected = specimen.default_mesh.inspect(specimen)
    elif Path(target).is_file():
        metres(unit or "m")
        name, inspected, suffix = Path(target).stem, MeshFile(target, unit).inspect(), f"{Path(target).suffix}.png"
    else:
        near = difflib.get_close_matches(name, names, n=1)
        repair = f"did you mean '{near[0]}'?" if near else f"presets: {', '.join(names)}"
        allowed = "needs the name of a preset or the path of a study (.yaml) or of a mesh"
        fault = "is no file that is there" if Path(target).suffix else "is neither a preset nor a file that is there"
        fault = "is a folder" if Path(target).is_dir() else fault
        raise InputError(f"mesh {name}", fault, allowed, repair)
    path = path or Path("meshes") / f"{name}{suffix or inspected.suffix}"
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix not in _PICTURES:
            write_mesh(inspected.mesh, path)
        if path.suffix not in (*_PICTURES, ".msh"):  # which has names itself
            regions = enumerate(inspected.mesh.subdomains or {})
            write_text(path.with_suffix(".regions.csv"), csv_text([("number", "region"), *regions]))
    if path.suffix in _PICTURES:

        def picture() -> None:
            # Libraries that draw are slow to load.
            from fingerslip.report.figures.meshes import mesh_figure
            from fingerslip.report.figures.style import save_figure

            # Specimens stand on y, as files of most preprocessors do on z.
            save_figure(mesh_figure(inspected.mesh, name, up="y" if suffix is None else "z"), path)

        draw(picture)
    first, *others = inspected.tables
    assumes = suffix is not None and MeshFile(target, unit).assumes_metres
    note = f"{first.note}; lengths are taken as metres without --unit" if assumes else first.note
    extent = float(np.ptp(inspected.mesh.p, axis=1).max())
    if suffix is not None and not _LIKELY[0] <= extent <= _LIKELY[1]:
        note += f"\nWARNING: it is {extent:.3g} m large: say the unit of its lengths, such as --unit mm."
    return (dataclasses.replace(first, title=str(path), note=note), *others)


def draw_specimen(target: str, path: Path) -> None:
    """Draw a fingertip, both sections and the finger in 3D, or a sensor, cut open and its markers."""
    # Libraries that draw are slow to load.
    from fingerslip.report.figures.specimens import SPECIMEN_FIGURES
    from fingerslip.report.figures.style import save_figure

    if path.suffix not in _PICTURES:
        raise InputError("show --figure", f"got '{path}'", f"needs a file that ends in {', '.join(_PICTURES)}")
    if Path(target).suffix in _STUDIES:
        run = plan_study(target).runs[0]
        kind, specimen = run.study.specimen_kind, run.specimen
    else:
        presets = presets_of(target)
        kind, specimen = next(kind for kind, of_kind in SPECIMENS.items() if of_kind is presets), presets.read(target)
    if kind is None:
        raise InputError(f"show {target}", "has no specimen to draw", f"needs a study with a {' or '.join(SPECIMENS)}")
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    save_figure(SPECIMEN_FIGURES[kind](specimen, Path(target).stem), path)
