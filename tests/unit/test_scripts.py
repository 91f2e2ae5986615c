"""What scripts, docs and studies name is there: modules, citations, pages and figures of bearable size."""

import ast
import importlib
import re
import unicodedata

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


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_what_a_script_imports_is_there(path):
    assert not {f"{module}.{name}" for module, name in imported(path) if not is_there(module, name)}


def test_pages_and_figures_are_of_bearable_size():
    large = {path.name: path.stat().st_size for path in (DOCS / "figures").glob("*") if path.stat().st_size > 150_000}
    assert large == {}, "run docs/figures/shrink.py"
    assert sum(bool(imported(path)) for path in SCRIPTS) > 10, "there are scripts"
    words = {
        path.name: len(path.read_text(encoding="utf-8").split()) for path in [ROOT / "README.md", *DOCS.rglob("*.md")]
    }
    assert words.pop("README.md") <= 1200
    assert max(words.values()) <= 2500


REFERENCES = DOCS / "references.md"
_NAME = r"[A-Z][a-z]{2,}"
_CITATION = re.compile(rf"({_NAME})((?:, {_NAME})*(?: (?:&|and) {_NAME})?(?: et al\.)?),? \(?((?:18|19|20)\d\d)\b")


# Words that stand before a year without being a name.
_NO_NAMES = {"Journal"}


def plain(text):
    """Return text without accents."""
    return unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()


def citations():
    """Yield the first name, the year and the file of every citation."""
    for folder, pattern in (("src/fingerslip", "*.py"), ("docs", "*.md"), ("studies", "*.yaml")):
        for path in (path for path in (ROOT / folder).rglob(pattern) if path != REFERENCES):
            for name, _, year in _CITATION.findall(plain(path.read_text(encoding="utf-8"))):
                if name not in _NO_NAMES:
                    yield name, year, path


def test_every_citation_and_key_of_the_bibliography_is_in_the_list():
    entries = plain(REFERENCES.read_text(encoding="utf-8")).split("\n- ")[1:]
    missing = {
        f"{name} {year} ({path.relative_to(ROOT)})"
        for name, year, path in citations()
        if not any(name in entry.split(year)[0] for entry in entries if year in entry)
    }
    assert not missing
    names = {(name, year) for name, year, _ in citations()}
    assert {("Hilber", "1977"), ("Cattaneo", "1938"), ("Wang", "2014"), ("Barrea", "2018")} <= names, "they are found"
    # Each paper that a value names as its source can be looked up.
    bibliography = (ROOT / "src" / "fingerslip" / "references.bib").read_text(encoding="utf-8")
    entries = [entry.lower() for entry in entries]
    keys = re.findall(r"@\w+\{([a-z]+)(\d{4}),", bibliography)
    assert len(keys) == bibliography.count("@")
    for name, year in keys:
        assert any(name in entry.split(year)[0] for entry in entries if year in entry), f"{name}{year}"
