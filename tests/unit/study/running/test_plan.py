"""What running a study would do: all mistakes of all files are told before anything runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fingerslip.errors import InputError
from fingerslip.study.running.plan import plan_studies, plan_study
from unit.study.block import FRICTIONS, block_values, changed

Write = Callable[..., Path]


def test_plan_names_folder_and_runs_and_nothing_is_finished(write_study: Write, tmp_path: Path) -> None:
    plan = plan_study(write_study(), tmp_path / "results")
    assert plan.folder == tmp_path / "results" / "block"
    assert [run.name for run in plan.runs] == [f"friction_coefficient-{friction}" for friction in FRICTIONS]
    assert len(set(plan.identities.values())) == 3
    assert plan.finished_runs() == {}


def test_studies_of_one_name_are_refused(write_study: Write) -> None:
    path = write_study()
    with pytest.raises(InputError, match="needs a name of its own"):
        plan_studies([path, path], results_dir=path.parent / "results")


def test_unknown_published_table_is_refused(write_study: Write) -> None:
    path = write_study(block_values() | {"compare": ["wang2014-table3"]})
    with pytest.raises(InputError, match=r"block\.yaml: compare\.0: .*did you mean 'wang2014-table2'\?"):
        plan_study(path)


def test_mistakes_of_several_files_come_together(write_study: Write, tmp_path: Path) -> None:
    values = block_values() | {"depth": 1, "sweep": {"time.end": [3], "time.stp": ["1 s"]}}
    bad, good = write_study(values, name="bad"), write_study()
    swept = write_study(changed("contact.boundary", 7), name="other")
    with pytest.raises(InputError) as caught:
        plan_studies([bad, good, swept, tmp_path / "gone.yaml"])
    assert [error.where.removeprefix(f"{tmp_path}/") for error in caught.value.all] == [
        *("bad.yaml: depth", "bad.yaml: sweep.time.end.0", "bad.yaml: sweep.time.stp"),
        "other.yaml: contact.boundary",
        "gone.yaml",
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("overall_slip * nothing", "'nothing' is not known"),
        ("overall_slip + depth", "needs units that fit together"),
        # The first run has a plane, which has no radius.
        ("counterface.cylinder.radius / '1 mm'", "'counterface.cylinder.radius' is not known"),
    ],
)
def test_derived_quantities_of_all_runs_are_checked_before_anything_runs(
    write_study: Write, text: str, said: str
) -> None:
    counterfaces = [{"plane": {"normal": [0, 1]}}, {"cylinder": {"radius": "8 mm"}}]
    contact = {"boundary": "contact", "counterface": counterfaces[0], "friction_coefficient": 0.5}
    values = {key: own for key, own in block_values().items() if key != "contact"} | {"contacts": [contact]}
    values |= {"sweep": {"contacts.0.counterface": counterfaces}, "derived": {"x": text}}
    with pytest.raises(InputError, match=r"block\.yaml: derived\.x") as caught:
        plan_study(write_study(values))
    assert said in str(caught.value)


def test_a_derived_quantity_has_one_unit_in_all_runs(write_study: Write) -> None:
    values = block_values() | {"sweep": {"contact.friction_coefficient": [0.5, 1.0]}}
    values |= {"derived": {"x": "depth ** friction_coefficient"}}
    with pytest.raises(InputError, match=r"derived\.x.*needs one unit in all runs"):
        plan_study(write_study(values))
