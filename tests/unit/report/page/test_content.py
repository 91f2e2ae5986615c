"""What a report is made of, by the titles of the runs."""

from __future__ import annotations

import dataclasses

from fingerslip.report.page.content import MOST_RUNS
from fingerslip.results import RunResult
from fingerslip.slip import Events
from unit.report.page.contents import content_of, two_runs
from unit.synthetic import Process, make


def test_histories_and_events_are_found_by_title() -> None:
    content = two_runs()
    titles = ["friction coefficient 0.4", "friction coefficient 0.6"]
    assert list(content.titled_histories()) == list(content.titled_events()) == titles
    assert content.titled_events()[titles[1]] == content.study.runs[1].events


def test_a_study_without_a_title_is_called_like_its_folder() -> None:
    content = two_runs()
    untitled = dataclasses.replace(content, study=dataclasses.replace(content.study, title=""))
    assert (content.title, untitled.title) == ("A <study>", "study")


def test_only_runs_with_a_history_are_drawn_and_no_more_than_fit() -> None:
    history = make(Process())
    runs = tuple(RunResult(str(number), {"n": number}, Events()) for number in range(MOST_RUNS + 3))
    content = content_of(runs, {run.name: history for run in runs[1:]})
    assert [run.name for run in content.drawn] == [str(number) for number in range(1, MOST_RUNS + 1)]
