"""The problems of ``fingerslip verify``, by name and computed; the file of a problem is loaded when it is its turn.

The tests have more of them, in ``tests/problems/verification``.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from fingerslip.errors import InputError
from fingerslip.tables.table import Table, to_markdown
from fingerslip.verification.problem import Outcome, Problem, number_table, run, table

#: The names of all problems, by the file of this folder that has them, in the order of the table.
FILES: Mapping[str, tuple[str, ...]] = {
    "elements": ("patch", "rigid-modes", "convergence-2d", "convergence-3d", "locking-2d", "locking-3d"),
    "dynamics": ("hht-order", "hht-damping", "bar", "rod", "driven-plate"),
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


def choose(names: Sequence[str]) -> tuple[str, ...]:
    """Return names of problems as they are given, or those of all problems where there are none."""
    all_names = known_names()
    for name in names:
        if name not in all_names:
            raise InputError("--only", f"got '{name}'", f"may be one of {', '.join(all_names)}")
    return tuple(names) or all_names


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
        return table(self.outcomes)

    @property
    def numbers(self) -> Table:
        """The same for programs: numbers as numbers."""
        return number_table(self.outcomes)

    @property
    def markdown(self) -> str:
        """The table in Markdown."""
        return f"{to_markdown(self.table)}\n{self.table.note}"


def verify(only: Sequence[str], progress: Callable[[str], object]) -> Verification:
    """Compute verification problems by their names, all without any, and tell each before it begins.

    One that cannot be computed fails and does not stop the others.
    """
    chosen, outcomes = choose(only), []
    for number, problem_of_name in enumerate(map(problem, chosen), start=1):
        progress(f"{number} of {len(chosen)}: {problem_of_name.name}, {problem_of_name.title}")
        outcomes.append(run(problem_of_name))
    return Verification(tuple(outcomes))
