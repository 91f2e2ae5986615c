"""What of a report may be quoted, what not, and how sure it is: for whoever has the page alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from fingerslip.history import is_solid, sites_of_kinds
from fingerslip.report.content import ReportContent
from fingerslip.report.prose import prose
from fingerslip.report.tables.parameters import ASSUMED, NOT_USED
from fingerslip.results import RunResult
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip.measures import resolution_warnings
from fingerslip.slip.windows import LATENCY
from fingerslip.uncertainty import settings_in_words, varied_settings

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
    is_coarse = bool(resolution_warnings({run.name: run.numbers for run in runs}))
    reasons = "; ".join([*([prose("quote", "coarse")] if is_coarse else []), *_not_to_quote(content, runs)])
    return {
        **({} if is_coarse else {"Quote": prose("quote", "do", {"bars": ", ±" if has_bars else ""})}),
        **({"Do not quote": prose("quote", "not", {"reasons": reasons})} if reasons else {}),
        "How sure": " ".join(_how_sure(content, runs)),
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


def _how_sure(content: ReportContent, runs: Sequence[RunResult]) -> Iterator[str]:
    """Yield sentences on numerical uncertainty, on other models, and on what is assumed."""
    studied = [run for run in runs if run.uncertainty]
    if studied:
        varied = varied_settings(number for run in studied for number in run.convergence.values())
        lacking = f"; {len(studied)} of {len(runs)} runs" if len(studied) < len(runs) else ""
        yield prose("quote", "bars", {"settings": settings_in_words(varied), "lacking": lacking})
    else:
        yield prose("quote", "no-bars")
    unsettled = [name for name in _TIMES if any(_lacks_convergence(run, f"slip.{name}") for run in studied)]
    if unsettled:
        yield prose("quote", "unsettled", {"times": ", ".join(unsettled)})
    values = {value.path: value.value for value in content.values if value.source != NOT_USED}
    if all(values.get(path) == value for path, value in _COMPARED.items()):
        yield prose("quote", "model")
    if assumed := sum(value.source == ASSUMED for value in content.values):
        yield prose("quote", "assumed", {"count": assumed})


def _lacks_convergence(run: RunResult, key: str) -> bool:
    return key in run.convergence and bool(run.convergence[key].unsettled_settings)
