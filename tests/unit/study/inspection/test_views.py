"""Stored results seen: figures, films, pictures and windows."""

import pytest
import xarray as xr
from PIL import Image

import fingerslip as fs
from fingerslip.errors import FingerslipError, InputError, ResultError
from fingerslip.history import write_history
from fingerslip.results import result_of, write_result
from fingerslip.study.inspection.views import (
    FigureChoice,
    film_size,
    kinds_text,
    time_of_run,
    view_result,
    write_figure,
)
from fingerslip.vision.video import video_info
from unit.report.scenes import block_history

pytestmark = pytest.mark.usefixtures("reports", "simulated")


@pytest.fixture
def folder(finished):
    return finished


@pytest.mark.parametrize(("form", "start"), [("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG")])
def test_a_figure_of_a_study_or_of_a_run_stands_beside_its_results(folder, form, start):
    written = write_figure(folder, FigureChoice("latency", form=form))
    assert written == folder / f"latency.{form}"
    assert written.read_bytes().startswith(start)
    written = write_figure(folder, FigureChoice("forces", run=RUN, style="slides", form=form))
    assert written.name == f"forces-{RUN}.{form}"


RUN = "friction_coefficient-0.2"


@pytest.mark.parametrize(
    ("target", "choice", "output", "words"),
    [
        ("", FigureChoice("nothing"), None, "--kind: got 'nothing', needs one of latency"),
        ("", FigureChoice("latency", style="poster"), None, "--style: got 'poster', needs one of page, paper, slides"),
        ("", FigureChoice("latency", form="gif"), None, "--format: got 'gif', needs one of pdf, svg, png"),
        ("", FigureChoice("latency", path="mesh.size"), None, "--over: 'mesh.size' is not swept"),
        ("", FigureChoice("forces"), None, "this kind shows one run of"),
        ("", FigureChoice("forces", run="x"), None, "--run: 'x' is not there"),
        ("..", FigureChoice("latency"), None, "holds no study"),
        (RUN, FigureChoice("forces", times=("99 s",)), None, "--time: got 99 s, needs a time of the run, 0 to"),
        (RUN, FigureChoice("forces", run="x"), None, "--run: got 'x' with the folder of a run, needs the folder of"),
        (RUN, FigureChoice("film"), "film.avi", "--output: got '.*film.avi', needs a name that ends in .mp4"),
    ],
)
def test_wrong_choices_say_what_is_allowed(folder, target, choice, output, words):
    with pytest.raises(FingerslipError, match=words):
        write_figure(folder / target, choice, output and folder / output)
    assert list(folder.glob("film*")) == []


def test_a_film_is_an_mp4_of_the_asked_size_and_rate(tmp_path):
    history = block_history("Q4")
    write_history(history, tmp_path / "history.nc")
    (tmp_path / "run.yaml").write_text("title: block\n", encoding="utf-8")
    write_result(result_of(history, "run", {}), tmp_path)
    film = {"size": (480, 270), "frame_rate": 10.0, "seconds": 0.5}
    written = write_figure(tmp_path, FigureChoice("film", film=film))
    info = video_info(written)
    assert written.name == "film.mp4"
    assert (info.width, info.height, info.frame_count, info.frame_rate) == (480, 270, 5, 10.0)


def test_sizes_are_read_and_kinds_listed():
    assert film_size("640x480") == (640, 480)
    with pytest.raises(InputError, match="got '640', needs a width and a height"):
        film_size("640")
    assert "deformed: " in kinds_text()


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    (folder / "run").mkdir()
    write_history(block_history(), folder / "run" / "history.nc")
    return folder


@pytest.mark.parametrize("target", ["", pytest.param("run", marks=pytest.mark.slow), "run/history.nc"])
def test_a_run_is_found_in_its_study_its_folder_and_its_file(study, target, tmp_path):
    picture = tmp_path / "p.png"
    assert view_result(study / target, {"scalar": "region"}, time="50 ms", screenshot=picture) == (picture,)
    with Image.open(picture) as shown:
        assert shown.size == (1200, 900)


def test_of_several_runs_one_has_to_be_chosen_and_a_folder_without_runs_is_refused(study, tmp_path):
    with pytest.raises(ResultError, match="holds no run"):
        view_result(tmp_path, {}, screenshot=tmp_path / "p.png")
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "history.nc").write_bytes((study / "run" / "history.nc").read_bytes())
    with pytest.raises(InputError, match="holds 2 runs, needs one of a, b"):
        view_result(tmp_path, {}, screenshot=tmp_path / "p.png")


@pytest.mark.parametrize(
    ("options", "time", "message"),
    [
        ({"scalar": "stress"}, "", "view: scalar"),
        ({"cut": "q"}, "", "view: cut"),
        ({}, "1.2", "view: --time"),
        ({}, "1.2 mm", "view: --time"),
    ],
)
def test_wrong_options_are_refused_before_anything_is_drawn(study, tmp_path, options, time, message):
    with pytest.raises(InputError, match=message):
        view_result(study, options, time=time, screenshot=tmp_path / "p.png")
    assert list(tmp_path.iterdir()) == []


HISTORY = xr.Dataset(coords={"time": [0.0, 0.5, 1.0]})


@pytest.mark.parametrize(("given", "seconds"), [("0 s", 0.0), ("500 ms", 0.5), ("1 s", 1.0)])
def test_a_time_has_a_unit(given, seconds):
    assert time_of_run(HISTORY, given, "view: --time") == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("given", "said"), [("1.1 s", "0 to 1 s"), ("-1 ms", "0 to 1 s"), ("1", "unit"), ("1 mm", "s")]
)
def test_other_times_are_refused(given, said):
    with pytest.raises(fs.InputError, match=f"^view: --time: .*{said}"):
        time_of_run(HISTORY, given, "view: --time")
