"""The package's face: every public name loads where it is first used, and says what it is."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import fingerslip as fs

HEAVY = ("numpy", "pydantic", "pint", "xarray", "skfem", "gmsh", "meshio", "numba", "matplotlib", "pyvista", "scipy")


@pytest.mark.parametrize(
    "code",
    ["import fingerslip", "import fingerslip.commands.app", "from fingerslip.commands.app import app; _help(app)"],
)
def test_heavy_modules_are_not_loaded_until_needed(code: str) -> None:
    script = f"""
import sys
def _help(app):
    try:
        app(["--help"])
    except SystemExit as end:
        assert end.code == 0
{code}
print("LOADED", *sorted(set({HEAVY!r}) & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "LOADED"


def test_every_public_name_can_be_loaded() -> None:
    assert len(set(fs.__all__)) == len(fs.__all__)
    for name in fs.__all__:
        assert getattr(fs, name) is not None
    assert set(dir(fs)) == set(fs.__all__)


def test_unknown_public_name_is_refused_with_the_nearest() -> None:
    with pytest.raises(AttributeError, match=r"^module 'fingerslip' has no attribute 'Modle'$") as caught:
        fs.Modle  # noqa: B018
    assert (caught.value.name, caught.value.obj) == ("Modle", fs)
    done = subprocess.run(
        [sys.executable, "-c", "import fingerslip as fs; fs.Modle"], capture_output=True, text=True, check=False
    )
    assert done.stderr.splitlines()[-1].endswith("Did you mean: 'Model'?")


def test_one_list_names_each_thing_where_it_is_for_programs_and_type_checkers() -> None:
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


def sections(text: str) -> dict[str, str]:
    """Return the sections of a docstring by heading, each underlined as numpydoc wants it."""
    parts = re.split(r"^([A-Z][a-z]+(?: [A-Z][a-z]+)?)\n-+\n", text, flags=re.MULTILINE)
    for heading, rule in re.findall(r"^([A-Z][a-z]+(?: [A-Z][a-z]+)?)\n(-+)\n", text, flags=re.MULTILINE):
        assert len(heading) == len(rule), f"{heading} is underlined by {len(rule)} dashes"
    return {"": parts[0]} | dict(zip(parts[1::2], parts[2::2], strict=True))


def entries(section: str) -> Iterator[tuple[str, str]]:
    """Yield name and explanation of every parameter of a section."""
    for names, text in re.findall(r"^(\w[\w, ]*) : [^\n]+\n((?:    [^\n]*\n?|\n)*)", section, flags=re.MULTILINE):
        for name in names.split(","):
            yield name.strip(), text.strip()


def parameters_of(thing: object) -> list[str]:
    """Return what a caller may pass."""
    if dataclasses.is_dataclass(thing):
        return [field.name for field in dataclasses.fields(thing)]
    if inspect.isclass(thing):
        own = vars(thing).get("__init__")
        return [name for name in inspect.signature(own).parameters if name != "self"] if own else []
    return list(inspect.signature(thing).parameters)


@pytest.mark.parametrize("name", PUBLIC)
def test_public_name_has_a_docstring_with_a_summary_and_all_parameters(name: str) -> None:
    thing = getattr(fs, name)
    text = inspect.getdoc(thing)
    assert text
    assert thing.__doc__, "a docstring of its own, not that of a base"
    found = sections(text)
    summary = found[""].split("\n\n")[0]
    assert summary[0].isupper()
    assert summary.endswith(".")
    assert "\n" not in summary, "one line says what it is"
    described = dict(entries(found.get("Parameters", "")))
    assert set(described) == set(parameters_of(thing))
    for parameter, explanation in described.items():
        assert explanation.endswith((".", "`.")), f"{parameter} is not explained in a sentence"


@pytest.mark.parametrize("name", [name for name in PUBLIC if inspect.isfunction(getattr(fs, name))])
def test_public_function_says_what_it_returns(name: str) -> None:
    function = getattr(fs, name)
    text = inspect.getdoc(function) or ""
    if inspect.signature(function).return_annotation == "None":
        assert "Returns" not in sections(text)
    else:
        assert text.startswith("Return ") or sections(text).get("Returns", "").strip()
