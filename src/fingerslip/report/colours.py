"""The one colour language of figures, pages and scenes: what a colour, dash or mark stands for, wherever it is drawn.

The palette is that of Okabe and Ito, which people with any kind of colour vision can tell apart. Slip events are a ramp
from light to dark in the order of time, so that they differ in lightness too; receptors have the palette's colours and
a mark each; states of the contact are pale, so that lines on them can be seen. docs/figures.md has the table.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip.windows import EVENTS, READINGS

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GREY = "#6e6e6e"
#: Lines that differ in nothing but what they are of.
LINES = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, BLACK)

#: States of the contact.
STATE_COLOURS: Mapping[int, str] = {OPEN: "#eef0f2", STICK: "#8fbfe0", SLIP: "#f2b04e"}
STATE_NAMES: Mapping[int, str] = {OPEN: "open", STICK: "stick", SLIP: "slip"}

#: Slip events: from light to dark as they follow each other, and a dash pattern each (on, off, ... in points).
EVENT_COLOURS: Mapping[str, str] = dict(zip(EVENTS, ("#d6499a", "#a02c8a", "#6a1b7a", "#22093a"), strict=True))
EVENT_DASHES: Mapping[str, tuple[float, ...]] = dict(
    zip(EVENTS, ((1.2, 1.6), (3, 1.5, 1, 1.5), (4, 2), (9, 1.5)), strict=True)
)

#: Types of receptors: a colour and a mark each.
RECEPTOR_COLOURS: Mapping[str, str] = dict(zip(RECEPTOR_KINDS, (BLUE, VERMILLION, GREEN, SKY), strict=True))
RECEPTOR_MARKS: Mapping[str, str] = dict(zip(RECEPTOR_KINDS, ("o", "^", "s", "D"), strict=True))

#: The two edges of the contact.
AREA_COLOURS: Mapping[str, str] = {"A": BLUE, "B": VERMILLION}

#: The readings of slip events.
READING_COLOURS: Mapping[str, str] = dict(zip(READINGS, (BLUE, GREEN, ORANGE), strict=True))

#: Layers, from outside inwards.
REGION_COLOURS: Mapping[str, str] = {
    "epidermis": "#e3a57c",
    "dermis": "#f2cfae",
    "skin": "#ecc09b",
    "tissue": "#faeedd",
    "phalanx": "#c9ced3",
}
_OTHER_COLOURS = ("#d9e6f2", "#dcefe2", "#efe2f0", "#f4f0d8")
#: Regions so stiff that their stress says nothing of the soft ones: fields of stress leave them in one grey.
STIFF_REGIONS = frozenset({"phalanx", "nail", "window"})
STIFF_COLOUR = REGION_COLOURS["phalanx"]
#: The lines between layers.
LAYER_LINE = "#3c3c3c"

#: Name of the map of fields from little to much: lightness falls evenly, for any colour vision; nothing is paper-light.
FIELD_MAP = "magma_r"


def field_map(limits: tuple[float, float]) -> str:
    """Return the map of colours of a field between limits: two hues where it may be negative."""
    return "RdBu_r" if limits[0] < 0.0 else FIELD_MAP


def region_colours(names: Sequence[str]) -> dict[str, str]:
    """Return a colour for every region, those of a fingertip first and from outside inwards."""
    ordered = sorted(names, key=lambda name: list(REGION_COLOURS).index(name) if name in REGION_COLOURS else 99)
    others = [name for name in ordered if name not in REGION_COLOURS]
    extra = dict(zip(others, itertools.cycle(_OTHER_COLOURS), strict=False))
    return {name: REGION_COLOURS.get(name) or extra[name] for name in ordered}
