"""``fingerslip cite``: what was run as a paragraph of methods, and the papers behind it as BibTeX."""

from __future__ import annotations

import csv
import io
import itertools
import logging
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from fingerslip.errors import ResultError
from fingerslip.history import site_kinds
from fingerslip.libraries import xr
from fingerslip.mesh.mixed import is_degenerate
from fingerslip.published import published_set
from fingerslip.report.citations import bibtex_entries, short_citation, source_keys
from fingerslip.report.labels import path_labels, run_title
from fingerslip.report.page.answer import definitions
from fingerslip.report.tables.parameters import ASSUMED
from fingerslip.results import ABOUT, SUMMARY, RunResult, stored_fit
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import EventSettings
from fingerslip.study.inspection.facts import Facts, read_facts
from fingerslip.study.storage.reporting import STUDY_FILE, notes_at_rest, original_mesh
from fingerslip.uncertainty import SETTINGS, settings_in_words, varied_settings
from fingerslip.units import Unit

_SPECIMENS = {
    "fingertip": "a fingertip",
    "tactip": "an optical tactile sensor",
    "gel_pad": "a flat gel with a grid of markers",
}
_ELEMENTS = {
    "T3": "linear triangles",
    "T6": "quadratic triangles",
    "Q4": "bilinear quadrilaterals",
    "T4": "linear tetrahedra",
    "T10": "quadratic tetrahedra",
    "H8": "trilinear hexahedra",
}
_AMONG = {"Q4": "linear triangles", "H8": "linear prisms"}
_INTEGRATION = {
    "selective": "; their volumetric part was integrated at their centres (@malkus1978)",
    "nodal": "; their volumetric part came from the mean dilatation around each node (@bonet1998)",
}
_LAWS = {
    "elastic": "isotropic linear elastic",
    "neo_hookean": "neo-Hookean",
    "mooney_rivlin": "Mooney-Rivlin (@mooney1940)",
    "ogden": "Ogden's law (@ogden1972)",
}
_LIBRARIES = {
    "scikit-fem": " (@gustafsson2020)",
    "numpy": " (@harris2020)",
    "scipy": " (@virtanen2020)",
    "numba": " (@lam2015)",
    "xarray": " (@hoyer2017)",
    "gmsh": " (@geuzaine2009)",
}
_SOLVERS = {"MKL PARDISO": " (@schenk2004)", "SuperLU": " (@li2005)"}
_LEAST_ALPHA = -1.0 / 3.0  # that Hilber, Hughes and Taylor recommend
_TOLERANCE, _TOLERANCE_FINITE = 1e-10, 1e-6  # of contact, and of the balance at large strain, over the largest force
_TIMES = ("slip.incipient", "slip.overall", "slip.latency")
_CONTACT = r"contacts?\.(\d+\.)?"
# Patterns of paths of what moved or loaded beside the programme, and the words for it.
_ACTIONS = {
    rf"{_CONTACT}drive\.": "Along its normal, a force moved the counterface",
    rf"{_CONTACT}programme\.": "Counterfaces with a motion of their own",
    r"bodies\.": "Rigid bodies",
    r"support_motions\.": "Supports moved",
    r"tractions\.": "Tractions",
    r"gravity": "Body force",
    r"initial_velocity": "The body began in motion",
}
# Threshold of a type of afferent that is calibrated, and its unit.
_THRESHOLDS = {
    "FA-I": ("least_rate", "/s"),
    "SA-I": ("least_steady", ""),
    "FA-II": ("least_steady", " m/s²"),
    "SA-II": ("least_steady", ""),
}
_CITED = re.compile(r"@(\w+)")
_LENGTH, _STIFFNESS = Unit("m", "µm"), Unit("Pa/m", "GPa/m")


def methods_and_papers(folder: Path, *, only_bibtex: bool = False) -> str:
    """Return a paragraph of methods on a run or a study, and the papers behind it as BibTeX."""
    facts = read_facts(folder)
    about = _model, _contact, _motion, _receptors_and_afferents, _trust, _software
    text = " ".join(sentence for sentences in about for sentence in sentences(facts))
    keys = dict.fromkeys(_CITED.findall(text))
    entries = bibtex_entries((), [published_set(name) for name in facts.study.compare], keys)
    readable = _CITED.sub(lambda key: short_citation(key[1]), text)
    return entries if only_bibtex else f"{readable}\n\n{entries}"


