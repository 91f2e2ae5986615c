"""Materials that ship: skin, pulp, silicone and more, each value with its source."""

from __future__ import annotations

from fingerslip.materials.choice import MATERIALS, AnyMaterial
from fingerslip.parameters.presets import PresetValue

__all__ = ["material", "material_header", "material_names", "material_table"]


def material_names() -> tuple[str, ...]:
    """Return the names of all materials that ship."""
    return MATERIALS.names


def material(name: str) -> AnyMaterial:
    """Return a material that ships.

    Parameters
    ----------
    name : str
        One of :func:`material_names`.

    Raises
    ------
    InputError
        Where no material has that name.

    Examples
    --------
    >>> material("pulp").youngs_modulus
    34000.0
    """
    return MATERIALS.read(name)


def material_table(name: str) -> tuple[PresetValue, ...]:
    """Return every value of a material with its source, the assumed ones first; `name` as of :func:`material`."""
    return MATERIALS.table(name)


def material_header(name: str) -> dict[str, str]:
    """Return what a material says of itself: `citation`, `published` and `claims_not`."""
    return MATERIALS.header(name)
