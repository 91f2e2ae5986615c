"""The package's face: public names load where they are first used and say what they are; the module is the command."""

import ast
import dataclasses
import importlib
import inspect
import re
import runpy
import subprocess
import sys
import tomllib
from importlib import import_module, metadata
from importlib.metadata import version
from pathlib import Path

import pytest
import yaml

import fingerslip as fs
from fingerslip.commands.app import app
from places import DOCS, ROOT


def test_unknown_public_name_is_refused_with_the_nearest():
    with pytest.raises(AttributeError, match=r"^module 'fingerslip' has no attribute 'Modle'$") as caught:
        fs.Modle  # noqa: B018
    assert (caught.value.name, caught.value.obj) == ("Modle", fs)
    done = subprocess.run(
        [sys.executable, "-c", "import fingerslip as fs; fs.Modle"], capture_output=True, text=True, check=False
    )
    assert done.stderr.splitlines()[-1].endswith("Did you mean: 'Model'?")


def test_one_list_names_each_thing_where_it_is_for_programs_and_type_checkers():
    tree = ast.parse(Path(fs.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    listed = {alias.name: (node.module, alias.asname) for node in tree.body for alias in node.names}
    assert set(listed) == set(fs.__all__)
    for name, (home, shown) in listed.items():
        assert shown == name, "without 'as' a type checker does not take it for public"
        loaded = importlib.import_module(f"fingerslip.{home}")
        assert getattr(fs, name) is getattr(loaded, name)
        if name != "__version__":
            assert getattr(fs, name).__module__.startswith(f"fingerslip.{home.split('.')[0]}")


PUBLIC = [name for name in fs.__all__ if not name.startswith("__")]


def sections(text):
    """Return the sections of a docstring by heading, each underlined as numpydoc wants it."""
    parts = re.split(r"^([A-Z][a-z]+(?: [A-Z][a-z]+)?)\n-+\n", text, flags=re.MULTILINE)
    for heading, rule in re.findall(r"^([A-Z][a-z]+(?: [A-Z][a-z]+)?)\n(-+)\n", text, flags=re.MULTILINE):
        assert len(heading) == len(rule), f"{heading} is underlined by {len(rule)} dashes"
    return {"": parts[0]} | dict(zip(parts[1::2], parts[2::2], strict=True))


def entries(section):
    """Yield name and explanation of every parameter of a section."""
    for names, text in re.findall(r"^(\w[\w, ]*) : [^\n]+\n((?:    [^\n]*\n?|\n)*)", section, flags=re.MULTILINE):
        for name in names.split(","):
            yield name.strip(), text.strip()


def parameters_of(thing):
    """Return what a caller may pass."""
    if dataclasses.is_dataclass(thing):
        return [field.name for field in dataclasses.fields(thing)]
    if inspect.isclass(thing):
        own = vars(thing).get("__init__")
        return [name for name in inspect.signature(own).parameters if name != "self"] if own else []
    return list(inspect.signature(thing).parameters)


def mistakes(name):
    """Yield what the docstring of a public name lacks."""
    thing = getattr(fs, name)
    text = inspect.getdoc(thing) or ""
    if not thing.__doc__:
        yield "has no docstring of its own, perhaps that of a base"
    found = sections(text)
    summary = found[""].split("\n\n")[0]
    if not re.fullmatch(r"[A-Z][^\n]*\.", summary):
        yield "one line with a capital and a full stop does not say what it is"
    described = dict(entries(found.get("Parameters", "")))
    if set(described) != set(parameters_of(thing)):
        yield f"its parameters are {parameters_of(thing)}, not {list(described)}"
    for parameter, explanation in described.items():
        if not explanation.endswith((".", "`.")):
            yield f"{parameter} is not explained in a sentence"
    if not inspect.isfunction(thing):
        return
    returns = found.get("Returns", "").strip()
    if inspect.signature(thing).return_annotation == "None" and "Returns" in found:
        yield "returns nothing, and says what"
    elif inspect.signature(thing).return_annotation != "None" and not (returns or text.startswith("Return ")):
        yield "does not say what it returns"


def test_public_names_have_docstrings_with_a_summary_all_parameters_and_what_is_returned():
    assert {name: found for name in PUBLIC if (found := list(mistakes(name)))} == {}


def test_the_reference_has_every_public_name_once_and_nothing_else():
    pages = "".join(path.read_text(encoding="utf-8") for path in (DOCS / "api").glob("*.md"))
    lists = re.findall(r":toctree: generated\n\n((?:   \w+\n)+)", pages)
    assert sorted("".join(lists).split()) == sorted(PUBLIC)
    assert not re.search(r"\bauto(module|class|function)::", pages)


def test_the_version_stands_in_one_place_and_the_file_to_cite_from_agrees():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= citation.keys(), "what GitHub needs"
    assert (citation["version"], citation["license"]) == (project["version"], project["license"])
    assert set(citation["keywords"]) == set(project["keywords"])
    texts = {path: path.read_text(encoding="utf-8") for path in Path(fs.__file__).parent.rglob("*.py")}
    assert [path.name for path, text in texts.items() if project["version"] in text] == []


def test_usage_names_the_command_and_not_the_file(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["/somewhere/__main__.py", "run", "--help"])
    with pytest.raises(SystemExit) as end:
        runpy.run_module("fingerslip", run_name="__main__")
    assert end.value.code == 0
    assert "Usage: fingerslip run" in capsys.readouterr().out


def test_module_runs_as_the_command_of_the_installed_version_and_importing_it_runs_nothing(capsys):
    done = subprocess.run([sys.executable, "-m", "fingerslip", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"fingerslip {version('fingerslip')}\n"
    assert import_module("fingerslip.__main__").app is app
    assert capsys.readouterr() == ("", "")
    assert fs.__version__ == metadata.version("fingerslip")
    assert re.match(r"\d+\.\d+", fs.__version__)
