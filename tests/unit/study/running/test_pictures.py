"""Pictures and films of runs, made as soon as they are computed."""

import dataclasses
import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.history import write_history
from fingerslip.report.content import MOST_RUNS, RunPictures
from fingerslip.report.figures import style as figures
from fingerslip.report.page import pictures as page
from fingerslip.study.definition.runs import plan_study
from fingerslip.study.definition.settings import CameraSettings
from fingerslip.study.running import compute, runner
from fingerslip.study.running.build import prepare
from fingerslip.study.running.compute import Drawing, drawings_of
from fingerslip.study.running.films import camera_of, film_history, film_runs
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import Engine, compute_jobs, write_up
from fingerslip.study.storage import reporting
from fingerslip.study.storage.reporting import film_keys, read_films, read_results, write_report
from fingerslip.vision.cameras.camera import pixels_of
from fingerslip.vision.tracks import make_tracks, read_tracks
from unit.filmed import filmed_history
from unit.study.block import NAMES, Told, block_values


def planned(path):
    plan = plan_study(path, path.parent / "results")
    return plan, prepare(plan, plan.runs)


def contents(folder):
    files = [folder / "report.html", *(folder / "figures").iterdir()]
    return {path.name: path.read_bytes() for path in files}


def test_runs_in_detail_are_drawn_with_the_first_model_of_each_mesh_unless_sampled_or_ended(write_study):
    plan, jobs = planned(write_study())
    drawings = drawings_of(plan, jobs)
    assert list(drawings) == NAMES
    assert all(one.contact for one in drawings.values())
    assert [one.model for one in drawings.values()] == [True] + [False] * (len(NAMES) - 1)
    resumed = drawings_of(plan, jobs[1:])
    assert resumed[jobs[1].run.name] == Drawing(contact=True, model=True)
    assert drawings_of(dataclasses.replace(plan, study=SimpleNamespace(sample=object())), jobs) == {}
    # Of many runs only those are drawn that a report shows.
    frictions = [0.1 + 0.01 * number for number in range(MOST_RUNS + 2)]
    plan, jobs = planned(write_study(block_values() | {"sweep": {"contact.friction_coefficient": frictions}}))
    first, later = jobs[0].run.name, jobs[MOST_RUNS].run.name
    assert drawings_of(plan, jobs) == {first: Drawing(contact=True, model=True)}
    late = drawings_of(plan, jobs[MOST_RUNS:])
    assert late == {later: Drawing(contact=False, model=True)}


@pytest.mark.slow
def test_report_and_figures_are_the_same_whether_runs_are_drawn_beside_or_at_the_end(
    write_study, simulated, monkeypatch
):
    monkeypatch.setattr(figures, "_DOTS_PER_INCH", 20)
    plan, jobs = planned(write_study())
    _, pictures = compute_jobs(plan, jobs, Engine(StudyProgress(), 1), drawings_of(plan, jobs))
    assert sorted(pictures) == NAMES
    monkeypatch.setattr(runner, "write_report", only_drawn(runner.write_report))
    folder = write_up(plan, (), pictures).folder
    beside = contents(folder)
    write_report(read_results(folder))
    assert contents(folder) == beside
    assert f"section-{NAMES[0]}.png" in beside
    assert f"{NAMES[2]}-slip-map.png" in beside


def test_a_worker_writes_the_report_where_workers_drew_the_runs(monkeypatch):
    monkeypatch.setattr(reporting, "write_report", lambda *_: asked.append("here"))
    monkeypatch.setattr(compute, "in_worker", lambda function, *_: asked.append(function))
    asked = []
    for pictures in (None, {"a": RunPictures()}, {"a": RunPictures(process=-1)}):
        runner.write_report(None, pictures)
    assert asked == ["here", "here", reporting.write_report]


def only_drawn(write):
    """Return the writer of reports; it fails where it draws a run that is drawn already."""

    def write_report(study, pictures):
        def again(*_):
            raise AssertionError

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("fingerslip.report.page.assemble.run_pictures", again)
            patch.setattr("fingerslip.report.page.assemble.model_pictures", again)
            write(study, pictures)

    return write_report


