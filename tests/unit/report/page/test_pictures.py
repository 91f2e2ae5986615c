"""A report takes its pictures from the set that fits the runs, whatever their kind."""

from __future__ import annotations

import pytest
import skfem
from matplotlib.figure import Figure

from fingerslip.report.page import assemble, run
from fingerslip.report.page.page import Picture
from fingerslip.report.page.pictures import PictureSet, RunToDraw
from unit.report.page.contents import two_runs


def test_another_kind_of_runs_brings_its_own_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    def picture(name: str) -> list[Picture]:
        return [Picture(name, name, Figure())]

    own = PictureSet(
        lambda shown, mesh: picture(f"model-{shown.name}-{mesh.nelements}"),
        lambda shown: picture(f"contact-{shown.title}"),
        lambda histories, events: picture(f"all-{len(histories)}-{len(events)}"),
    )
    monkeypatch.setattr(assemble, "picture_set", lambda _: own)
    monkeypatch.setattr(run, "picture_set", lambda _: own)
    report = assemble.study_report(two_runs(meshes={"0.6": skfem.MeshQuad()}))
    names = {shown.name for section in report.sections for shown in section.pictures}
    assert {"model-0.6-1", "contact-friction coefficient 0.4", "all-2-2"} <= names
    assert not {"slip-maps", "section-0.6", "0.4-slip-map"} & names


def test_a_run_to_draw_has_a_name_and_a_title() -> None:
    content = two_runs()
    first = content.study.runs[0]
    shown = RunToDraw(first.name, content.titles[first.name], content.histories[first.name], first.events)
    assert (shown.name, shown.title) == ("0.4", "friction coefficient 0.4")
