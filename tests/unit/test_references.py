"""Every work that code, studies or docs cite stands in the list of references; every module is documented once."""

import re
import unicodedata

from places import DOCS, ROOT

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


def test_every_citation_is_in_the_list():
    entries = plain(REFERENCES.read_text(encoding="utf-8")).split("\n- ")[1:]
    missing = {
        f"{name} {year} ({path.relative_to(ROOT)})"
        for name, year, path in citations()
        if not any(name in entry.split(year)[0] for entry in entries if year in entry)
    }
    assert not missing


def test_citations_are_found():
    found = {(name, year) for name, year, _ in citations()}
    assert {("Hilber", "1977"), ("Cattaneo", "1938"), ("Wang", "2014"), ("Barrea", "2018")} <= found


def test_every_key_of_the_bibliography_is_listed():
    """Each paper that a value names as its source can be looked up."""
    bibliography = (ROOT / "src" / "fingerslip" / "references.bib").read_text(encoding="utf-8")
    entries = plain(REFERENCES.read_text(encoding="utf-8")).lower().split("\n- ")[1:]
    keys = re.findall(r"@\w+\{([a-z]+)(\d{4}),", bibliography)
    assert len(keys) == bibliography.count("@")
    for name, year in keys:
        assert any(name in entry.split(year)[0] for entry in entries if year in entry), f"{name}{year}"


def test_every_module_is_documented_once():
    pages = (path.read_text(encoding="utf-8") for path in sorted((DOCS / "api").glob("*.md")))
    modules = re.findall(r"automodule:: (\S+)", "".join(pages))
    assert sorted(modules) == sorted(set(modules))
