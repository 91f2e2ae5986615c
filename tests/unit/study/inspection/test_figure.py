"""One figure or film of stored results."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.errors import InputError, ResultError
from fingerslip.history import write_history
from fingerslip.results import result_of, write_result
from fingerslip.study.inspection.figure import FigureChoice, film_size, kinds_text, write_figure
from fingerslip.vision.video import video_info
from unit.report.scenes import block_history

pytestmark = pytest.mark.usefixtures("reports", "simulated")


@pytest.fixture
def folder(finished: Path) -> Path:
    return finished


@pytest.mark.parametrize(("form", "start"), [("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG")])
def test_a_figure_of_a_study_stands_beside_its_results(folder: Path, form: str, start: bytes) -> None:
    written = write_figure(folder, FigureChoice("latency", form=form))
    assert written == folder / f"latency.{form}"
    assert written.read_bytes().startswith(start)


def test_of_several_runs_one_has_to_be_named(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="this kind shows one run of"):
        write_figure(folder, FigureChoice("forces"))
    with pytest.raises(InputError, match="--run: 'x' is not there"):
        write_figure(folder, FigureChoice("forces", run="x"))
    written = write_figure(folder, FigureChoice("forces", run="friction_coefficient-0.2", style="slides"))
    assert written.name == "forces-friction_coefficient-0.2.pdf"
    with pytest.raises(ResultError, match="holds no study"):
        write_figure(tmp_path, FigureChoice("latency"))


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        (FigureChoice("nothing"), "--kind: got 'nothing', needs one of latency"),
        (FigureChoice("latency", style="poster"), "--style: got 'poster', needs one of page, paper, slides"),
        (FigureChoice("latency", form="gif"), "--format: got 'gif', needs one of pdf, svg, png"),
        (FigureChoice("latency", path="mesh.size"), "--over: 'mesh.size' is not swept"),
    ],
)
def test_wrong_choices_say_what_is_allowed(folder: Path, choice: FigureChoice, words: str) -> None:
    with pytest.raises(InputError, match=words):
        write_figure(folder, choice)


def test_what_a_run_has_not_is_said(folder: Path, tmp_path: Path) -> None:
    run = folder / "friction_coefficient-0.2"
    with pytest.raises(InputError, match=r"--time: got 99 s, needs a time of the run, 0 to"):
        write_figure(run, FigureChoice("forces", times=("99 s",)))
    with pytest.raises(InputError, match="--run: got 'x' with the folder of a run, needs the folder of its study"):
        write_figure(run, FigureChoice("forces", run="x"))
    with pytest.raises(InputError, match=r"--output: got '.*film.avi', needs a name that ends in .mp4"):
        write_figure(run, FigureChoice("film"), tmp_path / "film.avi")
    assert list(tmp_path.glob("film*")) == []


def test_a_film_is_an_mp4_of_the_asked_size_and_rate(tmp_path: Path) -> None:
    history = block_history("Q4")
    write_history(history, tmp_path / "history.nc")
    (tmp_path / "run.yaml").write_text("title: block\n", encoding="utf-8")
    write_result(result_of(history, "run", {}), tmp_path)
    film = {"size": (480, 270), "frame_rate": 10.0, "seconds": 0.5}
    written = write_figure(tmp_path, FigureChoice("film", film=film))
    info = video_info(written)
    assert written.name == "film.mp4"
    assert (info.width, info.height, info.frame_count, info.frame_rate) == (480, 270, 5, 10.0)


def test_sizes_are_read_and_kinds_listed() -> None:
    assert film_size("640x480") == (640, 480)
    with pytest.raises(InputError, match="got '640', needs a width and a height"):
        film_size("640")
    assert "deformed: " in kinds_text()
