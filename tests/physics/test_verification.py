"""Every verification problem must pass all its checks; sources and tolerances stand with the problems."""

from importlib import import_module

import numpy as np
import pytest

import fingerslip as fs
import problems.verification
from fingerslip.verification.blocks import block_on_plate
from fingerslip.verification.catalogue import FILES, Verification, known_names, problem
from fingerslip.verification.problem import Problem, VerificationError, absolute, relative, run, solve_problem
from places import ROOT
from problems.verification import locking

PROBLEMS = (*map(problem, known_names()), *problems.verification.PROBLEMS)
DOCUMENTED = (ROOT / "results" / "reference" / "verification-problems.md").read_text(encoding="utf-8")
RESULTS = (ROOT / "results" / "reference" / "verification.md").read_text(encoding="utf-8")
# The others take about a second and more, and these test the same code.
FAST = {
    *(
        "rigid-modes",
        "convergence-2d",
        "locking-2d",
        "driven-plate",
        "dragged-block",
        "travelling-plate",
        "rivlin-cube",
    ),
    *("retardation", "resting-block", "controlled-relaxation", "friction-laws", "large-relaxation-energy"),
}
MARKED = [pytest.param(each, id=each.name, marks=[pytest.mark.slow] * (each.name not in FAST)) for each in PROBLEMS]


@pytest.mark.parametrize("each", MARKED)
def test_problem_agrees_with_its_closed_form(each):
    outcome = run(each)
    rows = Verification((outcome,)).markdown
    assert outcome.holds, f"{outcome.trouble}\n{rows}"
    assert stated(rows, each.name) == stated(RESULTS, each.name)


def stated(markdown, name):
    """Return quantity, expected and allowed of a problem's rows in a table; what came out may differ by rounding."""
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in markdown.splitlines() if line.startswith("|")]
    return [(row[1], row[2], row[5]) for row in rows if row[0] == name]


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, id=kind.name, marks=[pytest.mark.slow] * (kind.dim == 3)) for kind in locking.KINDS]
)
@pytest.mark.parametrize("ratio", locking.RATIOS)
def test_the_documentation_shows_the_errors_of_the_elements(kind, ratio):
    """To the two digits that it shows."""
    (row,) = (line for line in DOCUMENTED.splitlines() if line.startswith(f"| {kind.name} | {ratio} |"))
    written = [tuple(map(float, cell.strip(" )").split(" ("))) for cell in row.split("|")[3:7]]
    levels = [(level.error, level.unknowns) for level in locking.levels(kind, ratio)]
    np.testing.assert_allclose(written, levels, rtol=0.06)


def test_every_problem_is_documented_has_a_name_of_its_own_and_says_its_source():
    names = [each.name for each in PROBLEMS]
    rows = [line.split("|")[1].strip() for line in RESULTS.splitlines() if line.startswith("|")]
    assert sorted(set(rows[2:])) == sorted(names)
    assert len(set(names)) == len(names)
    assert set(names) >= FAST
    assert all(each.title and each.source for each in PROBLEMS)
    for file, of_file in FILES.items():
        assert tuple(each.name for each in import_module(f"fingerslip.verification.{file}").PROBLEMS) == of_file


def test_errors_are_held_against_what_is_allowed():
    assert relative("", 2.0, 2.02, 0.011).holds
    assert not relative("", -2.0, -2.03, 0.011).holds
    assert absolute("", 0.0, 1e-3, 1e-3).holds
    assert not absolute("", 0.0, float("nan"), 1e9).holds
    assert not run(Problem("without checks", "", "", lambda: ())).holds


def pushed(friction, **changes):
    """Return a model whose nodes are held along the plate, at nu = 0: pressing alone brings no friction."""
    grid = np.linspace(0.0, 1.0, 4)
    return block_on_plate(
        "Q4",
        *(grid, grid),
        material=fs.Elastic(1e5, 0.0, 1.0),
        plate={"friction": fs.Coulomb(friction), **changes},
        supports={"top": ("x", "y"), "bulk": ("x",)},
        programme=(fs.Press(0.01, 0.01),),
        time=fs.TimeStepping(0.1),
    )


def test_histories_that_break_a_law_and_lost_convergence_fail():
    solve_problem(pushed(0.0))
    with pytest.raises(VerificationError, match="friction never acts"):
        solve_problem(pushed(0.5))
    with pytest.raises(VerificationError, match="inside the rigid body"):
        solve_problem(pushed(0.0, normal_penalty=1e4), penetration=1e-4)

    def fail():
        raise fs.ConvergenceError(0.5, 7, 1e-3, 1e-10, "try a smaller time step")

    outcome = run(Problem("lost", "Lost", "None", fail))
    assert not outcome.holds
    assert "0.5" in outcome.trouble
