"""Errors say where, what was found, what is allowed and how to repair it; they survive the way between processes."""

import pickle

import pytest

from fingerslip.errors import (
    ConvergenceError,
    FingerslipError,
    InputError,
    InputErrors,
    MeshError,
    Mistakes,
    ResultError,
    SlipOutsideContactError,
    TruncatedVideoError,
)

CASES = [
    InputError("x.yaml: time.step", "got 0 s", "needs a value > 0", "write 5 ms"),
    MeshError("mesh", "boundary 'pulp' not in mesh", "it has: skin"),
    SlipOutsideContactError("contact", "a", "b", "c"),
    ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step"),
    ResultError("x: cannot be written"),
    InputError("x.yaml: depth", "got 1 s", "needs a unit of [m]", line=7),
    TruncatedVideoError("slide.avi", 30, 60),
    ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step", "contact", (1e-3, 2e-3)),
]


TEXTS = [
    "x.yaml: time.step: got 0 s, needs a value > 0; write 5 ms",
    "mesh: boundary 'pulp' not in mesh, it has: skin",
    "contact: a, b; c",
    "contact at t = 0.5 s, node 7: residual 1.00e-03, needs <= 1e-09; use a smaller step",
    "x: cannot be written",
    "x.yaml: depth: got 1 s, needs a unit of [m] (line 7)",
    "slide.avi: ends after 30 of 60 frames; copy or record it again",
    "contact at t = 0.5 s, node 7 at (1, 2) mm: residual 1.00e-03, needs <= 1e-09; use a smaller step",
]


@pytest.mark.parametrize(("error", "text"), [*zip(CASES, TEXTS, strict=True)], ids=lambda case: type(case).__name__)
def test_errors_are_one_line_of_four_parts_come_back_from_worker_processes_and_have_one_base(error, text):
    assert str(error) == text
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is type(error)
    assert (str(copy), vars(copy)) == (str(error), vars(error))
    assert isinstance(error, FingerslipError)
    assert isinstance(error, ValueError) == isinstance(error, InputError)


def test_several_mistakes_are_several_lines_and_have_the_parts_of_the_first():
    first, second = CASES[0], CASES[1]
    several = Mistakes([first, second, first]).error()
    assert isinstance(several, InputErrors)
    assert several.all == (first, second)
    assert str(several).splitlines() == [str(first), str(second)]
    assert (several.where, several.found, several.allowed, several.repair) == first.args[:4]
    copy = pickle.loads(pickle.dumps(several))
    assert (type(copy), str(copy)) == (InputErrors, str(several))


def test_one_mistake_stays_itself_and_other_errors_are_not_collected():
    mistakes = Mistakes()
    mistakes.raise_all()
    with mistakes.collect():
        raise CASES[1]
    with pytest.raises(MeshError) as caught:
        mistakes.raise_all()
    assert caught.value is CASES[1]
    assert caught.value.all == (CASES[1],)
    with pytest.raises(ResultError), mistakes.collect():
        raise CASES[4]


def test_moved_mistakes_keep_their_kind_and_other_parts():
    moved = CASES[1].moved(lambda where: f"x.yaml: {where}", 3)
    assert (type(moved), str(moved)) == (MeshError, "x.yaml: mesh: boundary 'pulp' not in mesh, it has: skin (line 3)")
    several = InputErrors(CASES[:2]).moved(lambda where: where.upper())
    assert [error.where for error in several.all] == ["X.YAML: TIME.STEP", "MESH"]
