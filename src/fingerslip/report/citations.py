"""The papers that results rest on: their entries in BibTeX."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from importlib import resources

from fingerslip.published import PublishedSet
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.version import __version__

# Every table of slip events has the share that people notice.
_NOTICED = "barrea2018"
_ENTRY = re.compile(r"^@\w+\{([^,]+),.*?^\}", re.MULTILINE | re.DOTALL)
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


def bibtex_entries(values: Sequence[ShownValue], references: Iterable[PublishedSet]) -> str:
    """Return the entries of all that a study rests on."""
    named = {word for value in values for word in re.findall(r"\w+", value.source)}
    named |= {reference.name.partition("-")[0] for reference in references} | {_NOTICED}
    return "\n\n".join([_PROGRAM, *(entry for key, entry in bibliography().items() if key in named)])
