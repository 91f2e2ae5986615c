"""What must hold between the fields of a study, such as materials where there is no fingertip."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from fingerslip.errors import InputError, Mistakes
from fingerslip.materials.elastic import Elastic
from fingerslip.mesh.scan.build import SurfaceMesh
from fingerslip.model import Formulation
from fingerslip.study.definition.settings import ContactSettings, MeshFile, MeshSettings, RecordSettings

__all__ = ["mistakes_between"]


def mistakes_between(fields: Mapping[str, Any]) -> list[InputError]:
    """Return the mistakes in the relations between fields of a study.

    Parameters
    ----------
    fields : mapping of str to object
        Values of fields that are right on their own. A relation is checked where all its fields are among them.
    """
    mistakes = Mistakes()
    for check in _CHECKS:
        names = inspect.signature(check).parameters
        if names.keys() <= fields.keys():
            with mistakes.collected():
                check(**{name: fields[name] for name in names})
    return mistakes.found


def _one_contact_or_several(contact: ContactSettings | None, contacts: tuple[ContactSettings, ...]) -> None:
    if contact is not None and contacts:
        raise InputError("contacts", "is given with contact", "needs one of the two", "move contact into contacts")


def _a_fingertip_or_a_mesh(fingertip: object, mesh: MeshSettings) -> None:
    if fingertip is None and not _is_given(mesh):
        raise InputError("fingertip", "is missing", "needs a preset, or mesh.file for a body that is no fingertip")


def _materials_of_a_body(fingertip: object, mesh: MeshSettings, materials: Mapping[str, Elastic]) -> None:
    _check_body("materials", materials, fingertip, mesh)


def _formulation_of_a_body(fingertip: object, mesh: MeshSettings, formulation: Formulation | None) -> None:
    _check_body("formulation", formulation, fingertip, mesh)


def _depth_of_a_body(
    fingertip: object, mesh: MeshSettings, formulation: Formulation | None, depth: float | None
) -> None:
    if formulation != "solid":
        _check_body("depth", depth, fingertip, mesh)


def _no_receptors_in_a_body(fingertip: object, mesh: MeshSettings, record: RecordSettings) -> None:
    if fingertip is None and _is_given(mesh) and record.receptors:
        raise InputError(
            "record.receptors", "is given without a fingertip", "needs a fingertip", "name points in record.sites"
        )


# The arguments of a check are named like the fields that it needs.
_CHECKS: tuple[Callable[..., None], ...] = (
    _one_contact_or_several,
    _a_fingertip_or_a_mesh,
    _materials_of_a_body,
    _formulation_of_a_body,
    _depth_of_a_body,
    _no_receptors_in_a_body,
)


def _is_given(mesh: MeshSettings) -> bool:
    """Tell whether a mesh is read or made of a scan, and not of a fingertip's shape."""
    return isinstance(mesh, MeshFile | SurfaceMesh)


def _check_body(name: str, value: object, fingertip: object, mesh: MeshSettings) -> None:
    """Require a value that only a fingertip could provide instead."""
    if fingertip is None and _is_given(mesh) and not value:
        raise InputError(name, "is missing", "needs a value where there is no fingertip")
