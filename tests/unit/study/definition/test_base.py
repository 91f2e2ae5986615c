"""Study files that start from another one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from fingerslip.errors import InputError
from fingerslip.study.definition.file import read_with_base
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.definition.spec import read_study
from unit.study.block import block_values


def write(folder: Path, name: str, values: dict[str, Any]) -> Path:
    path = folder / name
    path.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")
    return path


def test_what_is_not_written_comes_from_the_base(tmp_path: Path) -> None:
    write(tmp_path, "block.yaml", block_values())
    changes = {
        "base": "block.yaml",
        "title": "Faster",
        "contact": {"friction_coefficient": 0.3},
        "time": {"step": "1 ms"},
    }
    path = write(tmp_path, "fast.yaml", changes)
    study = read_study(path)
    assert (study.title, study.time.step) == ("Faster", 1e-3)
    assert (study.all_contacts[0].boundary, study.all_contacts[0].friction_coefficient) == ("bottom", 0.3)
    assert study.programme == read_study(tmp_path / "block.yaml").programme
    assert "formulation" in read_runs(path).given


def test_sweeps_and_lists_replace_those_of_the_base(tmp_path: Path) -> None:
    write(tmp_path, "block.yaml", block_values())
    press = [{"press": {"depth": "0.2 mm", "speed": "5 mm/s"}}]
    path = write(tmp_path, "own.yaml", {"base": "block.yaml", "sweep": {"time.step": ["1 ms"]}, "programme": press})
    assert read_with_base(path)["sweep"] == {"time.step": ["1 ms"]}
    assert read_with_base(path)["programme"] == press


def test_a_base_may_have_a_base(tmp_path: Path) -> None:
    write(tmp_path, "a.yaml", {"x": 1, "group": {"one": 1, "two": 2}})
    write(tmp_path, "b.yaml", {"base": "a.yaml", "group": {"two": 3}})
    assert read_with_base(write(tmp_path, "c.yaml", {"base": "b.yaml", "y": 2})) == {
        "x": 1,
        "group": {"one": 1, "two": 3},
        "y": 2,
    }


@pytest.mark.parametrize(
    ("base", "message"),
    [
        ("", r"own\.yaml: base: got '', needs the name of a study file in the same"),
        ("nothing.yaml", r"nothing\.yaml: is not there, needs a study file"),
        (
            "../other/block.yaml",
            r"own\.yaml: base: got '\.\./other/block\.yaml', needs the name of a study file in the same",
        ),
        (3, r"own\.yaml: base: got 3, needs the name"),
        ("own.yaml", r"own\.yaml: base: leads back to own\.yaml \(own\.yaml -> own\.yaml\)"),
    ],
)
def test_a_base_that_is_none_is_refused(tmp_path: Path, base: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_study(write(tmp_path, "own.yaml", {"base": base}))


def test_files_that_are_each_others_base_are_refused(tmp_path: Path) -> None:
    first, _ = (write(tmp_path, f"{own}.yaml", {"base": f"{other}.yaml"}) for own, other in ("ab", "ba"))
    with pytest.raises(InputError, match=r"leads back to a\.yaml \(a\.yaml -> b\.yaml -> a\.yaml\)"):
        read_study(first)


def test_a_long_ring_of_bases_is_one_line(tmp_path: Path) -> None:
    for number in range(1200):
        (tmp_path / f"{number}.yaml").write_text(f"title: x\nbase: {(number + 1) % 1200}.yaml\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"1199.yaml: base: leads back to 0.yaml") as caught:
        read_with_base(tmp_path / "0.yaml")
    assert len(str(caught.value)) < 500
