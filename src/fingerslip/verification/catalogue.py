"""The problems of ``fingerslip verify``, by name and computed; the file of a problem is loaded when it is its turn.

The tests have more of them, in ``tests/problems/verification``.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from fingerslip.errors import InputError
from fingerslip.tables.table import Cell, Column, Table, to_markdown
from fingerslip.verification.problem import Check, Outcome, Problem, run

#: The names of all problems, by the file of this folder that has them, in the order of the table.
FILES: Mapping[str, tuple[str, ...]] = {
    "elements": ("patch", "rigid-modes", "convergence-2d", "convergence-3d", "locking-2d", "locking-3d"),
    "dynamics": ("hht-order", "hht-damping", "bar", "rod", "driven-plate"),
    "reduced": ("compiled-basis",),
    "blocks": ("dragged-block", "coulomb-oscillator", "sliding-block", "stick-slip"),
    "rolling": ("rolling-cylinder", "cylinder-on-incline", "ball-between-plates", "travelling-plate"),
    "viscoelastic": (
        "relaxation",
        "retardation",
        "complex-modulus",
        "viscous-vibration",
        "viscous-limits",
        "viscous-hertz",
    ),
    "line": ("hertz-line", "hertz-line-3d", "cattaneo", "ciavarella-jaeger"),
    "sphere": ("hertz-sphere", "mindlin", "tangential-cycle"),
    "holding": ("rigid-pads", "no-creep"),
    "large_bodies": ("rivlin-cube", "large-tube", "cook", "elastica"),
}


def known_names() -> tuple[str, ...]:
    """Return the names of all problems, in the order of the table."""
    return tuple(name for names in FILES.values() for name in names)


def problem(name: str) -> Problem:
    """Return a problem by its name, one of :func:`known_names`; its file is loaded."""
    file = next(file for file, names in FILES.items() if name in names)
    problems: Sequence[Problem] = importlib.import_module(f"fingerslip.verification.{file}").PROBLEMS
    return next(candidate for candidate in problems if candidate.name == name)


@dataclass(frozen=True)
class Verification:
    """The outcomes of verification problems."""

    outcomes: tuple[Outcome, ...]  # one for each problem

    @property
    def holds(self) -> bool:
        """Whether every check of every problem passed."""
        return all(outcome.holds for outcome in self.outcomes)

    @property
    def table(self) -> Table:
        """A row for each check."""

        def numbers(check: Check) -> tuple[Cell, ...]:
            mark = " abs" if check.kind == "absolute" else ""
            errors = (f"{check.error:.1e}{mark}", f"{check.allowed:.1e}{mark}")
            return (f"{check.expected:.6g}", f"{check.got:.6g}", *errors)

        return self._table(numbers)

    @property
    def numbers(self) -> Table:
        """The same for programs: numbers as numbers, and in a column of its own what kind an error is of."""

        def numbers(check: Check) -> tuple[Cell, ...]:
            return (*map(float, (check.expected, check.got, check.error, check.allowed)), check.kind)

        return self._table(numbers, "kind of error")

    @property
    def markdown(self) -> str:
        """The table in Markdown."""
        return f"{to_markdown(self.table)}\n{self.table.note}"

    def _table(self, numbers: Callable[[Check], tuple[Cell, ...]], *more: str) -> Table:
        """Return a table with a note that counts what passed and says what could not be computed."""
        names = ("problem", "quantity", "expected", "got", "error", "allowed", *more, "pass")
        rows = tuple(
            (outcome.problem.name, check.quantity, *numbers(check), check.holds)
            for outcome in self.outcomes
            for check in outcome.checks
        )
        troubles = [f" {outcome.problem.name}: {outcome.trouble}." for outcome in self.outcomes if outcome.trouble]
        passed = f"{sum(bool(row[-1]) for row in rows)} of {len(rows)} checks passed"
        note = f"{passed}. abs: absolute error, else relative.{''.join(troubles)}"
        return Table("Verification", tuple(map(Column, names)), rows, note)


def verify(only: Sequence[str], progress: Callable[[str], object]) -> Verification:
    """Compute verification problems by their names, all without any, and tell each before it begins.

    One that cannot be computed fails and does not stop the others.
    """
    names, outcomes = known_names(), []
    for name in only:
        if name not in names:
            raise InputError("--only", f"got '{name}'", f"may be one of {', '.join(names)}")
    chosen = only or names
    for number, problem_of_name in enumerate(map(problem, chosen), start=1):
        progress(f"{number} of {len(chosen)}: {problem_of_name.name}, {problem_of_name.title}")
        outcomes.append(run(problem_of_name))
    return Verification(tuple(outcomes))
