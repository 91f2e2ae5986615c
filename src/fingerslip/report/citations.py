"""The papers that results rest on: their entries in BibTeX, and their short form in a text."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence
from importlib import resources

from fingerslip.published import PublishedSet
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.version import __version__

# Every table of slip events has the share that people notice.
_NOTICED = "barrea2018"
_ENTRY = re.compile(r"^@\w+\{([^,]+),.*?^\}", re.MULTILINE | re.DOTALL)
_ACCENTS = {"'": "\u0301", "`": "\u0300", '"': "\u0308"}
_PROGRAM = f"""@misc{{fingerslip,
  title  = {{fingerslip: a finite-element toolkit for fingertip slip}},
  author = {{{{The fingerslip developers}}}},
  note   = {{Version {__version__}}},
  year   = {{2026}},
}}"""


def bibliography() -> dict[str, str]:
    """Return the entries of the papers that values and comparisons are from, by their keys."""
    text = resources.files("fingerslip").joinpath("references.bib").read_text(encoding="utf-8")
    return {entry.group(1): entry.group(0) for entry in _ENTRY.finditer(text)}


def bibtex_entries(
    values: Sequence[ShownValue], references: Iterable[PublishedSet], keys: Iterable[str] = (_NOTICED,)
) -> str:
    """Return the entries of all that a study rests on: sources of its values, published sets, and other keys."""
    named = {*source_keys(values), *(reference.name.partition("-")[0] for reference in references), *keys}
    return "\n\n".join([_PROGRAM, *(entry for key, entry in bibliography().items() if key in named)])


def source_keys(values: Iterable[ShownValue]) -> list[str]:
    """Return the keys of the papers that values are from, each once."""
    papers = bibliography()
    return list(dict.fromkeys(word for value in values for word in re.findall(r"\w+", value.source) if word in papers))


def short_citation(key: str) -> str:
    """Return authors and year of a paper.

    Examples
    --------
    >>> short_citation("wang2014"), short_citation("schenk2004"), short_citation("bulens2023")
    ('Wang et al. 2014', 'Schenk & Gärtner 2004', 'Cordova Bulens et al. 2023')
    """
    names = re.search(r"author\s*= \{(.+)\}", bibliography()[key])
    assert names is not None, key
    # Without the braces and with the accents of BibTeX.
    accented = re.sub(r"\{\\(['`\"])(\w)\}", lambda sign: sign[2] + _ACCENTS[sign[1]], names[1])
    plain = unicodedata.normalize("NFC", re.sub(r"[{}]", "", accented))
    authors = [name.partition(",")[0] for name in plain.split(" and ")]
    listed = f"{authors[0]} et al." if len(authors) > 2 else " & ".join(authors)
    return f"{listed} {key[-4:]}"
