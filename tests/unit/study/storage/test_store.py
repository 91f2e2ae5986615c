"""The folder of a run: what tells its inputs apart, and what is read back of it."""

from __future__ import annotations

import dataclasses
import json
import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import skfem

from fingerslip.errors import ResultError
from fingerslip.history import read_history
from fingerslip.results import RUN
from fingerslip.slip import find_events, measures
from fingerslip.slip.measures import Measure
from fingerslip.study.running.plan import plan_study
from fingerslip.study.storage.store import identity, mesh_hash, mesh_size, read_run, write_run
from unit.study.block import block_mesh, block_values
from unit.synthetic import Process, make

Write = Callable[..., Path]


@pytest.fixture
def folder(write_study: Write, tmp_path: Path) -> Path:
    """Return the folder of a run that was written without computing it."""
    run = plan_study(write_study()).runs[1]
    folder = tmp_path / run.name
    folder.mkdir()
    write_run(folder, run, make(Process()), inputs="abc", mesh=block_mesh(), seconds=1.2345)
    return folder


def test_what_is_written_is_read_back_with_all_values(folder: Path) -> None:
    result = read_run(folder, {"slip.overall": 0.01})
    assert sorted(path.name for path in folder.iterdir()) == ["events.json", "history.nc", "run.yaml"]
    assert (result.name, result.identity, result.seconds) == ("friction_coefficient-0.4", "abc", 1.234)
    assert result.swept == {"contact.friction_coefficient": 0.4}
    assert result.events == find_events(read_history(folder / "history.nc"))
    assert result.values["programme.0.press.depth"] == "0.0001 m"
    assert result.values["materials.block.poisson_ratio"] == 0.3
    assert result.uncertainty == {"slip.overall": 0.01}
    assert result.mesh_hash == mesh_hash(block_mesh())
    assert result.mesh_size == mesh_size(block_mesh()) == pytest.approx(32 ** (-1 / 2))


def test_a_changed_run_yaml_is_not_taken_for_that_of_the_run(folder: Path) -> None:
    text = (folder / RUN).read_text()
    (folder / RUN).write_text(text.replace("0.0001 m", "0.0002 m"))
    with pytest.raises(ResultError, match=r"friction_coefficient-0\.4/run\.yaml: is damaged.*; run the study again"):
        read_run(folder, {})


@pytest.mark.parametrize("name", ["events.json", "history.nc"])
def test_a_run_that_lacks_a_file_is_no_finished_run(folder: Path, name: str) -> None:
    (folder / name).unlink()
    with pytest.raises(ResultError, match=r"friction_coefficient-0\.4: holds no finished run; run the study again"):
        read_run(folder, {})


def test_a_damaged_run_yaml_is_named(folder: Path) -> None:
    (folder / RUN).write_text("a: [")
    with pytest.raises(ResultError, match=r"friction_coefficient-0\.4/run\.yaml"):
        read_run(folder, {})


def test_an_added_measure_is_in_the_file_and_in_the_log(
    write_study: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    added = Measure("slides", "number of slides", lambda history: int((history["phase_kind"] == "slide").sum()))
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    with caplog.at_level(logging.INFO, "fingerslip"):
        write_run(
            tmp_path, plan_study(write_study()).runs[0], make(Process()), inputs="a", mesh=block_mesh(), seconds=1.0
        )
    assert json.loads((tmp_path / "events.json").read_text())["numbers"]["slides"] == 1
    assert "number of slides: 1" in caplog.messages
    assert "largest normal force: 0.4 N" in caplog.messages


def test_contact_at_a_free_edge_is_a_warning_in_the_log(
    write_study: Write, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    run = plan_study(write_study()).runs[0]
    history = make(Process())
    ending = history.assign_coords(contact_edge_distance=("contact_node", np.zeros(history.sizes["contact_node"])))
    write_run(tmp_path, run, ending, inputs="a", mesh=block_mesh(), seconds=1.0)
    (record,) = (record for record in caplog.records if record.levelno == logging.WARNING)
    assert "friction_coefficient-0.2 ('skin' from" in record.getMessage()
    assert json.loads((tmp_path / "events.json").read_text())["edge_contact"]["distance_m"] == 0.0
    caplog.clear()
    write_run(tmp_path, run, history, inputs="a", mesh=block_mesh(), seconds=1.0)
    assert not [record for record in caplog.records if record.levelno == logging.WARNING]


def test_identity_changes_with_values_and_mesh_but_not_with_the_title(write_study: Write) -> None:
    def first(values: dict[str, object], **more: float) -> str:
        return identity(plan_study(write_study(block_values() | values, **more)).runs[0])

    base = first({})
    assert first({"title": "another"}) == base
    assert len({base, first({"depth": "2 mm"}), first({}, curvature=1.0)}) == 3


def test_mesh_hash_sees_points_and_cells_and_nothing_else() -> None:
    mesh = block_mesh()
    assert mesh_hash(mesh) == mesh_hash(block_mesh())
    assert mesh_hash(mesh.with_boundaries({"other": np.array([0])})) == mesh_hash(mesh)
    moved = mesh.p.copy()
    moved[1, 7] += 1e-8  # a millionth of the size
    assert mesh_hash(skfem.MeshQuad(moved, mesh.t)) != mesh_hash(mesh)
    assert mesh_hash(skfem.MeshQuad(mesh.p, mesh.t[:, ::-1])) != mesh_hash(mesh)


def test_a_mesh_has_one_hash_on_processors_that_round_otherwise() -> None:
    mesh = skfem.MeshTri().refined(4).scaled(7e-3)
    hashes = {mesh_hash(dataclasses.replace(mesh, doflocs=points)) for points in (mesh.p, np.nextafter(mesh.p, 1.0))}
    assert len(hashes) == 1
    assert mesh_hash(dataclasses.replace(mesh, doflocs=mesh.p * [[1.0], [1.001]])) not in hashes
