"""What to cite with a study: the papers of its values and comparisons, and the program, as BibTeX."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from importlib import resources

from fingerslip.published import PublishedSet
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.version import __version__

__all__ = ["bibliography", "bibtex_entries"]

# Every table of slip events has the share that people notice.
_NOTICED = "barrea2018"
_ENTRY = re.compile(r"^@\w+\{([^,]+),.*?^\}", re.MULTILINE | re.DOTALL)


def bibliography() -> dict[str, str]:
    """Return the entries of the papers that values and comparisons are from, by their keys."""
    text = resources.files("fingerslip").joinpath("references.bib").read_text(encoding="utf-8")
    return {found.group(1): found.group(0) for found in _ENTRY.finditer(text)}


def bibtex_entries(values: Sequence[ShownValue], references: Iterable[PublishedSet]) -> str:
    """Return the entries of all that a study rests on."""
    known = bibliography()
    named = {word for value in values for word in re.findall(r"\w+", value.source)}
    named |= {reference.name.partition("-")[0] for reference in references} | {_NOTICED}
    program = (
        "@misc{fingerslip,\n"
        "  title  = {fingerslip: a finite-element toolkit for fingertip slip},\n"
        "  author = {{The fingerslip developers}},\n"
        f"  note   = {{Version {__version__}}},\n"
        "  year   = {2026},\n"
        "}"
    )
    return "\n\n".join([program, *(entry for key, entry in known.items() if key in named)])