def _regions_with_cells(history: xr.Dataset) -> list[str]:
    """Return the regions that give cells their material; sets of a deck that hold others do not."""
    names = str(history.attrs.get("regions", "")).split(", ")
    return [names[number] for number in np.unique(history["cell_region"].values) if number >= 0]


def _elements_of(history: xr.Dataset) -> str:
    """Return the elements of a mesh in words, and what stands among them where it is mixed."""
    name = str(history.attrs["element"])
    words = f"{_ELEMENTS.get(name, 'elements')} ({name})"
    mixed = name in _AMONG and is_degenerate(history["cell_nodes"].values).any()
    return f"{words} with {_AMONG[name]} among them" if mixed else words


def _model(facts: Facts) -> Iterator[str]:
    """Yield sentences on specimen, materials, supports and mesh."""
    kind = next((kind for kind in _SPECIMENS if f"{kind}.preset" in facts.values), "")
    formulation = (facts.text("formulation") or facts.text(f"{kind}.formulation")).replace("_", " ")
    depth = facts.text("depth") or facts.text(f"{kind}.depth")
    is_solid = "solid" in formulation
    across = "" if is_solid else f", in {formulation} with an out-of-plane depth of {depth}"
    if kind:
        cut = f"two-dimensional {facts.text('fingertip.section')} section of".replace("  ", " ")
        shape = "three-dimensional model of" if is_solid else cut
        yield f"The specimen was a {shape} {_SPECIMENS[kind]} (preset {facts.text(f'{kind}.preset')}){across}."
        yield from _origins(facts, kind)
    else:
        scan, files = facts.text("mesh.skin"), dict.fromkeys(Path(original_mesh(run)[0]).name for run in facts.runs)
        yield f"The specimen was {f'a scan ({Path(scan).name})' if scan else f'the mesh {_enumerate(files)}'}{across}."
    yield from _layers(facts, kind)
    if supports := [str(name) for name in facts.histories[0]["support"].values]:
        components = facts.below("supports")
        fixed = (f"{name} ({components[name]})" if name in components else name for name in supports)
        yield f"Fixed: {_enumerate(fixed)}."
    yield f"Strains and rotations were taken as {facts.text('kinematics').replace('finite', 'large')}."
    yield from _mesh(facts)


def _origins(facts: Facts, kind: str) -> Iterator[str]:
    """Yield sentences on where the values of a specimen are from: papers, the study, assumptions."""
    values = [value for path, value in facts.values.items() if path.startswith(f"{kind}.") and path != f"{kind}.preset"]
    if sources := source_keys(values):
        yield f"Its values were taken from {_enumerate(f'@{key}' for key in sources)}."
    changed = {
        value.path: value.value
        for value in values
        if value.source.startswith(STUDY_FILE) and value.note != f"preset: {value.value}"
    }
    if changed:
        yield f"Set differently from the preset: {_in_words(changed)}."
    assumed = [value for value in values if value.source == ASSUMED]
    if assumed:
        # What was adjusted to results is no prediction.
        adjusted = [value.path for value in assumed if re.search("calibrated|chosen", value.note)]
        seen = f"; with published results in view: {_enumerate(path_labels(adjusted).values())}" if adjusted else ""
        yield f"{len(assumed)} of its {len(values)} values are given by no source and were assumed{seen}."


def _layers(facts: Facts, kind: str) -> Iterator[str]:
    """Yield a sentence on the material of every region."""
    texts = []
    for region in _regions_with_cells(facts.histories[0]):
        values = facts.below(f"materials.{region}") or facts.below(f"{kind}.materials.{region}")
        law = values.pop("law", "elastic")
        values.pop("stable_between", "")  # a check, and no constant of the law
        terms = [path for path in values if re.fullmatch(r"prony\.\d+\.share", path)]
        relaxing = (f"{values.pop(path)} relaxes in {values.pop(path.replace('share', 'time'), '')}" for path in terms)
        shares = [f"of the shear modulus {_enumerate(relaxing)}"] * bool(terms)
        words = _LAWS.get(law, law.replace("_", " "))
        laws = [path for path in facts.values if path.endswith(f"materials.{region}.law")]
        notes = map(notes_at_rest, facts.runs)
        at_rest = dict.fromkeys(of_run[path] for of_run in notes for path in laws if path in of_run)
        texts.append(f"{', '.join((region, words, *at_rest))} ({', '.join((_in_words(values), *shares))})")
    if texts:
        yield f"Materials: {'; '.join(texts)}."
    if any(".prony." in path for path in facts.values):
        key = "simo1987" if facts.text("kinematics") == "finite" else "taylor1970"
        yield f"Relaxation is that of the deviatoric stress, a sum of exponentials (Prony terms, @{key})."
    damping = facts.below("damping")
    if any(float(value.split()[0].rstrip(",")) for value in damping.values()):
        yield f"Rayleigh damping was proportional to mass and stiffness ({_in_words(damping)}), which no source gives."


