"""The pictures that answer: slip events and latency against what was swept, or one run from stick to slip."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fingerslip.history import is_solid
from fingerslip.published import PublishedSet
from fingerslip.report.figures.contact import slip_frames_figure
from fingerslip.report.figures.deformed import deformed_frames_figure, has_frames, held_figure, is_held
from fingerslip.report.figures.study import event_times_figure, latency_figure
from fingerslip.report.labels import path_label, swept_text
from fingerslip.report.page.content import ReportContent
from fingerslip.report.page.page import Picture
from fingerslip.report.tables.runs import swept_paths
from fingerslip.results import RunResult

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["are_held", "hero_pictures", "swept_pictures"]


def hero_pictures(content: ReportContent) -> tuple[Picture, ...]:
    """Return the pictures below the answer: of the first swept value, or of the only run; none of samples."""
    if swept := swept_pictures(content, slice(1)):
        return tuple(swept)
    if not content.drawn:
        return ()
    if are_held(content.titled_histories()):
        said = "How the force changes, and how far bodies move, while nothing slides."
        return (Picture("held", said, held_figure(content.titled_histories())),)
    run = content.drawn[len(content.drawn) // 2]
    history = content.histories[run.name]
    if is_solid(history):
        said = "Where the contact sticks and slips, seen from below; the plate moves to the right."
        return (Picture("answer", said, slip_frames_figure(history, run.events)),)
    if has_frames(history):
        said = (
            "The deformed section, to scale, at the snapshots nearest to the start of the slide and to the slip events."
        )
        return (Picture("answer", said, deformed_frames_figure(history, run.events)),)
    return ()


def swept_pictures(content: ReportContent, which: slice = slice(None)) -> list[Picture]:
    """Draw event times from the start of the slide and latency against swept values; nothing where nothing slid."""
    if are_held(content.titled_histories()):
        return []
    runs = content.study.runs
    differing = [path for path in swept_paths(runs) if len(_values(runs, path)) > 1]
    return [picture for path in differing[which] for picture in _against(content, path)]


def _values(runs: Sequence[RunResult], path: str) -> set[object]:
    return {swept_text(run.swept[path]) for run in runs if path in run.swept}


def _against(content: ReportContent, path: str) -> tuple[Picture, Picture]:
    runs, reference = content.study.runs, _merge_sets(content.references)
    name, words = path.replace(".", "-").replace("_", "-"), path_label(path)
    latency = latency_figure(runs, path, reference)
    times = event_times_figure(runs, path, reference, content.starts or None)
    said = f"Slip events against {words}, in seconds from the start of the slide."
    return (
        Picture(f"latency-{name}", f"Time from incipient to overall slip against {words}.", latency),
        Picture(f"events-{name}", said, times),
    )


def are_held(histories: Mapping[str, xr.Dataset]) -> bool:
    """Tell whether nothing slides in any of some runs."""
    return bool(histories) and all(map(is_held, histories.values()))


def _merge_sets(references: Sequence[PublishedSet]) -> PublishedSet | None:
    """Join published sets for a figure; the first stands for the paper."""
    if not references:
        return None
    values = tuple(value for reference in references for value in reference.values)
    return dataclasses.replace(references[0], values=values)
