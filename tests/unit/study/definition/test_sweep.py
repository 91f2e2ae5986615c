"""Sweeps: all combinations in order, each with its values and a folder name of its own."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from fingerslip.errors import InputError
from fingerslip.mesh.source import MeshFile
from fingerslip.study.definition import sweep
from fingerslip.study.definition.runs import expand, expand_mapping
from fingerslip.study.definition.spec import parse_study
from unit.study.block import block_values

SOURCE = Path("studies/x.yaml")


def runs_of(swept: dict[str, Any], values: dict[str, Any] | None = None) -> tuple[sweep.Run, ...]:
    return expand(parse_study((values or block_values()) | {"sweep": swept}, SOURCE), SOURCE)


def finger() -> dict[str, Any]:
    return {
        "fingertip": {"preset": "wang2014-2d"},
        "contact": {"friction_coefficient": 0.6},
        "programme": [{"press": {"depth": "1.5 mm", "speed": "1.5 mm/s"}}],
        "time": {"step": "5 ms"},
    }


def test_first_path_varies_slowest() -> None:
    runs = runs_of(
        {"fingertip.phalanx.variant": ["original", "scaled"], "contact.friction_coefficient": [0.2, 0.6]}, finger()
    )
    assert [run.name for run in runs] == [
        "variant-original_friction_coefficient-0.2",
        "variant-original_friction_coefficient-0.6",
        "variant-scaled_friction_coefficient-0.2",
        "variant-scaled_friction_coefficient-0.6",
    ]
    assert [run.study.contact.friction_coefficient for run in runs if run.study.contact] == [0.2, 0.6, 0.2, 0.6]
    assert [run.specimen.phalanx.variant for run in runs if run.specimen] == ["original"] * 2 + ["scaled"] * 2


def test_study_without_sweep_is_one_run() -> None:
    (run,) = runs_of({})
    assert (run.name, dict(run.swept), run.where) == ("run", {}, "studies/x.yaml")


def test_values_inside_lists_can_be_swept() -> None:
    runs = runs_of({"programme.0.press.depth": ["0.1 mm", "0.2 mm"]})
    assert [run.study.programme[0].depth for run in runs] == [1e-4, 2e-4]
    assert [run.name for run in runs] == ["depth-0.1mm", "depth-0.2mm"]


def test_optional_values_that_are_not_in_the_file_can_be_swept() -> None:
    runs = runs_of({"contact.normal_penalty": ["1e9 Pa/m", "1e10 Pa/m"]})
    assert [run.study.contact.normal_penalty for run in runs if run.study.contact] == [1e9, 1e10]


def test_swept_mesh_file_is_relative_to_the_study() -> None:
    runs = runs_of({"mesh.file": ["coarse.msh", "fine.msh"]})
    folder = SOURCE.parent.resolve()
    assert [run.study.mesh for run in runs] == [MeshFile(str(folder / f"{n}.msh")) for n in ("coarse", "fine")]


def test_switches_are_named_after_what_they_switch() -> None:
    runs = runs_of({"fingertip.fingerprint.enabled": [False, True]}, finger())
    assert [run.name for run in runs] == ["fingerprint-false", "fingerprint-true"]


def test_paths_with_one_last_name_are_told_apart() -> None:
    swept = {"programme.0.press.speed": ["1 mm/s"], "programme.1.slide.speed": ["2 mm/s"]}
    (run,) = runs_of(swept)
    assert run.name == "programme-0-press-speed-1mm-per-s_programme-1-slide-speed-2mm-per-s"


@pytest.mark.parametrize(
    ("path", "repair"),
    [
        ("contact.coefficient", "did you mean 'contact.friction_coefficient'?"),
        ("phalanx.variant", "did you mean 'fingertip.phalanx.variant'?"),
        ("fingertip.phalanx.varient", "did you mean 'fingertip.phalanx.variant'?"),
        ("time.stp", "did you mean 'time.step'?"),
        ("programme.7.press.depth", "did you mean 'programme.0.press.depth'?"),
        ("qqq", "fingerslip show STUDY lists all paths"),
    ],
)
def test_unknown_path_is_refused_with_the_nearest(path: str, repair: str) -> None:
    with pytest.raises(InputError) as caught:
        runs_of({path: [1]}, finger())
    assert caught.value.where == f"studies/x.yaml: sweep.{path}"
    assert caught.value.repair == repair


@pytest.mark.parametrize("path", ["title", "sweep", "compare"])
def test_what_is_no_value_of_the_model_cannot_be_swept(path: str) -> None:
    with pytest.raises(InputError, match="is not known"):
        runs_of({path: ["a"]})


def test_every_swept_value_is_checked() -> None:
    with pytest.raises(InputError) as caught:
        runs_of({"contact.friction_coefficient": [0.2, -0.4]})
    expected = "studies/x.yaml: sweep.contact.friction_coefficient.1: got -0.4, needs a number >= 0"
    assert str(caught.value) == expected


def test_runs_of_a_study_made_in_python_are_checked_too() -> None:
    study = dataclasses.replace(parse_study(block_values(), SOURCE), sweep={"tme.step": (1,), "time.step": ("1 mm",)})
    with pytest.raises(InputError) as caught:
        expand(study, SOURCE)
    assert [error.where for error in caught.value.all] == [
        "studies/x.yaml: sweep.tme.step",
        "studies/x.yaml: sweep.time.step.0",
    ]


def test_resolved_run_has_every_value_of_the_fingertip() -> None:
    (run,) = runs_of({"fingertip.phalanx.variant": ["scaled"]}, finger())
    resolved = run.plain_values()
    assert resolved["fingertip"]["phalanx"]["variant"] == "scaled"
    assert resolved["fingertip"]["layers"]["skin_thickness"] == "0.0015 m"
    assert "sweep" not in resolved
    (again,) = expand(parse_study(resolved, SOURCE), SOURCE)
    assert again.specimen == run.specimen


def sampled(**sample: Any) -> dict[str, Any]:
    ranges = {"fingertip.sagittal.half_height": ["6 mm", "7 mm"]}
    return finger() | {"sample": {"count": 12, "ranges": ranges} | sample}


def test_every_combination_is_run_with_every_sample() -> None:
    values = sampled() | {"sweep": {"fingertip.phalanx.variant": ["original", "scaled"]}}
    runs = expand(parse_study(values, SOURCE), SOURCE)
    assert len(runs) == 24
    assert [runs[0].name, runs[-1].name] == ["variant-original_sample-01", "variant-scaled_sample-12"]
    assert runs[12].swept == {"fingertip.phalanx.variant": "scaled", "sample": 1}
    assert runs[0].sampled == runs[12].sampled
    height = float(str(runs[0].sampled["fingertip.sagittal.half_height"]).split()[0])
    assert runs[0].specimen.sagittal.half_height == pytest.approx(1e-3 * height)  # type: ignore[union-attr]
    assert runs[0].where == "studies/x.yaml (fingertip.phalanx.variant = original, sample = 1)"


def test_a_sampled_run_is_a_study_file_of_its_own() -> None:
    run = expand(parse_study(sampled(), SOURCE), SOURCE)[3]
    assert "sample" not in run.plain_values()
    (again,) = expand(parse_study(run.plain_values(), SOURCE), SOURCE)
    assert again.specimen == run.specimen


def test_equal_values_change_together() -> None:
    equal = {"fingertip.transverse.half_height": "fingertip.sagittal.half_height"}
    for run in expand(parse_study(sampled(equal=equal), SOURCE), SOURCE):
        assert run.specimen is not None
        assert run.specimen.transverse.half_height == run.specimen.sagittal.half_height  # type: ignore[attr-defined]


def test_samples_that_do_not_fit_together_are_refused_and_the_others_stay() -> None:
    """Each of the ends is right on its own, but a thin skin has no room for a thick epidermis."""
    ranges = {
        "fingertip.layers.skin_thickness": ["0.7 mm", "2 mm"],
        "fingertip.layers.epidermis_thickness": ["0.3 mm", "1.2 mm"],
    }
    expansion = expand_mapping(sampled(ranges=ranges), SOURCE)
    assert len(expansion.runs) + len(expansion.refused) == 12
    assert expansion.refused
    for one in expansion.refused:
        thickness = {path: float(str(value).split()[0]) for path, value in one.sampled.items()}
        skin, epidermis = thickness.values()
        assert epidermis >= skin or "skin" in one.reason
        assert one.name == f"sample-{one.swept['sample']:02}"
    assert "fingertip.layers.epidermis_thickness: got " in expansion.refused[0].reason
