"""Computing verification problems one after another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fingerslip.tables.table import Table, to_markdown
from fingerslip.verification.catalogue import choose, problem
from fingerslip.verification.problem import Outcome, number_table, run, table


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
