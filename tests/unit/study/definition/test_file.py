"""Study files as plain data: YAML 1.2, no key twice, errors with the line, and files that start from another one."""

import os
import sys

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError, InputErrors
from fingerslip.study.definition.file import line_numbers, read_mapping, read_with_base, write_mapping
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.definition.spec import read_study
from unit.study.block import block_values


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a: 1\nb: [1\n", r"line \d, column \d: found expected .*, needs 'key: value' lines"),
        (b"a: 1\na: 2\n", "line 2, column 1: found key 'a' twice, needs 'key: value' lines, each key once"),
        (b"t: {a: 1, a: 2}\n", "line 1, column 11: found key 'a' twice"),
        (b"? [a]\n: 1\n", "found a key that is not plain text"),
        (b"- 1\n- 2\n", "holds a list, needs 'key: value' lines"),
        (b"", "is empty, needs 'key: value' lines"),
        (b"a: !!python/object/apply:os.getcwd []\n", "line 1, column 4: found the tag !!python/object/apply:os.getcwd"),
        (b"\xff\xfe\x00", "is not text in UTF-8, needs a study file; save it as UTF-8"),
    ],
)
def test_what_is_no_study(tmp_path, content, message):
    (tmp_path / "x.yaml").write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_mapping(tmp_path / "x.yaml")


def test_what_cannot_be_read_and_a_name_that_is_not_utf_8_are_refused(tmp_path):
    (tmp_path / "x.yaml").write_text("time: {step: 1 ms}")
    names = {
        "": "is a folder",
        f"{'x' * 300}.yaml": "cannot be read",
        "gone.yaml": r"gone\.yaml: is not there, needs a study file; in that folder: .*x\.yaml",
    }
    if sys.platform == "linux":  # elsewhere names are Unicode
        bad = os.fsdecode(b"a\xff.yaml")
        (tmp_path / bad).write_text("time: {step: 1 ms}")
        names[bad] = r"'a\\udcff.yaml': is a name that is not UTF-8, needs a study file; rename the file"
    for name, message in names.items():
        with pytest.raises(InputError, match=message):
            read_mapping(tmp_path / name)


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
def test_what_is_written_reads_back(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("yaml") / "x.yaml"
    write_mapping(values, path, comment="a comment")
    assert read_mapping(path) == values


def test_keys_are_text_in_their_order_and_anchors_are_followed(tmp_path):
    write_mapping({"z": 1, "a": {"é": "1 µm"}}, tmp_path / "x.yaml", comment="how it was made")
    assert (tmp_path / "x.yaml").read_text(encoding="utf-8") == "# how it was made\nz: 1\na:\n  é: 1 µm\n"
    (tmp_path / "x.yaml").write_text("1: a\ntrue: b\n")
    assert read_mapping(tmp_path / "x.yaml") == {"1": "a", "true": "b"}
    # YAML 1.2 knows no merge keys: '<<' is a key like any other, which a study then does not know.
    (tmp_path / "x.yaml").write_text("a: &a {x: 1}\nb: *a\nc: {<<: *a}\n")
    assert read_mapping(tmp_path / "x.yaml") == {"a": {"x": 1}, "b": {"x": 1}, "c": {"<<": {"x": 1}}}


def test_mistakes_get_the_line_of_their_value_and_those_of_something_else_stay_as_they_are(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text("# a study\ntime:\n  step: 1\ndepth: x\n")
    places = ("depth", "time.step", "time.end", "mesh")
    mistakes = [InputError(f"{path}: {place}", "is wrong", "needs another") for place in places]
    with pytest.raises(InputErrors) as caught, line_numbers(path):
        raise InputErrors(mistakes)
    lines = [(error.where.removeprefix(f"{path}: "), error.line) for error in caught.value.all]
    assert lines == [("time.step", 3), ("time.end", 2), ("depth", 4), ("mesh", None)]
    error = InputError("preset x", "is wrong", "needs another")
    for path in (tmp_path / "gone.yaml", tmp_path / "x.yaml"):
        (tmp_path / "x.yaml").write_text("a: 1\n")
        with pytest.raises(InputError) as caught, line_numbers(path):
            raise error
        assert (caught.value.line, str(caught.value)) == (None, str(error))


def write(folder, name, values):
    path = folder / name
    path.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")
    return path


def test_what_is_not_written_comes_from_the_base_but_sweeps_and_lists_are_replaced(tmp_path):
    write(tmp_path, "block.yaml", block_values())
    changes = {"title": "Faster", "contact": {"friction_coefficient": 0.3}, "time": {"step": "1 ms"}}
    path = write(tmp_path, "fast.yaml", {"base": "block.yaml"} | changes)
    study = read_study(path)
    assert (study.title, study.time.step) == ("Faster", 1e-3)
    assert (study.all_contacts[0].boundary, study.all_contacts[0].friction_coefficient) == ("bottom", 0.3)
    assert study.programme == read_study(tmp_path / "block.yaml").programme
    assert "formulation" in read_runs(path).given
    press = [{"press": {"depth": "0.2 mm", "speed": "5 mm/s"}}]
    path = write(tmp_path, "own.yaml", {"base": "block.yaml", "sweep": {"time.step": ["1 ms"]}, "programme": press})
    assert read_with_base(path)["sweep"] == {"time.step": ["1 ms"]}
    assert read_with_base(path)["programme"] == press
    write(tmp_path, "a.yaml", {"x": 1, "group": {"one": 1, "two": 2}})
    write(tmp_path, "b.yaml", {"base": "a.yaml", "group": {"two": 3}})
    path = write(tmp_path, "c.yaml", {"base": "b.yaml", "y": 2})
    assert read_with_base(path) == {"x": 1, "group": {"one": 1, "two": 3}, "y": 2}, "a base may have a base"


@pytest.mark.parametrize(
    ("base", "message"),
    [
        ("", r"own\.yaml: base: got '', needs the name of a study file in the same"),
        ("nothing.yaml", r"nothing\.yaml: is not there, needs a study file"),
        ("../other/block.yaml", r"own\.yaml: base: got '\.\./other/block\.yaml', needs the name of a study file in"),
        (3, r"own\.yaml: base: got 3, needs the name"),
        ("own.yaml", r"own\.yaml: base: leads back to own\.yaml \(own\.yaml -> own\.yaml\)"),
    ],
)
def test_a_base_that_is_none_is_refused(tmp_path, base, message):
    with pytest.raises(InputError, match=message):
        read_study(write(tmp_path, "own.yaml", {"base": base}))


def test_a_long_ring_of_bases_is_one_line(tmp_path):
    for number in range(1200):
        (tmp_path / f"{number}.yaml").write_text(f"title: x\nbase: {(number + 1) % 1200}.yaml\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"1199.yaml: base: leads back to 0.yaml") as caught:
        read_with_base(tmp_path / "0.yaml")
    assert len(str(caught.value)) < 500
