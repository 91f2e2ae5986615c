"""The verbs that read, show and convert: each is called once as a user calls it."""

import json
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import fingerslip as fs
from fingerslip.published import published_set
from fingerslip.report.scene import viewer
from fingerslip.study import fit
from fingerslip.study.inspection import show as inspection
from fingerslip.study.shipped import TEMPLATES
from fingerslip.study.storage import reporting
from fingerslip.tables.table import Column, Table
from fingerslip.validation import comparison
from fingerslip.validation.rows import Comparison, GeometryRow, Stored, number_row
from fingerslip.verification import catalogue
from fingerslip.verification.problem import Problem, relative
from fingerslip.vision.video import read_frames, write_video
from problems import clips
from unit.commands.conftest import contents
from unit.report.scenes import block_history


@pytest.mark.usefixtures("no_report")
def test_a_study_is_checked_run_compared_exported_drawn_and_reported(invoke, block, tmp_path, monkeypatch):
    path = block(sweep={"contact.friction_coefficient": [0.2, 0.4]})
    before = contents(tmp_path)
    checked = invoke("check", path).output
    assert "2 runs" in checked
    # 9 x 5 nodes with two unknowns; 60 ms in steps of 2 ms.
    assert re.search(r"friction_coefficient-0.2 +to do +90 +30 ", checked)
    assert contents(tmp_path) == before
    invoke("run", "--workers", "1", path)
    compared = invoke("diff", *(f"results/block/friction_coefficient-{friction}" for friction in (0.2, 0.4))).output
    assert re.search(r"contact\.friction_coefficient +0\.2 +0\.4", compared)
    assert re.search(r"friction over normal force at the end of the slide +0\.2 +0\.4 +0\.2", compared)
    written = invoke("export", "results/block", "--format", "mat").output.strip()
    assert Path(written).joinpath("runs.mat").is_file()
    invoke("export", "results/block", "--format", "xls", code=2)
    written = invoke("figure", "results/block", "--kind", "slip-maps", "-o", str(tmp_path / "e.svg")).output.strip()
    assert Path(written).read_bytes().startswith(b"<?xml")
    assert "film: a film, as MP4" in invoke("figure", "results/block").output
    invoke("figure", "results/block", "--kind", "x", code=2)
    invoke("figure", "results/block", "--format", "bmp", code=2)
    with monkeypatch.context() as patch:
        patch.setattr("fingerslip.study.inspection.views.write_figure", lambda *_: "c.pdf")
        said = invoke("figure", "results/block", "--kind", "composed").stderr
        assert said.strip() == "friction_coefficient-0.4: one of several runs; --run names another."
    made = []
    monkeypatch.setattr(reporting, "write_report", lambda stored: made.append(stored.folder))
    monkeypatch.delattr("fingerslip.dynamics.simulation.simulate")
    assert "Slip events from accumulated slip" in invoke("report", "results/block").output
    assert made == [Path("results/block")]


@pytest.mark.parametrize(
    "wrong", [{"time": {"step": "-1 ms"}}, {"contact.normal": [0, -1]}], ids=["of its file", "of its model"]
)
def test_studies_without_mistakes_are_shown_beside_the_mistakes_of_others(invoke, block, wrong):
    path = block()
    other = Path(path).with_name("other.yaml")
    values = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    changes = (
        {"contact": values["contact"] | {"normal": wrong["contact.normal"]}} if "contact.normal" in wrong else wrong
    )
    other.write_text(yaml.safe_dump(values | changes), encoding="utf-8")
    result = invoke("check", path, str(other), code=2)
    assert "block.yaml" in result.stdout
    assert "Checked: the others have mistakes" in result.stdout
    assert "WARNING: block.yaml: programme.0" in re.sub(r"\s+", " ", result.stdout)
    assert "other.yaml" in result.stderr
    assert "other.yaml" not in result.stdout
    assert "block.yaml" not in result.stderr
    assert invoke("check", str(other), code=2).stdout == ""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("report", ".", "-o", "page.html"), "it is where a comparison goes"),
        (("track", "clip.mp4"), "error: clip.mp4: cannot be read as a video"),
        (("track", "clip.mp4", "-o", "clip.mp4"), "error: clip.mp4: is a file, needs a folder"),
        (("validate", "--studies", "nowhere"), "validate needs the study wang2014_table2"),
        (("validate", "--only", "wang2014", "--detection"), "--detection: is of bulens2023"),
    ],
)
def test_wrong_input_is_exit_code_2_and_leaves_nothing(invoke, tmp_path, arguments, words):
    (tmp_path / "clip.mp4").write_text("no video")
    assert words in invoke(*arguments, code=2).stderr
    assert contents(tmp_path) == ["clip.mp4"]


