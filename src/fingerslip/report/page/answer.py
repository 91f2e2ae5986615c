"""What opens a report in plain sentences: what was found, beside published times, what may be quoted of it."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TypeAlias

from fingerslip.history import is_solid, sites_of_kinds
from fingerslip.published import PublishedSet, PublishedValue
from fingerslip.report.content import ReportContent
from fingerslip.report.labels import first_named, number_and_unit, of_runs, path_label, prose, run_title
from fingerslip.report.tables import runs as run_tables
from fingerslip.report.tables.compare import difference_from, span_of
from fingerslip.report.tables.parameters import ASSUMED, NOT_USED
from fingerslip.results import RunResult, StudyResult
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import EventSettings
from fingerslip.slip.measures import INVERTED, LARGEST_STRAIN, resolution_warnings
from fingerslip.slip.windows import LATENCY, READINGS
from fingerslip.uncertainty import studied_settings, varied_settings
from fingerslip.units import si_quantity

_Pair: TypeAlias = tuple[RunResult, PublishedValue]

_SLIDE_SPEED = re.compile(r"programme\.\d+\.slide\.speed")


def answer(study: StudyResult, starts: Mapping[str, float], references: Sequence[PublishedSet] = ()) -> tuple[str, ...]:
    """Say in a few sentences what a study found, how that stands beside published times, and what it is worth.

    Slides start at `starts` [s], by the names of the runs.
    """
    sliding = [run for run in study.runs if run.name in starts]
    if not sliding:
        return (*_answer_of_held(study.runs), *run_tables.run_caveats(study.runs))
    whole = sliding
    sliding = [run for run in whole if not run.numbers.get(INVERTED)]
    slipped = [run for run in sliding if run.events.overall is not None]
    if not sliding:
        return ("No time of slip is a result here.", *run_tables.run_caveats(whole))
    if not slipped:
        many = f"any of the {len(sliding)} runs" if len(sliding) > 1 else "this run"
        first: tuple[str, ...] = (
            f"The whole contact does not slip in {many}: overall slip is not reached by the end of the slide.",
        )
    elif len(study.runs) == 1:
        first = _answer_of_one(slipped[0], starts)
    else:
        first = _answer_of_many(study, sliding, slipped, starts)
    # What is too coarse, and how to learn how well the times are known where they have no error bars.
    bars = "" if study.ranges else _without_bars(sliding)
    return tuple(
        filter(None, (*first, *published_rows_beside(sliding, references), *run_tables.run_caveats(whole), bars))
    )


def _without_bars(runs: Sequence[RunResult]) -> str:
    """Say which runs have no error bars, or that those of all leave out element sizes."""
    lacking = [run_title(run, run.name) for run in runs if not run.uncertainty]
    varied = varied_settings(number for run in runs for number in run.convergence.values())
    if not lacking:
        return prose("notes", "no-mesh") if varied and "mesh" not in varied else ""
    which = "These times" if len(lacking) == len(runs) else f"The times of {first_named(lacking)}"
    return f"{which} have no error bars yet: fingerslip converge finds them."


def _answer_of_held(runs: Sequence[RunResult]) -> tuple[str, ...]:
    forces = [(run.numbers.get("normal_force_max"), run.numbers.get("normal_force_end")) for run in runs]
    ends = [(float(most), 100.0 * float(end) / float(most)) for most, end in forces if most and end is not None]
    if not ends:
        return ("Nothing slides in this study, so there is no slip to report.",)
    largest, share = max(most for most, _ in ends), _span([share for _, share in ends], 0, "%")
    return (f"Nothing slides in this study. Of the largest normal force, {largest:.3g} N, {share} is left at the end.",)


def _answer_of_one(run: RunResult, starts: Mapping[str, float]) -> tuple[str, ...]:
    overall, bar = run.events.overall or 0.0, _bar(run, "slip.overall")
    marks = [*[f"{bar} ms, numerical"] * bool(bar), *["doubtful"] * bool(run.doubts)]
    error = f" ({', '.join(marks)})" if marks else ""
    digits, travels = run_tables.time_digits([run]), _travels([run], "overall_travel_m")
    travel = f"after {travels[0]:.2f} mm of travel, " if travels else ""
    since = f"{overall - starts[run.name]:.{digits}f} s after the slide begins"
    said = f"The whole contact slips {travel}{since}, {overall:.{digits}f} s after the start of the run{error}."
    return said, _latencies([run])


def _bar(run: RunResult, key: str) -> str:
    """Return the uncertainty of a time in milliseconds, without the unit; empty where it is not known."""
    error = run.uncertainty.get(key)
    return "" if error is None else f"± {1e3 * error:.0f}" if error >= 0.5e-3 else "± <1"


def _speed(runs: Sequence[RunResult]) -> str:
    """Say how fast plates slide first; nothing where that is not known."""
    speeds = set()
    for run in runs:
        texts = (str(text) for path, text in run.all_values.items() if _SLIDE_SPEED.fullmatch(path))
        quantity = si_quantity(next(texts, ""))
        speeds.add(quantity[0] if quantity else None)
    numbers = [1e3 * speed for speed in speeds if speed is not None]
    if not numbers or len(numbers) < len(speeds):
        return ""
    return f" at {' to '.join(dict.fromkeys((f'{min(numbers):.4g}', f'{max(numbers):.4g}')))} mm/s"


def _travels(runs: Sequence[RunResult], key: str) -> list[float]:
    """Return a travel of the plate [mm] in runs without inertia, whose time is travel over speed; else nothing."""
    if any(run.all_values.get("time.scheme") != "quasi_static" for run in runs):
        return []
    return [1e3 * travel for run in runs if (travel := run.numbers.get(key)) is not None]


def _answer_of_many(
    study: StudyResult, sliding: Sequence[RunResult], slipped: Sequence[RunResult], starts: Mapping[str, float]
) -> tuple[str, ...]:
    since = {run.name: float(run.events.overall or 0.0) - starts[run.name] for run in slipped}
    ordered = sorted(slipped, key=lambda run: since[run.name])
    kind = "samples" if study.ranges else "runs"
    digits, travels = run_tables.time_digits(slipped), _travels(slipped, "overall_travel_m")

    def at(run: RunResult) -> str:
        bar = _bar(run, "slip.overall")
        marks = [run_title(run, run.name), *[f"{bar} ms"] * bool(bar), *["doubtful"] * bool(run.doubts)]
        return f"{since[run.name]:.{digits}f} s" + ("" if study.ranges else f" ({', '.join(marks)})")

    labels = [path_label(path) for path in run_tables.differing_paths(study.runs)]
    listed = " and ".join([", ".join(labels[:-1]), labels[-1]] if len(labels) > 1 else labels)
    which = f" that differ in {listed}" if labels else ""
    which = f" of {len(study.ranges)} uncertain values" if study.ranges else which
    travel = f"after {min(travels):.2f} to {max(travels):.2f} mm of travel, " if travels else ""
    spread = f"between {at(ordered[0])} and {at(ordered[-1])} after the slide begins{_trend(slipped, since)}"
    said = f"Over {len(slipped)} {kind}{which}, the whole contact slips {travel}{spread}."
    if len(slipped) == 1:
        said = f"In one of {len(study.runs)} {kind}, the whole contact slips {at(ordered[0])} after the slide begins."
    missing = len(sliding) - len(slipped)
    lacking = f"In {missing} of {len(sliding)} {kind} overall slip is not reached." if missing else ""
    return said, _latencies(slipped), lacking


def _trend(runs: Sequence[RunResult], since: Mapping[str, float]) -> str:
    """Say whether overall slip moves one way with the only swept number; nothing where it does not."""
    paths = run_tables.differing_paths(runs)
    if len(paths) != 1 or len(runs) < 3:
        return ""
    numbers = {run.name: number for run in runs if (number := number_and_unit(run.swept.get(paths[0])))}
    if len(numbers) < len(runs):
        return ""
    ordered = [since[run.name] for run in sorted(runs, key=lambda run: numbers[run.name][0])]
    steps = [after - before for before, after in itertools.pairwise(ordered)]
    for words, sign in (("later", 1.0), ("earlier", -1.0)):
        if all(sign * step > 0.0 for step in steps):
            return f", the {words} the larger the {path_label(paths[0])}"
    return ""


def _latencies(runs: Sequence[RunResult]) -> str:
    time = run_tables.latency_span(runs)
    if not time:
        return ""
    if travels := _travels(runs, "latency_travel_m"):
        way = _span(travels, 2, "mm")
        speed = _speed(runs) or " at the speed of this slide"
        return of_runs(f"From incipient slip on, the plate travels {way}, {time}{speed}.", runs)
    return f"From incipient slip on, {time} are left to react{_speed(runs)}."


def _span(values: Sequence[float], digits: int, unit: str) -> str:
    low, high = (f"{value:.{digits}f}" for value in (min(values), max(values)))
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def published_rows_beside(runs: Sequence[RunResult], references: Sequence[PublishedSet]) -> tuple[str, ...]:
    """Put overall slip, incipient slip and latency from accumulated slip beside published times, in plain sentences."""
    overall, incipient, latency = (_pairs(runs, references, name) for name in ("overall", "incipient", LATENCY))
    left = []
    if early := _changes(incipient):
        than = "than published" if _are_off(early) else "with the published one"
        left.append(f"incipient slip {_off(early)} {than}")
    if ours := run_tables.latency_span([run for run, _ in latency]):
        theirs = [1e3 * end for run, value in latency if run.events.latency is not None for end in span_of(value)]
        left.append(f"{ours} are left to react, against {_span(theirs, 0, 'ms')} published")
    second = f"{', and '.join(left)}."
    reasons = dict.fromkeys(value.otherwise for _, value in (*incipient, *latency) if value.otherwise)
    third = f"These do not compare like with like: {'; '.join(reasons)}." if left and reasons else ""
    return tuple(filter(None, (_overall(overall), f"{second[0].upper()}{second[1:]}" if left else "", third)))


def _pairs(runs: Sequence[RunResult], references: Sequence[PublishedSet], quantity: str) -> list[_Pair]:
    """Return runs with the published times that they meet the conditions of; one that several sets have counts once."""
    pairs = {
        (run.name, span_of(value)): (run, value)
        for run, reference in itertools.product(runs, references)
        for value in reference.values
        if value.quantity == quantity and value.reading in ("", "slip") and value.value is not None
        if value.holds_for(run.all_values)
    }
    return list(pairs.values())


def _changes(pairs: Sequence[_Pair]) -> list[float]:
    """Return how much later events are than published [ms], 0 within a published range, where they happened."""
    times = [(run.events.slip.time(value.quantity), span_of(value)) for run, value in pairs]
    return [1e3 * difference_from(time, span) for time, span in times if time is not None]


def _overall(pairs: Sequence[_Pair]) -> str:
    if not pairs:
        return ""
    changes = _changes(pairs)
    if not changes:
        return "Overall slip, for which a time is published, is not reached."
    single, lacking = len(pairs) == 1, len(pairs) - len(changes)
    calibrated = sum(value.is_calibrated(run.all_values) for run, value in pairs)
    said = f"Beside {'the published time' if single else f'{len(pairs)} published times'}, overall slip {_off(changes)}"
    missing = f"; it is not reached in {lacking} of these runs" if lacking else ""
    fitted = f"; the model was calibrated on {'it' if single else f'{calibrated} of them'}" if calibrated else ""
    return f"{said}{missing}{fitted}."


def _are_off(changes: Sequence[float]) -> bool:
    return any(abs(change) >= 0.5 for change in changes)


def _off(changes: Sequence[float]) -> str:
    """Say how much later or earlier times are [ms]."""
    if not _are_off(changes):
        return "agrees to the millisecond"
    low, high = min(changes), max(changes)
    if low < -0.5 and high > 0.5:
        return f"comes {-low:.0f} ms earlier to {high:.0f} ms later"
    return f"comes {_span([abs(change) for change in changes], 0, 'ms')} {'later' if high > 0.5 else 'earlier'}"


def definitions(settings: EventSettings) -> dict[str, str]:
    """Return a sentence for each reading, by its name, that defines its slip events, and one on latency."""
    peaks = settings.peaks
    values = {
        "incipient": f"{100 * settings.incipient_fraction:g} %",
        "noticed": f"{100 * settings.noticed_fraction:g} %",
        "three_quarter": f"{100 * settings.three_quarter_fraction:g} %",
        "overall": f"{100 * settings.overall_fraction:g} %",
        "slip": f"{1e6 * settings.slip_tolerance:g} µm",
        "sustained": f"{1e3 * settings.sustained:g} ms",
        "displacement": f"{1e6 * settings.displacement_tolerance:g} µm",
        "kinds": " and ".join(peaks.kinds),
        "followed": f"{100 * peaks.followed:g} %",
        "over_noise": f"{peaks.over_noise:g}",
    }
    return {reading: prose("definitions", reading, values) for reading in (*READINGS, LATENCY)}


_PEAKS = "acceleration.incipient"
_TIMES = ("incipient", "overall", LATENCY)
# The fingertip of which other models have been computed: plane stress at small strain moves when either is left.
_COMPARED = {"fingertip.preset": "wang2014-2d", "kinematics": "small", "fingertip.formulation": "plane_stress"}


def quotable(content: ReportContent) -> Mapping[str, str]:
    """Return what to quote, what not to, and how sure it is, by headings; nothing of samples or without slip."""
    runs = [run for run in content.study.runs if run.events.overall is not None and run.name in content.starts]
    if not runs or content.study.ranges:
        return {}
    has_bars = any(run.uncertainty for run in runs)
    coarse = (resolution_warnings({run.name: {**run.numbers, INVERTED: 0, LARGEST_STRAIN: 0}}) for run in runs)
    faults = {
        "inverted": any(run.numbers.get(INVERTED) for run in runs),
        "coarse": any(coarse),
        "edge": any(run.edge for run in runs),
        "doubtful": any(run.doubts for run in runs),
    }
    wrong = [name for name, is_there in faults.items() if is_there]
    reasons = "; ".join([*(prose("quote", name) for name in wrong), *_not_to_quote(content, runs)])
    return {
        **({} if wrong else {"Quote": prose("quote", "do", {"bars": ", ±" if has_bars else ""})}),
        **({"Do not quote": prose("quote", "not", {"reasons": reasons})} if reasons else {}),
        "How sure": " ".join(_how_sure(content, runs, only="" if wrong else prose("quote", "only"))),
    }


def _not_to_quote(content: ReportContent, runs: Sequence[RunResult]) -> Iterator[str]:
    """Yield what is no result of these runs, each with the reason."""
    histories = content.histories.values()
    peaks = [run for run in runs if run.events.acceleration.incipient is not None]
    if any(_PEAKS not in run.convergence or run.convergence[_PEAKS].unsettled_settings for run in peaks):
        yield prose("quote", "peaks")
    values = {value.path.removeprefix("fingertip."): value.value for value in content.values}
    if "depth" in values and not any(map(is_solid, histories)):
        yield prose("quote", "section", {"depth": values["depth"]})
    if any(sites_of_kinds(history, RECEPTOR_KINDS).size for history in histories):
        yield prose("quote", "spikes")


def _how_sure(content: ReportContent, runs: Sequence[RunResult], only: str) -> Iterator[str]:
    """Yield sentences on numerical uncertainty, on other models, and on what is assumed."""
    studied = [run for run in runs if run.uncertainty]
    if studied:
        settings = studied_settings(number for run in studied for number in run.convergence.values())
        lacking = f"; {len(studied)} of {len(runs)} runs" if len(studied) < len(runs) else ""
        yield prose("quote", "bars", {"settings": settings, "lacking": lacking})
    else:
        yield prose("quote", "no-bars")
    convergences = {name: [run.convergence.get(f"slip.{name}") for run in studied] for name in _TIMES}
    unsettled = [name for name in _TIMES if any(each and each.unsettled_settings for each in convergences[name])]
    if unsettled:
        yield prose("quote", "unsettled", {"times": ", ".join(unsettled), "only": only})
    values = {value.path: value.value for value in content.values if value.source != NOT_USED}
    if all(values.get(path) == value for path, value in _COMPARED.items()):
        yield prose("quote", "model")
    if assumed := sum(value.source == ASSUMED for value in content.values):
        yield prose("quote", "assumed", {"count": assumed})
