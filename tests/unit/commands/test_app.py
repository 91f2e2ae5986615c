"""The command line: help, exit codes, and one line per error with nothing written."""

from __future__ import annotations

import errno
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from fingerslip.commands.app import app
from fingerslip.mesh.io import write_mesh
from unit.study.block import block_mesh, block_values


@pytest.fixture
def invoke(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Return a function that calls the command in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def block(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes the study of a block, with some values changed, and its mesh."""

    def write(curvature: float = 0.0, **changes: Any) -> Path:
        write_mesh(block_mesh(curvature), tmp_path / "block.msh")
        values = block_values() | {"sweep": {}} | changes
        (tmp_path / "block.yaml").write_text(yaml.safe_dump(values, sort_keys=False))
        return tmp_path / "block.yaml"

    return write


@pytest.fixture
def no_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the figures and the page out."""
    from fingerslip.study.running import runner

    monkeypatch.setattr(runner, "write_report", lambda _: None)


def contents(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_help_names_every_verb_and_exit_code(invoke: Callable[..., Any]) -> None:
    result = invoke("--help")
    assert result.exit_code == 0
    for word in ("show", "check", "mesh", "run", "report", "Exit codes", "130"):
        assert word in result.output


@pytest.mark.parametrize("verb", ["show", "check", "mesh", "run", "report"])
def test_every_verb_has_help(invoke: Callable[..., Any], verb: str) -> None:
    result = invoke(verb, "--help")
    assert result.exit_code == 0
    assert "Usage" in result.output


def test_version(invoke: Callable[..., Any]) -> None:
    from importlib.metadata import version

    assert invoke("--version").output == f"fingerslip {version('fingerslip')}\n"


@pytest.mark.parametrize(
    "arguments", [["fly"], ["run"], ["run", "a.yaml", "--workers", "0"], ["check", "--slow", "a.yaml"]]
)
def test_wrong_use_is_exit_code_2(invoke: Callable[..., Any], arguments: list[str]) -> None:
    assert invoke(*arguments).exit_code == 2


def test_show_puts_assumed_values_first(invoke: Callable[..., Any]) -> None:
    lines = invoke("show", "wang2014-2d").output.splitlines()
    named = re.findall(r"^ *[a-z_.]+ +\S.*? +(assumed|wang2014|corniani2024) ", "\n".join(lines), re.MULTILINE)
    assert len(named) > 40
    assert named[0] == "assumed"
    assert "assumed" not in named[named.index("wang2014") :]


def test_show_lists_presets(invoke: Callable[..., Any]) -> None:
    assert "wang2014-2d" in invoke("show").output


def test_show_schema_is_json(invoke: Callable[..., Any]) -> None:
    import json

    assert json.loads(invoke("show", "--schema").output)["title"] == "Study"


def test_show_study_says_what_is_swept_and_what_is_default(
    invoke: Callable[..., Any], block: Callable[..., Path]
) -> None:
    path = block(sweep={"contact.friction_coefficient": [0.2, 0.4]})
    output = invoke("show", path).output
    for name, value, source in (
        ("contact.friction_coefficient", "0.2, 0.4", "study file, swept"),
        ("time.step", "2 ms", "study file"),
        ("integration", "selective", "default"),
    ):
        assert re.search(rf"^ *{re.escape(name)} +{value} +{source} *$", output, re.MULTILINE), name


def test_check_counts_runs_steps_and_unknowns(
    invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path
) -> None:
    path = block(sweep={"contact.friction_coefficient": [0.2, 0.4]})
    before = contents(tmp_path)
    result = invoke("check", path)
    assert result.exit_code == 0
    assert "2 runs" in result.output
    # 9 x 5 nodes with two unknowns; 60 ms in steps of 2 ms.
    assert re.search(r"friction_coefficient-0.2 +to do +90 +30 ", result.output)
    assert contents(tmp_path) == before


def test_mesh_of_a_study_is_written(invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path) -> None:
    from fingerslip.mesh.io import read_mesh

    result = invoke("mesh", block(), "-o", "copy.msh")
    assert result.exit_code == 0
    assert "45 nodes, 32 cells" in result.output
    assert set(read_mesh(tmp_path / "copy.msh").boundaries) == {"bottom", "top"}


@pytest.mark.usefixtures("no_report")
def test_run_shows_events_and_second_time_nothing_is_done(
    invoke: Callable[..., Any], block: Callable[..., Path]
) -> None:
    path = block()
    first = invoke("run", path)
    assert first.exit_code == 0
    assert "Slip events" in first.output
    assert "block/run: unchanged" in invoke("run", path).output
    assert "Key numbers" in invoke("show", "results/block/run").output


MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "missing key": ({"time": {}}, "time.step: is missing, needs a value"),
    "unknown key": ({"tme": 1}, "tme: is not known, may be one of .*, time, .*did you mean 'time'?"),
    "missing unit": ({"depth": 1}, "depth: '1' has no unit, needs a unit of [m]; write '1 mm' or '1 m'"),
    "wrong unit": ({"depth": "3 kg"}, "depth: got '3 kg', needs a unit of [m]; write for example '3 mm'"),
    "negative friction": (
        {"contact": {"friction_coefficient": -0.2, "boundary": "bottom"}},
        "contact.friction_coefficient: got -0.2, needs a number >= 0",
    ),
    "zero step": ({"time": {"step": "0 ms"}}, "time.step: got '0 ms', needs a value > 0"),
    "incompressible": (
        {"materials": {"block": {"youngs_modulus": "1 kPa", "poisson_ratio": 0.5, "density": "1000 kg/m^3"}}},
        "materials.block.poisson_ratio: got 0.5, plane strain with displacement elements needs < 0.5; write 0.4999",
    ),
    "no such boundary": (
        {"contact": {"friction_coefficient": 0.6, "boundary": "pulp"}},
        "boundary 'pulp' not in mesh, it has: bottom, top",
    ),
    "slide before contact": (
        {"programme": [{"slide": {"distance": "1 mm", "speed": "1 mm/s"}}]},
        "slides before the plate touches",
    ),
    "plate inside the body": (
        {"contact": {"friction_coefficient": 0.6, "boundary": "bottom", "offset": "1 mm"}},
        "contact.offset: the plate starts 1 mm inside the body, needs an offset <= 0 mm",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistake_gives_one_error_and_nothing_is_written(
    invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path, name: str
) -> None:
    changes, message = MISTAKES[name]
    path = block(**changes)
    before = contents(tmp_path)
    result = invoke("run", path)
    assert result.exit_code == 2
    error = [line for line in result.stderr.splitlines() if line]
    assert len(error) == 1
    assert error[0].startswith(f"error: {path}: ")
    for part in message.split(".*"):
        assert part in error[0]
    assert "Traceback" not in result.output
    assert contents(tmp_path) == before


def test_contact_outside_the_candidates(invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path) -> None:
    """A rounded bottom of which only the lowest nodes may touch is pressed flat."""
    contact = {"friction_coefficient": 0.6, "boundary": "bottom", "search_distance": "0.001 mm"}
    path = block(curvature=10.0, contact=contact)
    before = contents(tmp_path)
    result = invoke("run", path)
    assert result.exit_code == 2
    assert "reached the plate but is no contact candidate" in result.stderr
    assert "write a larger search_distance" in result.stderr
    assert contents(tmp_path) == before


def test_full_disk_is_exit_code_2(
    invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.study.running import compute

    def full(*arguments: object, **options: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(compute, "write_snapshots", full)
    path = block()
    before = contents(tmp_path)
    result = invoke("run", path)
    assert result.exit_code == 2
    assert "No space left on device" in result.stderr
    assert "free some space or choose another folder" in result.stderr
    assert contents(tmp_path) == before


def test_run_that_does_not_converge_is_exit_code_1(
    invoke: Callable[..., Any], block: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.errors import ConvergenceError
    from fingerslip.study.running import compute

    def failing(*arguments: object, **options: object) -> None:
        raise ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step")

    monkeypatch.setattr(compute, "simulate", failing)
    result = invoke("run", block())
    assert result.exit_code == 1
    assert "use a smaller step" in result.stderr


def test_want_of_memory_is_one_line(
    invoke: Callable[..., Any], block: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.study.running import runner

    def failing(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(runner, "build_mesh", failing)
    result = invoke("run", block())
    assert result.exit_code == 2
    assert result.stderr.strip() == "error: memory: ran out, needs more of it; take larger elements or fewer --workers"


def test_debug_shows_where_an_error_comes_from(invoke: Callable[..., Any]) -> None:
    from fingerslip.errors import InputError

    result = invoke("--debug", "run", "gone.yaml")
    assert isinstance(result.exception, InputError)


def test_report_of_a_folder_without_results(invoke: Callable[..., Any], tmp_path: Path) -> None:
    result = invoke("report", tmp_path)
    assert result.exit_code == 2
    assert "holds no results of a study" in result.stderr


@pytest.mark.usefixtures("no_report")
def test_report_is_made_again_without_computing(
    invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.study.running import compute
    from fingerslip.study.storage import reporting

    invoke("run", block())
    made: list[Path] = []
    monkeypatch.setattr(reporting, "write_report", lambda stored: made.append(stored.folder))
    monkeypatch.delattr(compute, "simulate")
    result = invoke("report", "results/block")
    assert result.exit_code == 0
    assert "Slip events from accumulated slip" in result.output
    assert made == [Path("results/block")]


@pytest.mark.usefixtures("no_report")
def test_finished_runs_are_shown_also_where_others_failed(
    invoke: Callable[..., Any], block: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.errors import ConvergenceError
    from fingerslip.study.running import compute

    whole = compute.simulate

    def sometimes(model: Any, *, progress: Callable[[float], None]) -> Any:
        if model.contacts[0].friction.coefficient > 0.3:
            raise ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step")
        return whole(model, progress=progress)

    monkeypatch.setattr(compute, "simulate", sometimes)
    path = block(sweep={"contact.friction_coefficient": [0.2, 0.4]})
    result = invoke("run", path, "--workers", "1")
    assert result.exit_code == 1
    assert re.search(r"^ *0\.2 ", result.output, re.MULTILINE)
    assert not re.search(r"^ *0\.4 ", result.output, re.MULTILINE)
    assert "error: block/friction_coefficient-0.4: contact at t = 0.5 s" in result.stderr
    assert "1 of 2 runs failed, the others are finished" in result.stderr


def test_ctrl_c_is_exit_code_130(
    invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.study.running import compute

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(compute, "simulate", interrupted)
    result = invoke("run", block())
    assert result.exit_code == 130
    assert "stopped: finished runs are kept, the same command goes on with the others" in result.stderr
    assert not (tmp_path / "results").exists()


def test_exit_code_is_that_of_what_the_user_can_mend() -> None:
    from fingerslip.commands.app import _exit_code
    from fingerslip.errors import ConvergenceError, InputError, ResultError
    from fingerslip.study.running.pool import WorkerLostError
    from fingerslip.study.running.runner import StudyFailedError

    solved = ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step")
    full = ResultError("no space")
    assert [_exit_code(error) for error in (solved, full, InputError("a", "b", "c"))] == [1, 2, 2]
    assert _exit_code(StudyFailedError({"a": solved, "b": solved}, ())) == 1
    assert _exit_code(StudyFailedError({"a": solved, "b": full}, ())) == 2
    assert _exit_code(StudyFailedError({"a": solved, "b": WorkerLostError()}, ())) == 1


def test_tables_in_a_pipe_are_not_cut(invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    lines = invoke("show", "wang2014-2d").output.splitlines()
    assert max(len(line) for line in lines) > 100
    assert any("phalanx.sagittal.concavity_position" in line for line in lines)


@pytest.fixture
def long_study(block: Callable[..., Path]) -> Path:
    """Return a study of several runs that take some seconds each."""
    return block(time={"step": "0.02 ms"}, sweep={"contact.friction_coefficient": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]})


def _started(path: Path, results: Path) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "fingerslip", "run", str(path), "--results", str(results)]
    # A new session, so that only the command itself gets the signal, as from a job scheduler.
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        yield process
        process.kill()


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_stopped_study_leaves_finished_runs_alone(long_study: Path, tmp_path: Path, sent: signal.Signals) -> None:
    folder = tmp_path / "results" / "block"
    for process in _started(long_study, tmp_path / "results"):
        deadline = time.monotonic() + 60.0
        while not list(folder.glob(".*.partial")) and time.monotonic() < deadline:
            time.sleep(0.02)
        assert list(folder.glob(".*.partial"))
        process.send_signal(sent)
        _, said = process.communicate(timeout=60)
        assert process.returncode == 130
        assert "the same command goes on with the others" in said
        assert "Traceback" not in said
    assert list((tmp_path / "results").rglob(".*")) == []


@pytest.mark.usefixtures("no_report")
def test_converge_gives_the_events_their_uncertainty(
    invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path
) -> None:
    study = block(curvature=2.0)
    found = invoke("converge", study, "--results", tmp_path / "r", "--workers", "1")
    assert found.exit_code == 0, found.stderr
    assert "Numerical uncertainty, run" in found.stdout
    assert "overall slip (accumulated slip)" in found.stdout
    again = invoke("converge", study, "--results", tmp_path / "r", "--markdown")
    assert again.stdout.startswith("## Numerical uncertainty, run")
    assert "computed" not in again.stderr
    shown = invoke("show", tmp_path / "r" / "block")
    assert "After ±" in shown.stdout


def test_verify_prints_one_table_and_fails_where_a_check_does(
    invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.verification import catalogue
    from fingerslip.verification.problem import Problem, relative

    def problem(name: str, got: float) -> Problem:
        return Problem(name, "Half", "Arithmetic", slow=False, compute=lambda: (relative("half", 0.5, got, 1e-3),))

    monkeypatch.setattr(catalogue, "PROBLEMS", (problem("right", 0.5), problem("wrong", 0.6)))
    right = invoke("verify", "--only", "right", "--markdown")
    assert right.exit_code == 0
    assert "| right | half | 0.5 | 0.5 | 0.0e+00 | 1.0e-03 | yes |" in right.stdout
    wrong = invoke("verify")
    assert wrong.exit_code == 1
    assert "1 of 2 checks passed" in wrong.stdout
    unknown = invoke("verify", "--only", "rihgt")
    assert unknown.exit_code == 2
    assert "may be one of right, wrong" in unknown.stderr


def test_verify_goes_on_where_a_problem_cannot_be_computed(
    invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.errors import ConvergenceError
    from fingerslip.verification import catalogue
    from fingerslip.verification.problem import Problem, relative

    def fail() -> Any:
        raise ConvergenceError(0.5, 7, 1e-3, 1e-10, "try a smaller time step")

    whole = Problem("whole", "One", "Arithmetic", slow=False, compute=lambda: (relative("one", 1.0, 1.0, 1e-3),))
    monkeypatch.setattr(catalogue, "PROBLEMS", (Problem("lost", "Lost", "None", slow=False, compute=fail), whole))
    done = invoke("verify")
    assert done.exit_code == 1
    assert "could not be computed" in done.stdout
    assert "1 of 2 checks passed" in done.stdout