@pytest.mark.usefixtures("no_report")
def test_converge_gives_the_events_their_uncertainty(invoke, block, tmp_path):
    study = block(curvature=2.0)
    found = invoke("converge", study, "--results", tmp_path / "r", "--workers", "1")
    assert "Numerical uncertainty, run" in found.stdout
    assert "overall slip (accumulated slip)" in found.stdout
    again = invoke("converge", study, "--results", tmp_path / "r", "--markdown")
    assert again.stdout.startswith("## Numerical uncertainty, run")
    assert "computed" not in again.stderr
    assert "After ±" in invoke("show", tmp_path / "r" / "block").stdout
    page = invoke("show", tmp_path / "r" / "block", "--markdown").stdout
    assert page.startswith("## ")
    assert "\n| " in page


def no_screen(*_):
    raise fs.ResultError("no screen")


def test_a_mesh_a_new_study_and_an_example_are_written(invoke, block, tmp_path, monkeypatch):
    assert "45 nodes, 32 cells" in invoke("mesh", block(), "-o", "copy.msh").output
    assert set(fs.read_mesh(tmp_path / "copy.msh").boundaries) == {"bottom", "top"}
    assert "copy.msh for 2 meshes, needs a single mesh" in invoke("mesh", "a", "b", "-o", "copy.msh", code=2).stderr
    assert "would be written over a/b.msh" in invoke("mesh", "a/b.msh", "c/b.msh", code=2).stderr
    with monkeypatch.context() as patch:
        patch.setattr("fingerslip.report.figures.style.save_figure", no_screen)
        assert "45 nodes, 32 cells" in invoke("mesh", "copy.msh", "-o", "copy.png", code=2).stdout
    several = invoke("mesh", "copy.msh", "copy.msh").output
    assert several.count(str(Path("meshes") / "copy.msh.png")) == 2
    assert "wang2014_table2" in invoke("examples").output
    assert invoke("examples", "wang2014_table2").output.strip() == "wang2014_table2.yaml"
    assert Path("wang2014_table2.yaml").is_file()
    assert all(name in invoke("new", "--help").output for name in TEMPLATES)
    result = invoke("new", "friction", "--template", "sweep")
    assert "friction.yaml: look at it with fingerslip check friction.yaml" in " ".join(result.output.split())
    assert Path("friction.yaml").is_file()
    invoke("new", "friction", code=2)


@pytest.mark.parametrize(
    ("arguments", "asked", "expected"),
    [
        (
            ("predict", "results/x", "--at", "a.b=1", "--at", "c=2 mm"),
            *("predict_table", [["a.b=1", "c=2 mm"], ["incipient_slip", "overall_slip", "latency"]]),
        ),
        (
            ("sensitivity", "results/x", "--of", "overall_slip", "--method", "morris"),
            *("write_sensitivities", ["overall_slip", "morris"]),
        ),
    ],
)
def test_what_is_asked_for_is_passed_on_and_printed(invoke, monkeypatch, arguments, asked, expected):
    calls = []
    table = Table("What moves it", (Column("output"),), (("latency",),))
    answer = table if asked == "predict_table" else (table,)
    monkeypatch.setattr(inspection, asked, lambda *own: calls.append(own) or answer)
    assert json.loads(invoke(*arguments, "--json").output)[0]["rows"] == [["latency"]]
    assert [str(calls[0][0]), *calls[0][1:]] == ["results/x", *expected]


