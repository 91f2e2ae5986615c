"""YAML in and out: the scalars of YAML 1.2, no key twice, errors with the line."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError, InputErrors
from fingerslip.study.definition.file import line_numbers, read_mapping, write_mapping


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: [1\n", r"line \d, column \d: found expected .*, needs 'key: value' lines"),
        ("a: 1\na: 2\n", "line 2, column 1: found key 'a' twice, needs 'key: value' lines, each key once"),
        ("t: {a: 1, a: 2}\n", "line 1, column 11: found key 'a' twice"),
        ("? [a]\n: 1\n", "found a key that is not plain text"),
        ("- 1\n- 2\n", "holds a list, needs 'key: value' lines"),
        ("", "is empty, needs 'key: value' lines"),
        ("a: !!python/object/apply:os.getcwd []\n", "line 1, column 4: found the tag !!python/object/apply:os.getcwd"),
    ],
)
def test_text_that_is_no_study(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_mapping(path)


def test_missing_file_names_the_others(tmp_path: Path) -> None:
    (tmp_path / "there.yaml").write_text("")
    with pytest.raises(
        InputError, match=r"gone\.yaml: is not there, needs a study file; in that folder: .*there\.yaml"
    ):
        read_mapping(tmp_path / "gone.yaml")


def test_folder_and_binary_file_are_no_studies(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_bytes(b"\xff\xfe\x00")
    long = tmp_path / f"{'x' * 300}.yaml"
    for path, message in (
        (tmp_path, "is a folder"),
        (tmp_path / "x.yaml", "is not text in UTF-8, needs a study file; save it as UTF-8"),
        (long, "cannot be read"),
    ):
        with pytest.raises(InputError, match=message):
            read_mapping(path)


@pytest.mark.skipif(sys.platform != "linux", reason="names are Unicode there")
def test_a_name_that_is_not_utf_8_is_refused_before_results_are_written_under_it(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"a\xff.yaml")
    path.write_text("time: {step: 1 ms}")
    with pytest.raises(
        InputError, match=r"'a\\udcff.yaml': is a name that is not UTF-8, needs a study file; rename the file"
    ):
        read_mapping(path)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("no", "no"),
        ("on", "on"),
        ("true", True),
        ("1e-3", 1e-3),
        ("010", 10),
        ("1:30", "1:30"),
        ("~", None),
        ("-.5", -0.5),
    ],
)
def test_scalars_are_those_of_yaml_1_2(tmp_path: Path, text: str, value: object) -> None:
    (tmp_path / "x.yaml").write_text(f"a: {text}\n")
    assert read_mapping(tmp_path / "x.yaml") == {"a": value}


plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-1000, 1000)
    | st.floats(allow_nan=False)
    | st.sampled_from(["no", "1.5 mm", "a b"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("abc"), inner, max_size=3),
    max_leaves=8,
)


@given(values=st.dictionaries(st.sampled_from(["x", "y", "on"]), plain, min_size=1))
def test_what_is_written_reads_back(tmp_path_factory: pytest.TempPathFactory, values: dict[str, Any]) -> None:
    path = tmp_path_factory.mktemp("yaml") / "x.yaml"
    write_mapping(values, path, comment="a comment")
    assert read_mapping(path) == values


def test_keys_keep_their_order_below_the_comment(tmp_path: Path) -> None:
    write_mapping({"z": 1, "a": {"é": "1 µm"}}, tmp_path / "x.yaml", comment="how it was made")
    assert (tmp_path / "x.yaml").read_text(encoding="utf-8") == "# how it was made\nz: 1\na:\n  é: 1 µm\n"


def test_keys_are_text_whatever_they_look_like(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text("1: a\ntrue: b\n")
    assert read_mapping(tmp_path / "x.yaml") == {"1": "a", "true": "b"}


def test_anchors_are_followed_and_nothing_is_merged(tmp_path: Path) -> None:
    """YAML 1.2 knows no merge keys: '<<' is a key like any other, which a study then does not know."""
    (tmp_path / "x.yaml").write_text("a: &a {x: 1}\nb: *a\nc: {<<: *a}\n")
    assert read_mapping(tmp_path / "x.yaml") == {"a": {"x": 1}, "b": {"x": 1}, "c": {"<<": {"x": 1}}}


def test_mistakes_get_the_line_of_their_value_or_of_its_group(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_text("# a study\ntime:\n  step: 1\ndepth: x\n")
    places = ("depth", "time.step", "time.end", "mesh")
    mistakes = [InputError(f"{path}: {place}", "is wrong", "needs another") for place in places]
    with pytest.raises(InputErrors) as caught, line_numbers(path):
        raise InputErrors(mistakes)
    assert [(error.where.removeprefix(f"{path}: "), error.line) for error in caught.value.all] == [
        ("time.step", 3),
        ("time.end", 2),
        ("depth", 4),
        ("mesh", None),
    ]


def test_mistakes_of_something_else_stay_as_they_are(tmp_path: Path) -> None:
    error = InputError("preset x", "is wrong", "needs another")
    for path in (tmp_path / "gone.yaml", tmp_path / "x.yaml"):
        (tmp_path / "x.yaml").write_text("a: 1\n")
        with pytest.raises(InputError) as caught, line_numbers(path):
            raise error
        assert (caught.value.line, str(caught.value)) == (None, str(error))
