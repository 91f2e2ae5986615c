"""The answer that opens a report: a few plain sentences with the numbers of what was run."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

from fingerslip.published import PublishedSet
from fingerslip.report.labels import path_label, run_title, swept_text
from fingerslip.report.page.beside import beside_published
from fingerslip.report.tables.events import swept_paths
from fingerslip.results import RunResult, StudyResult
from fingerslip.units import split_quantity

__all__ = ["answer"]


def answer(study: StudyResult, starts: Mapping[str, float], references: Sequence[PublishedSet] = ()) -> tuple[str, ...]:
    """Say in a few sentences what a study found, and how that stands beside published times.

    Parameters
    ----------
    study : StudyResult
        The study and its finished runs.
    starts : mapping of str to float
        When the slide of each run begins [s], by the name of the run; runs in which nothing slides are left out.
    references : sequence of PublishedSet, optional
        Published values; slip and latency are put beside them where a run meets their conditions.
    """
    sliding = [run for run in study.runs if run.name in starts]
    if not sliding:
        return _of_held(study.runs)
    slipped = [run for run in sliding if run.events.overall is not None]
    if not slipped:
        many = f"any of the {len(sliding)} runs" if len(sliding) > 1 else "this run"
        first: tuple[str, ...] = (
            f"The whole contact does not slip in {many}: overall slip is not reached by the end of the slide.",
        )
        return (*first, *beside_published(sliding, references))
    single = len(study.runs) == 1
    first = _of_one(slipped[0], starts) if single else _of_many(study, sliding, slipped, starts)
    return tuple(sentence for sentence in (*first, *beside_published(sliding, references)) if sentence)


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
    since = overall - starts[run.name]
    first = (
        f"The whole contact slips {since:.3f} s after the slide begins, {overall:.3f} s after the start of the run"
        f"{_error(run)}."
    )
    if latency is None:
        return (first,)
    return first, f"From incipient slip on, {1e3 * latency:.0f} ms are left to react."


def _error(run: RunResult) -> str:
    error = run.uncertainty.get("slip.overall")
    return "" if error is None else f" (± {1e3 * error:.0f} ms, numerical)"


def _of_many(
    study: StudyResult, sliding: Sequence[RunResult], slipped: Sequence[RunResult], starts: Mapping[str, float]
) -> tuple[str, ...]:
    since = {run.name: float(run.events.overall or 0.0) - starts[run.name] for run in slipped}
    ordered = sorted(slipped, key=lambda run: since[run.name])
    early, late = ordered[0], ordered[-1]
    first, last = ("" if study.ranges else f" ({run_title(run, run.name)})" for run in (early, late))
    kind = "samples" if study.ranges else "runs"
    spread = (
        f"Over {len(slipped)} {kind}{_by(study)}, the whole contact slips between {since[early.name]:.3f} s{first} and "
        f"{since[late.name]:.3f} s{last} after the slide begins{_trend(slipped, since)}."
    )
    missing = len(sliding) - len(slipped)
    lacking = f"In {missing} of {len(sliding)} {kind} overall slip is not reached." if missing else ""
    return spread, _latencies(slipped), lacking


def _by(study: StudyResult) -> str:
    """Say what differs between the runs."""
    if study.ranges:
        return f" of {len(study.ranges)} uncertain values"
    labels = [path_label(path) for path in swept_paths(study.runs) if len(_values(study.runs, path)) > 1]
    return f" that differ in {_listed(labels)}" if labels else ""


def _listed(words: Sequence[str]) -> str:
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
    known = [1e3 * latency for run in runs if (latency := run.events.slip.latency) is not None]
    if not known:
        return ""
    low, high = f"{min(known):.0f}", f"{max(known):.0f}"
    span = f"{low} ms are" if low == high else f"{low} to {high} ms are"
    return f"From incipient slip on, {span} left to react."