def test_a_fit_prints_its_tables_and_says_where_its_figures_are(invoke, monkeypatch):
    calls = []
    tables = tuple(Table(title, (Column("output"),), (("latency",),)) for title in ("Values", "Slip"))
    answer = fit.Posterior(Path("results/x/fit"), tables)
    monkeypatch.setattr(fit, "fit", lambda *own, **options: calls.append((*own, options["workers"])) or answer)
    printed = invoke("fit", "x.yaml", "x.csv", "--workers", 3, "-q").stdout
    assert "Values" in printed
    assert "figures and samples: results/x/fit" in printed
    assert [table["title"] for table in json.loads(invoke("fit", "x.yaml", "x.csv", "--json").stdout)] == [
        table.title for table in tables
    ]
    assert calls[0] == (Path("x.yaml"), Path("x.csv"), 3)


@pytest.mark.slow
def test_folder_has_tracks_overlay_and_page(invoke, tmp_path):
    frames = clips.filmed(clips.slide(clips.field(), 0.3, count=12, rest=6))
    write_video(tmp_path / "clip.avi", frames, 60.0)
    done = invoke("track", "clip.avi", "--markers", 81, "--rest", 6, "--output", "clip_tracks")
    assert (
        "tracks of 81 markers in 12 frames at 60 a second (the file's), 100.00 % of the positions found" in done.stdout
    )
    folder = tmp_path / "clip_tracks"
    assert sorted(path.name for path in folder.iterdir()) == ["overlay.avi", "quality.html", "tracks.csv", "tracks.nc"]
    assert fs.read_tracks(folder / "tracks.nc").sizes["marker"] == 81
    assert len(list(read_frames(folder / "overlay.avi"))) == 12
    assert "following its markers" in done.stderr


@pytest.mark.slow
def test_partial_tracks_are_called_so(invoke, tmp_path):
    write_video(tmp_path / "images", clips.filmed(clips.still(clips.field()[:75], 6)), 60.0)
    done = invoke("track", "images", "--markers", 81, "--rest", 4, "--layout", "free", "--dark", "-o", "there", "-q")
    assert done.stderr == ""
    assert "warning: found 75 of 81 markers in the first frames" in done.stdout
    assert "partial tracks of 75 markers" in done.stdout
    assert "These tracks are partial." in (tmp_path / "there" / "quality.html").read_text()