def _mesh(facts: Facts) -> Iterator[str]:
    """Yield a sentence on the mesh."""
    names = {str(history.attrs["element"]) for history in facts.histories}
    sizes = {path: text for path, text in facts.below("mesh").items() if path.endswith(("contact_size", "bulk_size"))}
    size = f", {_in_words(sizes)}" if sizes else ""
    rule = facts.text("integration")
    integrated = _INTEGRATION.get(rule, "") if rule != "selective" or names & set(_AMONG) else ""
    elements = _enumerate(dict.fromkeys(map(_elements_of, facts.histories)))
    mesher = ", meshed by fTetWild (@hu2020)" if facts.text("mesh.skin") else ""
    yield (
        f"The mesh had {facts.span('n_nodes')} nodes and {facts.span('n_degrees_of_freedom')} unknowns in "
        f"{elements}{size}{mesher}{integrated}."
    )


def _contact(facts: Facts) -> Iterator[str]:
    """Yield sentences on contact and friction, and how exactly they were solved."""
    friction = facts.matching(rf"{_CONTACT}friction")
    if not friction:
        return
    bodies = [kind for kind in ("cylinder", "sphere") if any(f".{kind}." in path for path in facts.values)]
    # A law that is named stands in the path of its values.
    law = "" if any(".friction." in path for path in friction) else "Coulomb's, "
    normal, tangential = facts.span("normal_penalty", _STIFFNESS), facts.span("tangential_penalty", _STIFFNESS)
    penalties = f"by penalties at the nodes ({normal} normal, {tangential} tangential)"
    normals = dict.fromkeys(f"({text})" for text in facts.matching(rf"{_CONTACT}(counterface\.\w+\.)?normal$").values())
    facing = f" (outward normal {_enumerate(normals)})" if normals else ""
    boundaries = dict.fromkeys(facts.matching(rf"{_CONTACT}boundary").values())
    pair = f"{_enumerate(boundaries)} with a rigid {_enumerate(bodies) or 'plane'}{facing}"
    penetration, stretch = facts.largest("penetration_max_m"), facts.largest("elastic_slip_max_m")
    deviations = ""
    if penetration is not None and stretch is not None:
        lengths = [_LENGTH.format(float(f"{length:.2g}")) for length in (penetration, stretch)]
        deviations = f"; the largest penetration was {lengths[0]}, the largest elastic part of slip {lengths[1]}"
    yield (
        f"Contact of the boundary {pair} was unilateral, with friction ({law}{_in_words(friction)}), "
        f"{penalties}{deviations}."
    )
    finite = "finite" in facts.text("kinematics")
    large = f"; at large strain the balance of forces to {_TOLERANCE_FINITE:g}" if finite else ""
    yield (
        f"In every step the conditions of contact and friction (@alart1991) held to {_TOLERANCE:g} of the largest "
        f"force{large}."
    )


