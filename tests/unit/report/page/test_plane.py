"""What a report shows of sections."""

from __future__ import annotations

import skfem

from fingerslip.report.page.pictures import RunToDraw
from fingerslip.report.page.plane import PLANE
from fingerslip.slip import find_events
from unit.synthetic import Process, make

HISTORY = make(Process())
RUN = RunToDraw("a", "friction coefficient 0.6", HISTORY, find_events(HISTORY))


def test_pictures_have_the_name_of_the_run_and_its_title() -> None:
    mesh = skfem.MeshQuad().refined(1).scaled(1e-3)
    (model,) = PLANE.model(RUN, mesh)
    assert (model.name, model.figure.get_suptitle()) == ("section-a", "Section: friction coefficient 0.6")
    slip_map, displacement = PLANE.run(RUN)
    assert (slip_map.name, displacement.name) == ("a-slip-map", "a-displacement")
    assert slip_map.figure.axes[0].get_title(loc="left") == "friction coefficient 0.6"


def test_runs_side_by_side_are_slip_maps() -> None:
    histories = {"one": HISTORY, "other": HISTORY}
    (picture,) = PLANE.side_by_side(histories, {})
    assert picture.name == "slip-maps"
    assert [axes.get_title(loc="left") for axes in picture.figure.axes] == ["one", "other"]