@pytest.mark.slow
def test_a_broken_mp4_is_one_line(tmp_path):
    # FFmpeg would add lines of its own on the process's standard error, which only another process shows.
    (tmp_path / "cut.mp4").write_bytes(b"\x00\x00\x00\x18ftypmp42\x00\x00\x00\x00mp42isom" + bytes(range(256)) * 9)
    track = [sys.executable, "-m", "fingerslip", "track", "cut.mp4", "--quiet"]
    done = subprocess.run(track, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: cut.mp4: cannot be read as a video, needs a whole file")


def test_rows_come_as_table_json_and_markdown(invoke, monkeypatch):
    value = published_set("wang2014-table2").values[0]
    rows = (number_row("overall slip", value, 1.75, 0.01),)
    allowed = Stored((GeometryRow("incipient slip", "Table 2", 1.53, None, "", 0, 50),), "Stored.")
    asked = []

    def compare(*given, **chosen):
        asked.append((*given[:3], chosen))
        return Comparison(rows, ("Rows are stored.",), allowed)

    monkeypatch.setattr(comparison, "compare", compare)
    text = invoke("validate", "--studies", "s", "--results", "r", "--workers", "1").stdout
    assert "overall slip" in text
    assert "Rows are stored." in text
    assert asked == [(Path("s"), Path("r"), 1, {"only": None, "computed": []})]
    assert json.loads(invoke("validate", "--json", "--only", "wang2014", "--geometry").stdout)[0]["ours"] == 1.75
    assert asked[-1][-1] == {"only": "wang2014", "computed": ["geometry"]}
    invoke("validate", "--pouring", "--detection")
    assert asked[-1][-1]["computed"] == ["pouring", "detection"]
    page = invoke("validate", "--markdown").stdout
    assert page.startswith("# Validation against published values\n")
    assert "unknown geometry" not in page


def replace_problems(monkeypatch, *problems):
    known = {one.name: one for one in problems}
    monkeypatch.setattr(catalogue, "FILES", {"made": tuple(known)})
    monkeypatch.setattr(catalogue, "problem", known.__getitem__)


def test_verify_prints_one_table_fails_where_a_check_does_and_goes_on_where_a_problem_cannot_be_computed(
    invoke, monkeypatch
):
    def problem(name, got):
        return Problem(name, "Half", "Arithmetic", slow=False, compute=lambda: (relative("half", 0.5, got, 1e-3),))

    def fail():
        raise fs.ConvergenceError(0.5, 7, 1e-3, 1e-10, "try a smaller time step")

    lost = Problem("lost", "Lost", "None", slow=False, compute=fail)
    replace_problems(monkeypatch, lost, problem("right", 0.5))
    done = invoke("verify", code=1)
    assert "could not be computed" in done.stdout
    assert "1 of 2 checks passed" in done.stdout
    replace_problems(monkeypatch, problem("right", 0.5), problem("wrong", 0.6))
    assert invoke("verify", "--only", "right").stderr
    assert not invoke("verify", "--only", "right", "--quiet").stderr
    right = invoke("verify", "--only", "right", "--markdown")
    assert "| right | half | 0.5 | 0.5 | 0.0e+00 | 1.0e-03 | yes |" in right.stdout
    assert "1 of 2 checks passed" in invoke("verify", code=1).stdout
    assert "may be one of right, wrong" in invoke("verify", "--only", "rihgt", code=2).stderr


@pytest.mark.slow
def test_json_has_numbers_and_nothing_else_is_printed_and_names_are_listed_without_computing(invoke):
    done = invoke("verify", "--only", "patch", "--json")
    (table,) = json.loads(done.stdout, parse_constant=pytest.fail)
    names = [column["name"] for column in table["columns"]][2:7]
    assert names == ["expected", "got", "error", "allowed", "kind of error"]
    assert all(isinstance(cell, float) for row in table["rows"] for cell in row[2:6])
    done = invoke("verify", "--list")
    assert {"patch", "cattaneo", "cook"} <= set(done.stdout.split())
    assert done.stderr == ""


def test_options_reach_the_picture_and_its_path_is_printed(invoke, tmp_path, monkeypatch):
    (tmp_path / "run").mkdir()
    fs.write_history(block_history(), tmp_path / "run" / "history.nc")
    drawn = []
    monkeypatch.setattr(viewer, "save_still", lambda _, *asked: drawn.append(asked))
    done = invoke("view", "run", "--screenshot", "p.png", "--field", "region", "--time", "50 ms")
    assert done.stdout == "p.png\n"
    ((path, time, options),) = drawn
    assert (path, time, options.scalar) == (Path("p.png"), pytest.approx(0.05), "region")
    wrong = invoke("view", "run", "--screenshot", "q.png", "--cut", "w", code=2)
    assert "view: --cut: got 'w', needs one of none, x, y, z" in wrong.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a display")
def test_where_nothing_can_be_shown_one_line_says_so(invoke, tmp_path, monkeypatch):
    fs.write_history(block_history(), tmp_path / "history.nc")
    monkeypatch.setenv("DISPLAY", "")
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        tried = {
            ("--web", "--no-browser", "--port", port): f"port {port} is in use at 127.0.0.1, needs a port that is free",
            ("--web", "--no-browser", "--port", 70000): "view: --port: got 70000, needs a number from 0 to 65535",
            ("--web", "--no-browser", "--host", "192.0.2.1"): "view: --host: '192.0.2.1' is no address of this machine",
            (): "view: found no display to open a window on, needs one that answers; write --web for a browser",
        }
        for options, words in tried.items():
            done = invoke("view", "history.nc", *options, code=2)
            assert words in done.stderr
            assert (done.stdout, done.stderr.count("\n")) == ("", 1)
