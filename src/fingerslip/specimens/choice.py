"""Which specimen a study means: a key for each kind, and the presets of all kinds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from types import MappingProxyType
from typing import Annotated, Any

import pydantic

from fingerslip.errors import InputError
from fingerslip.mesh.source import MeshSource
from fingerslip.parameters import parameters
from fingerslip.parameters.presets import Presets
from fingerslip.specimens.fingertip.fingertip import PRESETS as FINGERTIPS
from fingerslip.specimens.gel_pad.gel_pad import PRESETS as GEL_PADS
from fingerslip.specimens.protocol import Specimen
from fingerslip.specimens.tactip.tactip import PRESETS as TACTIPS

#: The presets of every kind of specimen, by the key that names the kind in a study file.
SPECIMENS: Mapping[str, Presets[Any]] = MappingProxyType(
    {"fingertip": FINGERTIPS, "tactip": TACTIPS, "gel_pad": GEL_PADS}
)


def _checker(kind: str) -> pydantic.AfterValidator:
    """Return a check of the values of a specimen, which are kept as they are written."""

    def check(values: Mapping[str, Any]) -> Mapping[str, Any]:
        SPECIMENS[kind].changed(values)
        return values

    return pydantic.AfterValidator(check)


@parameters
class SpecimenChoice:
    """The specimen of a study: a key for each kind, of which at most one is given.

    Parameters
    ----------
    fingertip, tactip, gel_pad : mapping, optional
        The specimen: `preset` and the values that differ from it.
    """

    fingertip: Annotated[Mapping[str, Any], _checker("fingertip")] | None = field(default=None, kw_only=True)
    tactip: Annotated[Mapping[str, Any], _checker("tactip")] | None = field(default=None, kw_only=True)
    gel_pad: Annotated[Mapping[str, Any], _checker("gel_pad")] | None = field(default=None, kw_only=True)

    @property
    def specimen_kind(self) -> str | None:
        """The key that is given; None without a specimen."""
        return next((key for key in SPECIMENS if getattr(self, key) is not None), None)

    def specimen(self, where: str) -> Specimen | None:
        """Return the specimen with all its values, whose errors begin with `where`; None without one."""
        kind = self.specimen_kind
        return None if kind is None else SPECIMENS[kind].changed(getattr(self, kind), f"{where}: {kind}")


def given_specimen(fields: Mapping[str, Any]) -> str | None:
    """Return the key of the specimen that is given; None without one."""
    keys = [key for key in SPECIMENS if fields[key] is not None]
    if len(keys) > 1:
        raise InputError(keys[1], f"is given with {keys[0]}", "needs one of the two")
    return keys[0] if keys else None


def check_mesh(specimen: str | None, mesh: MeshSource) -> None:
    """Refuse a mesh source that needs a specimen of another kind, or any at all."""
    if not mesh.needs_specimen:
        return
    if specimen is None:
        kinds = " or ".join(SPECIMENS)
        raise InputError(kinds, "is missing", f"needs a preset, or mesh.file for a body that is no {kinds}")
    if type(mesh) not in SPECIMENS[specimen].kind.mesh_sources:
        raise InputError("mesh", f"does not mesh a {specimen}", "needs element sizes of this specimen")


def specimen_mesh_sources() -> tuple[type[MeshSource], ...]:
    """Return the classes of the mesh sources of all kinds of specimens."""
    return tuple(source for presets in SPECIMENS.values() for source in presets.kind.mesh_sources)


def preset_names() -> tuple[str, ...]:
    """Return the names of the presets of all kinds of specimens."""
    return tuple(name for presets in SPECIMENS.values() for name in presets.names)


def presets_of(name: str) -> Presets[Any]:
    """Return the presets that hold the one of a name."""
    result = next((presets for presets in SPECIMENS.values() if name in presets.names), None)
    if result is None:
        raise InputError("preset", f"'{name}' is not known", f"needs one of {', '.join(preset_names())}")
    return result