def _motion(facts: Facts) -> Iterator[str]:
    """Yield sentences on what was done to the specimen, and how time was integrated."""
    phases: dict[str, dict[str, str]] = {}
    set_values = facts.below("programme", only_set=True)
    for path, text in facts.below("programme").items():
        number, verb, name = path.split(".", 2)
        if path in set_values or name == "direction":
            phases.setdefault(f"{number} {verb}", {})[name] = text
    if phases:
        listed = (f"{phase.split()[1]} ({_in_words(values)})" for phase, values in phases.items())
        yield f"The counterface moved in phases: {', then '.join(listed)}."
    for pattern, words in _ACTIONS.items():
        set_values = facts.matching(pattern, only_set=True)
        is_constant = "drive" in pattern and not any(".ramp." in path for path in set_values)
        if set_values:
            yield f"{words}: {_in_words(set_values)}{', constant from the start' if is_constant else ''}."
    if reaction := facts.below("reaction", only_set=True):
        yield f"Held object and reaction: {_in_words(reaction)}."
    scheme, step, alpha = facts.text("time.scheme"), facts.text("time.step"), facts.text("time.alpha")
    steps = f"steps of {step}" if step != "auto" else f"steps that keep an error of {facts.text('time.tolerance')}"
    if scheme == "quasi_static":
        yield f"Inertia was left out: every one of the {steps} was in equilibrium."
    else:
        numbers = re.findall(r"-?\d[\d.]*", alpha)
        is_beyond = any(float(number) < _LEAST_ALPHA for number in numbers)
        beyond = " and beyond the range that its authors recommend" if is_beyond else ""
        yield f"Motion was integrated by the HHT method (@hilber1977) with alpha = {alpha}{beyond}, in {steps}."
    if normal := facts.span("basis_normal_modes"):
        constraint = facts.span("basis_constraint_modes")
        yield f"The basis (@craig1968) had {constraint} constraint modes and {normal} normal modes."


def _receptors_and_afferents(facts: Facts) -> Iterator[str]:
    """Yield sentences on receptors and the afferents behind them."""
    recorded = list(map(str, site_kinds(facts.histories[0])))
    receptors = [kind for kind in RECEPTOR_KINDS if kind in recorded]
    if not receptors:
        return
    yield f"Recorded: {_enumerate(f'{recorded.count(kind)} {kind}' for kind in receptors)}."
    from fingerslip.afferents import model as afferents  # slow

    felt = [history for history in facts.histories if "strain" in history]
    resolved = {kind for history in felt for kind in afferents.resolved_afferents(history)}
    models = afferents.human_afferents()
    kinds: dict[str, list[str]] = {}
    papers: dict[str, list[str]] = {}
    for kind in (kind for kind in receptors if kind in resolved):
        kinds.setdefault(models[kind].stimulus.replace("_", " "), []).append(kind)
        name, unit = _THRESHOLDS[kind]
        (threshold,) = (value for value in afferents.AFFERENTS.table(kind.lower()) if value.path == name)
        papers.setdefault(threshold.source, []).append(f"{kind} {threshold.value}{unit}")
    if not kinds:
        return
    stimuli = _enumerate(f"{stimulus} ({', '.join(names)})" for stimulus, names in kinds.items())
    thresholds = _enumerate(f"{', '.join(names)} (@{paper})" for paper, names in papers.items())
    names = [kind for kind in receptors if kind in resolved]
    borrowed = " (those of SA-II are those of SA-I)" * ("SA-II" in names)
    rate = " and the threshold of SA-I for rates" * ("SA-I" in names)
    least = " That of FA-I is the least of 39, and whether they fire in partial slip depends on it." * ("FA-I" in names)
    fast = " FA-II are easiest to excite above 64 Hz (@johansson1982)." * ("FA-II" in names)
    yield (
        "Spikes come from leaky integrate-and-fire models, alike within a type and without noise, with the time "
        f"constants, filters, inhibition and delays of @saal2017, fitted to afferents of monkeys{borrowed}, "
        f"driven by {stimuli}; stimuli{rate} were assumed, thresholds calibrated on single published values: "
        f"{thresholds}.{least}{fast} Counts of spikes are no result."
    )
    resolved_models = {kind: models[kind] for kind in names}
    limits = (
        afferents.spike_notes(names, afferents.beyond_records(resolved_models, history), history) for history in felt
    )
    yield from (f"{note}." for note in dict.fromkeys(itertools.chain(*limits)))


def _trust(facts: Facts) -> Iterator[str]:
    """Yield sentences on events, error bars and energy."""
    runs = facts.study.runs
    if len(runs) > 1:
        differ = {path: "" for run in runs for path in (*run.swept, *run.sampled)}
        drawn = facts.study.design
        design = f" ({drawn['count']} samples, {drawn['method']}, seed {drawn['seed']})" if drawn else ""
        yield f"{len(runs)} runs{design} differ in {_enumerate(path_labels(list(differ)).values())}."
    if any(run.events.slip.recorded and run.events.slip.overall is not None for run in runs):
        words = definitions(EventSettings())
        yield f"{words['slip'].partition(': ')[2].capitalize()} {words['latency']}"
        yield "At the second of these shares people notice slip (@barrea2018)."
    if (imbalance := facts.largest("energy_imbalance_over_work")) is not None:
        yield f"The balance of energy closed to {max(imbalance, 1e-16):.0e} of the work done."
    yield _error_bars(runs)
    if (facts.study.folder / ABOUT).is_file():
        try:
            stored_fit(facts.study)
            yield _fit_to_measurements(facts.study.folder / SUMMARY)
        except ResultError as error:
            logging.getLogger("fingerslip.study").warning(error)


