"""Published fingertips, and a study's changes to them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fingerslip.materials.choice import kept_values
from fingerslip.parameters.presets import Presets, PresetValue
from fingerslip.specimens.fingertip.fingertip import Fingertip

__all__ = ["PRESETS", "PresetValue", "fingertip_from", "preset", "preset_header", "preset_names", "preset_table"]

PRESETS = Presets(Fingertip, "fingerslip.specimens.fingertip", kept_values)


def preset_names() -> tuple[str, ...]:
    """Return the names of all presets."""
    return PRESETS.names


def preset(name: str) -> Fingertip:
    """Return the fingertip of a preset.

    Parameters
    ----------
    name : str
        One of :func:`preset_names`.

    Raises
    ------
    InputError
        Where no preset has that name.
    """
    return PRESETS.read(name)


def preset_table(name: str) -> tuple[PresetValue, ...]:
    """Return every value of a preset with its source, the assumed ones first.

    Parameters
    ----------
    name : str
        One of :func:`preset_names`.

    Raises
    ------
    InputError
        Where no preset has that name.
    """
    return PRESETS.table(name)


def preset_header(name: str) -> dict[str, str]:
    """Return what a preset says of itself, `citation`, `published` and `claims_not`; `name` as of :func:`preset`."""
    return PRESETS.header(name)


def fingertip_from(mapping: Mapping[str, Any], where: str = "") -> Fingertip:
    """Return the fingertip of a study: a preset and what the study changes in it.

    Parameters
    ----------
    mapping : mapping
        Nested plain data as YAML gives it, with the key ``preset``; the other keys override the preset's values.
    where : str, optional
        What errors put first, such as ``studies/x.yaml: fingertip``.

    Raises
    ------
    InputError
        For an unknown preset, or for all unknown keys and values that do not fit.
    """
    return PRESETS.changed(mapping, where)
