"""The answer that opens a report: a few plain sentences with the numbers of what was run."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

from fingerslip.published import PublishedSet
from fingerslip.report.labels import path_label, run_title, swept_text
from fingerslip.report.page.beside import published_rows_beside
from fingerslip.report.tables.runs import swept_paths, time_digits
from fingerslip.results import RunResult, StudyResult
from fingerslip.slip.resolution import resolution_warnings
from fingerslip.units import split_quantity

__all__ = ["answer"]


def answer(study: StudyResult, starts: Mapping[str, float], references: Sequence[PublishedSet] = ()) -> tuple[str, ...]:
    """Say in a few sentences what a study found, how that stands beside published times, and what it is worth.

    Units: starts [s].
    """
    sliding = [run for run in study.runs if run.name in starts]
    if not sliding:
        return _of_held(study.runs)
    return tuple(filter(None, (*_of_slides(study, sliding, starts, references), *_worth(study, sliding))))


def _of_slides(
    study: StudyResult, sliding: Sequence[RunResult], starts: Mapping[str, float], references: Sequence[PublishedSet]
) -> tuple[str, ...]:
    slipped = [run for run in sliding if run.events.overall is not None]
    if not slipped:
        many = f"any of the {len(sliding)} runs" if len(sliding) > 1 else "this run"
        first: tuple[str, ...] = (
            f"The whole contact does not slip in {many}: overall slip is not reached by the end of the slide.",
        )
        return (*first, *published_rows_beside(sliding, references))
    single = len(study.runs) == 1
    first = _of_one(slipped[0], starts) if single else _of_many(study, sliding, slipped, starts)
    return *first, *published_rows_beside(sliding, references)


def _worth(study: StudyResult, sliding: Sequence[RunResult]) -> tuple[str, ...]:
    """Say what is too coarse, and how to learn how well the times are known where they have no error bars."""
    warnings = resolution_warnings({run_title(run, run.name): run.numbers for run in sliding})
    if study.ranges or any(run.uncertainty for run in sliding):
        return warnings
    return *warnings, "These times have no error bars yet: fingerslip converge finds them."


def _of_held(runs: Sequence[RunResult]) -> tuple[str, ...]:
    forces = [(run.numbers.get("normal_force_max"), run.numbers.get("normal_force_end")) for run in runs]
    known = [(float(most), float(end)) for most, end in forces if most and end is not None]
    if not known:
        return ("Nothing slides in this study, so there is no slip to report.",)
    largest, kept = max(most for most, _ in known), [100.0 * end / most for most, end in known]
    share = f"{kept[0]:.0f} %" if len(known) == 1 else f"{min(kept):.0f} to {max(kept):.0f} %"
    return (f"Nothing slides in this study. Of the largest normal force, {largest:.3g} N, {share} is left at the end.",)


def _of_one(run: RunResult, starts: Mapping[str, float]) -> tuple[str, ...]:
    overall, latency = run.events.overall, run.events.slip.latency
    assert overall is not None  # chosen by the caller
    digits, since = time_digits([run]), overall - starts[run.name]
    times = (
        f"{since:.{digits}f} s after the slide begins, {overall:.{digits}f} s after the start of the run{_error(run)}"
    )
    travels = _travels([run], "overall_travel_m")
    travel = f"after {travels[0]:.2f} mm of travel, " if travels else ""
    first = f"The whole contact slips {travel}{times}."
    return (first,) if latency is None else (first, _latencies([run]))


def _error(run: RunResult) -> str:
    error = run.uncertainty.get("slip.overall")
    return "" if error is None else f" (± {f'{1e3 * error:.0f}' if error >= 0.5e-3 else '<1'} ms, numerical)"


def _travels(runs: Sequence[RunResult], key: str) -> list[float]:
    """Return a travel of the plate [mm] in runs without inertia, whose time is travel over speed; else nothing."""
    if any(run.all_values.get("time.scheme") != "quasi_static" for run in runs):
        return []
    return [1e3 * travel for run in runs if (travel := run.numbers.get(key)) is not None]


def _of_many(
    study: StudyResult, sliding: Sequence[RunResult], slipped: Sequence[RunResult], starts: Mapping[str, float]
) -> tuple[str, ...]:
    since = {run.name: float(run.events.overall or 0.0) - starts[run.name] for run in slipped}
    ordered = sorted(slipped, key=lambda run: since[run.name])
    early, late = ordered[0], ordered[-1]
    first, last = ("" if study.ranges else f" ({run_title(run, run.name)})" for run in (early, late))
    kind, digits = "samples" if study.ranges else "runs", time_digits(slipped)
    travels = _travels(slipped, "overall_travel_m")
    travel = f"after {min(travels):.2f} to {max(travels):.2f} mm of travel, " if travels else ""
    spread = (
        f"Over {len(slipped)} {kind}{_by(study)}, the whole contact slips {travel}between "
        f"{since[early.name]:.{digits}f} s{first} and {since[late.name]:.{digits}f} s{last} after the slide begins"
        f"{_trend(slipped, since)}."
    )
    missing = len(sliding) - len(slipped)
    lacking = f"In {missing} of {len(sliding)} {kind} overall slip is not reached." if missing else ""
    return spread, _latencies(slipped), lacking


def _by(study: StudyResult) -> str:
    """Say what differs between the runs."""
    if study.ranges:
        return f" of {len(study.ranges)} uncertain values"
    labels = [path_label(path) for path in swept_paths(study.runs) if len(_values(study.runs, path)) > 1]
    return f" that differ in {_list_words(labels)}" if labels else ""


def _list_words(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _values(runs: Sequence[RunResult], path: str) -> list[object]:
    return list(dict.fromkeys(swept_text(run.swept[path]) for run in runs if path in run.swept))


def _trend(runs: Sequence[RunResult], since: Mapping[str, float]) -> str:
    """Say whether overall slip moves one way with the only swept number; nothing where it does not."""
    paths = [path for path in swept_paths(runs) if len(_values(runs, path)) > 1]
    if len(paths) != 1 or len(runs) < 3:
        return ""
    numbers = [_number(run.swept.get(paths[0])) for run in runs]
    if any(number is None for number in numbers):
        return ""
    ordered = [since[run.name] for _, run in sorted(zip(numbers, runs, strict=True), key=lambda pair: pair[0] or 0.0)]
    steps = [after - before for before, after in itertools.pairwise(ordered)]
    if all(step > 0.0 for step in steps):
        return f", the later the larger the {path_label(paths[0])}"
    return f", the earlier the larger the {path_label(paths[0])}" if all(step < 0.0 for step in steps) else ""


def _number(value: object) -> float | None:
    if isinstance(value, str):
        parts = split_quantity(value)
        return parts[0] if parts else None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _latencies(runs: Sequence[RunResult]) -> str:
    latencies = [1e3 * latency for run in runs if (latency := run.events.slip.latency) is not None]
    if not latencies:
        return ""
    time = _span([round(latency, time_digits(runs) - 3) for latency in latencies], 0, "ms")
    if travels := _travels(runs, "latency_travel_m"):
        return (
            f"From incipient slip on, the plate travels {_span(travels, 2, 'mm')}, {time} at the speed of this slide."
        )
    return f"From incipient slip on, {time} are left to react."


def _span(values: Sequence[float], digits: int, unit: str) -> str:
    low, high = (f"{value:.{digits}f}" for value in (min(values), max(values)))
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"