def _fit_to_measurements(summary: Path) -> str:
    """Return a sentence on the values that were fitted to a measurement."""
    values = []
    for row in csv.DictReader(io.StringIO(summary.read_text(encoding="utf-8"))):
        median, low, high = (f"{float(row[name]):.4g}" for name in ("median", "95 % from", "95 % to"))
        values.append(f"{row['value']} {median} {row['unit']}".strip() + f" ({low} to {high})")
    return (
        "Values were fitted to measured curves with Gaussian processes (@rasmussen2006) in place of further runs, a "
        "discrepancy of the model (@kennedy2001) and an ensemble sampler (@foreman2013); median and interval of 95 %: "
        f"{_enumerate(values)}."
    )


def _error_bars(runs: Sequence[RunResult]) -> str:
    """Say how well the times are known numerically."""
    studied, bars = [run for run in runs if run.uncertainty], dict[str, float]()
    for key, bar in (item for run in studied for item in run.uncertainty.items()):
        if key in _TIMES or key.startswith("reaction."):
            bars[key] = max(bar, bars.get(key, 0.0))
    if not bars:
        return "Numerical uncertainty was not studied."
    listed = _enumerate(
        f"{key.partition('.')[2]} {1e3 * bar:{'.0f' if bar >= 0.01 else '.2g'}} ms" for key, bar in bars.items()
    )
    varied = varied_settings(quantity for run in studied for quantity in run.convergence.values())
    over = f" over {settings_in_words(varied)}" if varied else ""
    others = [run_title(run, run.name) for run in runs if not run.uncertainty]
    where = f" in {_enumerate(run_title(run, run.name) for run in studied)}" if others else ""
    lacking = f" It was not studied in {_enumerate(others)}." if others else ""
    unsettled = []
    for key in _TIMES:
        of_runs = (run.convergence[key].unsettled_settings for run in studied if key in run.convergence)
        if settings := set(itertools.chain(*of_runs)):
            words = settings_in_words(setting.name for setting in SETTINGS if setting.name in settings)
            unsettled.append(f"{key.partition('.')[2]} with {words}")
    doubtful = f" Not converged: {'; '.join(unsettled)}." if unsettled else ""
    return f"Numerical uncertainty{over}{where} is at most: {listed}.{doubtful}{lacking}"


def _software(facts: Facts) -> Iterator[str]:
    """Yield a sentence on programs and their versions."""
    runs = facts.study.runs
    versions = {
        name: _enumerate(dict.fromkeys(run.versions[name] for run in runs if name in run.versions))
        for name in {name: "" for run in runs for name in run.versions}
    }
    changes = ", with changes" if facts.commit.endswith("-dirty") else ""
    commit = f" (commit {facts.commit[:12]}{changes})" if facts.commit else ""
    # Gmsh meshes the specimens; a mesh of one's own is only read.
    meshed = any(f"{kind}.preset" in facts.values for kind in _SPECIMENS)
    names = [name for name in _LIBRARIES if name in versions and (meshed or name != "gmsh")]
    libraries = (f"{name} {versions[name]}{_LIBRARIES[name]}" for name in names)
    solvers = dict.fromkeys(str(history.attrs.get("linear_solver", "")) for history in facts.histories)
    solved = _enumerate(f"{name}{_SOLVERS.get(name, '')}" for name in solvers if name)
    program = f"fingerslip {versions.get('fingerslip', '')}{commit} on Python {versions.get('python', '')}"
    yield f"Computed with {program}, with {_enumerate(libraries)}; linear systems were solved by {solved}."


def _in_words(values: Mapping[str, str]) -> str:
    """Return values with the last parts of their paths in words; brackets around what has a comma."""
    labels = path_labels(list(values))
    return ", ".join(f"{labels[path]} {f'({text})' if ',' in text else text}" for path, text in values.items())


def _enumerate(texts: Iterable[str]) -> str:
    """Return texts as a list in a sentence."""
    *first, last = list(texts) or [""]
    return f"{', '.join(first)} and {last}" if first else last
