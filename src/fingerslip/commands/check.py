"""``fingerslip check``: whether studies can be run, and what they cost."""

from __future__ import annotations

from pathlib import Path

from fingerslip.commands.shared import AsJson, Results, Studies, print_tables


def check(studies: Studies, results: Results = Path("results"), as_json: AsJson = False) -> None:
    """Check studies without computing them: the runs, their size and about how long they take."""
    from fingerslip.study.definition.runs import plan_each

    plans, mistakes = plan_each(studies, results)
    # What builds meshes and models is slow to load: mistakes in the files are said before.
    from fingerslip.study.inspection.check import check_plans, fold_samples

    table = check_plans(plans, mistakes)
    print_tables([table if as_json else fold_samples(table)], as_json)
    mistakes.raise_all()
