"""Contents of reports that tests share, and a check of HTML pages: every tag closed, every link and picture inside."""

import dataclasses
from html.parser import HTMLParser
from pathlib import Path

from fingerslip.report.content import ReportContent
from fingerslip.results import StudyResult, result_of
from unit.synthetic import Process, make


def content_of(runs, histories, **more):
    """Return the content of a report of a study called 'A <study>'."""
    return ReportContent(StudyResult(Path("study"), (), runs, title="A <study>"), histories, **more)


def two_runs(**more):
    """Return the content of two runs with receptors and known slip."""
    histories = {str(mu): make(Process(friction=mu, edge=1 + 0.4 * mu, centre=1 + 1.1 * mu)) for mu in (0.4, 0.6)}
    runs = tuple(
        result_of(history, name, {"contact.friction_coefficient": float(name)}) for name, history in histories.items()
    )
    return content_of(runs, histories, **more)


def with_runs(content, *runs):
    """Return the content with other runs."""
    return dataclasses.replace(content, study=dataclasses.replace(content.study, runs=runs))


VOID = {"meta", "img", "br", "link", "input"}


class Checker(HTMLParser):
    """Follows open tags and collects what a page loads."""

    def __init__(self):
        super().__init__()
        self.open = []
        self.loaded = []
        self.anchors = set()
        self.links = []

    def handle_starttag(self, tag, attrs):
        values = {name: value or "" for name, value in attrs}
        self.loaded += [values["src"]] if "src" in values else []
        self.links += [values["href"]] if "href" in values else []
        self.anchors |= {values["id"]} if "id" in values else set()
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def checked(page):
    checker = Checker()
    checker.feed(page)
    assert checker.open == []
    return checker
