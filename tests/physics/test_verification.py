"""Every verification problem must pass all its checks; sources and tolerances stand with the problems."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

import fingerslip as fs
import problems.verification
from fingerslip.tables.table import to_markdown
from fingerslip.verification.catalogue import FILES, choose, known_names, problem
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import (
    Outcome,
    Problem,
    VerificationError,
    absolute,
    relative,
    run,
    solve_problem,
    table,
)
from places import ROOT
from problems.verification import locking

PROBLEMS = (*map(problem, known_names()), *problems.verification.PROBLEMS)
DOCUMENTED = (ROOT / "results" / "reference" / "verification-problems.md").read_text(encoding="utf-8")
RESULTS = (ROOT / "results" / "reference" / "verification.md").read_text(encoding="utf-8")
# Problems that take about a second and more, of which lighter ones beside them test the same code.
LONG = {
    *("reduced-basis", "reduced-basis-static", "held-block", "impact", "stick-slip", "dragged-cylinder"),
    *("large-relaxation-limits", "large-relaxation-shear", "large-relaxation-order", "large-shear", "large-biaxial"),
    *("calculix-block", "locking-3d", "complex-modulus", "turning-body", "bar", "convergence-3d", "large-tension"),
    *("viscous-line", "small-limit", "hertz-line-3d", "damped-fall", "filled-jug", "large-relaxation-tension"),
    *("viscous-limits", "large-relaxation-turned", "coulomb-oscillator", "controlled-creep", "elastica", "large-tube"),
    *("halved-step", "viscous-hertz", "sliding-block", "condensed-2d", "friction-tangents"),
    *("controlled-oscillator", "hht-order", "relaxation", "ciavarella-jaeger", "cattaneo", "hht-damping", "rod"),
    *("viscous-vibration", "slip-weakening", "locking-2d", "rolling-cylinder", "cylinder-on-incline"),
    *("ball-between-plates", "rigid-pads"),
}
MARKED = [
    pytest.param(one, id=one.name, marks=[pytest.mark.slow] if one.slow or one.name in LONG else []) for one in PROBLEMS
]


@pytest.mark.parametrize("one", MARKED)
def test_problem_agrees_with_its_closed_form(one):
    outcome = run(one)
    assert outcome.holds, f"{outcome.trouble}\n{to_markdown(table((outcome,)))}"
    assert stated(to_markdown(table((outcome,))), one.name) == stated(RESULTS, one.name)


def stated(markdown, name):
    """Return quantity, expected and allowed of a problem's rows in a table; what came out may differ by rounding."""
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in markdown.splitlines() if line.startswith("|")]
    return [(row[1], row[2], row[5]) for row in rows if row[0] == name]


def test_the_documentation_shows_every_problem_and_no_other():
    names = [line.split("|")[1].strip() for line in RESULTS.splitlines() if line.startswith("|")]
    assert sorted(set(names[2:])) == sorted(one.name for one in PROBLEMS)


@pytest.mark.parametrize(
    "kind",
    [pytest.param(kind, id=kind.name, marks=[pytest.mark.slow] if kind.dim == 3 else []) for kind in locking.KINDS],
)
@pytest.mark.parametrize("ratio", locking.RATIOS)
def test_the_documentation_shows_the_errors_of_the_elements(kind, ratio):
    """To the two digits that it shows."""
    (row,) = (line for line in DOCUMENTED.splitlines() if line.startswith(f"| {kind.name} | {ratio} |"))
    shown = [tuple(map(float, cell.strip(" )").split(" ("))) for cell in row.split("|")[3:7]]
    np.testing.assert_allclose(
        shown, [(level.error, level.unknowns) for level in locking.levels(kind, ratio)], rtol=0.06
    )


def test_long_problems_are_problems():
    assert {one.name for one in PROBLEMS} >= LONG


def test_names_are_unique_and_every_problem_says_its_source():
    names = [one.name for one in PROBLEMS]
    assert len(set(names)) == len(names)
    assert all(one.title and one.source for one in PROBLEMS)
    assert choose(("rod", "patch")) == ("rod", "patch")
    assert choose(()) == known_names()


@pytest.mark.parametrize("file", FILES)
def test_files_have_the_problems_that_the_catalogue_names(file):
    own = importlib.import_module(f"fingerslip.verification.{file}").PROBLEMS
    assert tuple(one.name for one in own) == FILES[file]


def test_errors_are_held_against_what_is_allowed():
    assert relative("", 2.0, 2.02, 0.011).holds
    assert not relative("", -2.0, -2.03, 0.011).holds
    assert absolute("", 0.0, 1e-3, 1e-3).holds
    assert not absolute("", 0.0, float("nan"), 1e9).holds


def test_a_problem_without_checks_does_not_pass():
    assert not Outcome(Problem("empty", "", "", slow=False, compute=lambda: ()), ()).holds


def pushed(friction, programme, **changes):
    mesh = box("Q4", np.linspace(0.0, 1.0, 4), np.linspace(0.0, 1.0, 4))
    contact = fs.Contact(boundary="bottom", friction=fs.Coulomb(friction), **changes)
    return fs.Model(
        mesh=mesh,
        materials={"bulk": fs.Elastic(1e5, 0.0, 1.0)},
        formulation="plane_strain",
        supports={"top": ("x", "y"), "bulk": ("x",)},
        contacts=(contact,),
        programme=programme,
        time=fs.TimeStepping(0.1),
    )


def test_friction_that_never_acts_is_refused():
    """At nu = 0, with all nodes held along the plate, pressing alone brings no friction whatever mu is."""
    solve_problem(pushed(0.0, (fs.Press(0.01, 0.01),)))
    with pytest.raises(VerificationError, match="friction never acts"):
        solve_problem(pushed(0.5, (fs.Press(0.01, 0.01),)))


def test_deep_penetration_is_refused():
    model = pushed(0.0, (fs.Press(0.01, 0.01),), normal_penalty=1e4)
    with pytest.raises(VerificationError, match="inside the rigid body"):
        solve_problem(model, penetration=1e-4)


def test_lost_convergence_fails_the_problem():
    def fail():
        raise fs.ConvergenceError(0.5, 7, 1e-3, 1e-10, "try a smaller time step")

    outcome = run(Problem("lost", "Lost", "None", slow=False, compute=fail))
    assert not outcome.holds
    assert "0.5" in outcome.trouble
