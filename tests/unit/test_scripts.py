"""What the scripts of figures and benchmarks import is there: they run for long and rarely."""

import ast
import importlib

import pytest

from places import DOCS, ROOT

SCRIPTS = sorted([*(ROOT / "docs" / "figures").glob("*.py"), *(ROOT / "tests" / "benchmarks").glob("*.py")])


def imported(path):
    """Return the modules of fingerslip that a script imports from, each with the name that it wants."""
    nodes = [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.ImportFrom)]
    found = {(str(node.module), alias.name) for node in nodes for alias in node.names}
    return {(module, name) for module, name in found if module.split(".")[0] == "fingerslip"}


def is_there(module, name):
    """Tell whether a module has a name, or a package a module of that name."""
    if hasattr(importlib.import_module(module), name):
        return True
    try:
        importlib.import_module(f"{module}.{name}")
    except ModuleNotFoundError:
        return False
    return True


def test_there_are_scripts():
    assert sum(bool(imported(path)) for path in SCRIPTS) > 10


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_what_a_script_imports_is_there(path):
    assert not {f"{module}.{name}" for module, name in imported(path) if not is_there(module, name)}


def test_figures_of_the_documentation_are_small():
    large = {path.name: path.stat().st_size for path in (DOCS / "figures").glob("*") if path.stat().st_size > 150_000}
    assert large == {}, "run docs/figures/shrink.py"


def test_pages_are_short_enough_to_be_read():
    words = {
        path.name: len(path.read_text(encoding="utf-8").split()) for path in [ROOT / "README.md", *DOCS.rglob("*.md")]
    }
    assert words.pop("README.md") <= 1200
    assert max(words.values()) <= 2500