def test_what_cannot_be_drawn_is_left_to_the_report(write_study, simulated, monkeypatch):
    plan, jobs = planned(write_study())

    def failing(run, *_, **__):
        if run.name == NAMES[1]:
            raise ZeroDivisionError

    monkeypatch.setattr(page, "draw_ahead", failing)
    failures, pictures = compute_jobs(plan, jobs, Engine(StudyProgress(), 1), drawings_of(plan, jobs))
    assert (failures, list(pictures)) == ({}, [NAMES[0], NAMES[2]])


SMALL = CameraSettings(
    width=160, height=120, view_width=14e-3, distance=30e-3, rest=0.4, marker_radius=0.3e-3, exposure=1e-3, seed=3
)
POINT = CameraSettings(tier="point", rest=0.4)


def filmed_plan(folder, cameras, identity="a"):
    """Return what filming needs of a plan."""
    runs, study = {"run": SimpleNamespace(identity=identity)}, SimpleNamespace(cameras=cameras)
    return SimpleNamespace(folder=folder, source=folder.with_suffix(".yaml"), study=study, finished_runs=lambda: runs)


@pytest.mark.slow
def test_a_pixel_camera_leaves_video_truth_and_tracks_that_agree_and_a_point_camera_no_frames(tmp_path):
    errors = film_history(filmed_history(), "external", SMALL, tmp_path / "cameras" / "external", "key")
    folder, still_for = tmp_path / "cameras" / "external", filmed_history()["displacement"].values[:50, 0]
    made = {path.name for path in folder.rglob("*")}
    assert made >= {"video.avi", "truth.nc", "errors.json", "tracks.nc", "tracks.csv", "overlay.avi", "quality.html"}
    assert (errors.kept, errors.swapped) == (1.0, 0)
    assert errors.rms < 0.1
    assert json.loads((folder / "errors.json").read_text())["camera"]["seed"] == 3
    truth = read_tracks(folder / "truth.nc")
    assert float(truth["time"][0]) == pytest.approx(-0.4)
    # What sticks stands still in the image of the camera that goes with the plate.
    still = truth["position"].values[:, 0]
    moved = np.linalg.norm(still[truth["time"].values < 1.6] - still[0], axis=1)
    assert moved.max() < 0.01 * 160 + np.linalg.norm(np.ptp(still_for, axis=0)) * 1e5
    errors = film_history(filmed_history(), "external", POINT, tmp_path / "point")
    assert not (tmp_path / "point" / "video.avi").exists()
    assert errors.kept == 1.0
    assert 0.0 < errors.rms < 0.02


@pytest.mark.slow
def test_films_are_made_once_and_again_where_camera_or_run_changed_and_unrecorded_markers_are_an_error(tmp_path):
    study = tmp_path / "study"
    (study / "run").mkdir(parents=True)
    write_history(filmed_history(), study / "run" / "history.nc")
    for cameras, identity, count in (
        ({"external": POINT}, "a", 1),
        ({"external": POINT}, "a", 0),
        ({"external": POINT}, "b", 1),
        ({"external": CameraSettings(tier="point", rest=0.4, seed=1)}, "b", 1),
    ):
        said = Told()
        assert film_runs(filmed_plan(study, cameras, identity), said) == {}
        assert len(said.messages) == count
    assert "external camera: 5 markers in" in said.messages[0]
    assert len(film_keys(study, ["run", "other"])) == 1
    (film,) = read_films(study, {"run": filmed_history()})
    assert (film.kind, film.frames, film.numbers["markers"]) == ("external", {}, 5)
    shutil.rmtree(study / "run" / "cameras")
    write_history(filmed_history().isel(site=[0, 1]), study / "run" / "history.nc")
    errors = film_runs(filmed_plan(study, {"internal": POINT, "external": POINT}), Told())
    assert list(errors) == ["run/cameras/internal"]
    assert isinstance(errors["run/cameras/internal"], InputError)
    assert not (study / "run" / "cameras" / "internal").exists()


def test_cameras_aim_at_the_markers():
    markers = make_tracks([[[0.0, 1e-3], [2e-3, 3e-3]]], [0.0], units="m")
    for kind, height in (("internal", 2e-3), ("external", 1e-3)):
        camera = camera_of(SMALL, kind, markers)
        assert pixels_of(camera, np.array([0.0, height])) == pytest.approx([79.5, 59.5])
