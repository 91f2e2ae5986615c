"""What must hold between the fields of a study, such as materials where there is no specimen."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from fingerslip.errors import InputError, Mistakes
from fingerslip.materials.choice import AnyMaterial
from fingerslip.materials.material import Formulation
from fingerslip.parameters.dotted import is_below
from fingerslip.programme import Phase
from fingerslip.specimens.choice import SPECIMENS, check_mesh, given_specimen
from fingerslip.study.definition.repeats import RepeatSettings
from fingerslip.study.definition.sampled import SampleSettings
from fingerslip.study.definition.settings import (
    ContactSettings,
    DynamicsSettings,
    MeshSettings,
    RecordSettings,
)
from fingerslip.study.definition.time_settings import TimeSettings

__all__ = ["mistakes_between"]

_KINDS = " or ".join(SPECIMENS)


def mistakes_between(fields: Mapping[str, Any]) -> list[InputError]:
    """Return the mistakes in the relations between fields of a study."""
    mistakes, known = Mistakes(), dict(fields)
    if SPECIMENS.keys() <= fields.keys():
        with mistakes.collected():
            known["specimen"] = given_specimen(fields)
    for check in _CHECKS:
        names = inspect.signature(check).parameters
        if names.keys() <= known.keys():
            with mistakes.collected():
                check(**{name: known[name] for name in names})
    return mistakes.found


def _one_contact_or_several(contact: ContactSettings | None, contacts: tuple[ContactSettings, ...]) -> None:
    if contact is not None and contacts:
        raise InputError("contacts", "is given with contact", "needs one of the two", "move contact into contacts")


def _contact_of_a_programme(
    contact: ContactSettings | None, contacts: tuple[ContactSettings, ...], programme: tuple[Phase, ...]
) -> None:
    if programme and contact is None and not contacts:
        found, repair = "is missing, and the programme moves the plate", "write contact: {friction_coefficient: 0.6}"
        raise InputError("contact", found, "needs a contact", f"{repair}, or time: {{end: ...}} for programme")


def _sampled_apart_from_swept(sweep: Mapping[str, tuple[Any, ...]], sample: SampleSettings | None) -> None:
    for path in () if sample is None else (*sample.paths, *sample.equal):
        shared = next((other for other in sweep if is_below(path, other) or is_below(other, path)), None)
        if shared is not None:
            raise InputError(
                f"sample.{_group_of(path, sample)}.{path}",
                f"is swept too, by '{shared}'",
                "needs paths apart from the sweep",
            )


def _repeated_without_samples(repeats: RepeatSettings | None, sample: SampleSettings | None) -> None:
    if repeats is not None and sample is not None:
        raise InputError("repeats", "is given with sample", "needs one of the two", "let what scatters be sampled")


def _group_of(path: str, sample: SampleSettings | None) -> str:
    return "choices" if sample is not None and path in sample.choices else "ranges"


def _materials_of_a_body(specimen: str | None, mesh: MeshSettings, materials: Mapping[str, AnyMaterial]) -> None:
    _check_body("materials", materials, specimen, mesh)


def _formulation_of_a_body(specimen: str | None, mesh: MeshSettings, formulation: Formulation | None) -> None:
    _check_body("formulation", formulation, specimen, mesh)


def _depth_of_a_body(
    specimen: str | None, mesh: MeshSettings, formulation: Formulation | None, depth: float | None
) -> None:
    if formulation != "solid":
        _check_body("depth", depth, specimen, mesh)


def _no_receptors_of_a_body(specimen: str | None, mesh: MeshSettings, record: RecordSettings) -> None:
    _check_no_sites("receptors", specimen, mesh, record)


def _no_reference_nodes_of_a_body(specimen: str | None, mesh: MeshSettings, record: RecordSettings) -> None:
    _check_no_sites("reference_nodes", specimen, mesh, record)


def _no_groups_of_a_body(specimen: str | None, mesh: MeshSettings, record: RecordSettings) -> None:
    _check_no_sites("groups", specimen, mesh, record)


def _fixed_step_of_a_basis(dynamics: DynamicsSettings, time: TimeSettings) -> None:
    if dynamics.basis == "reduced" and time.step == "auto":
        repair = "write basis: full, or a fixed step"
        raise InputError("dynamics.basis", "is reduced where time.step is auto", "needs a fixed step", repair)


# The arguments of a check are named like the fields that it needs; `specimen` is the key of the one that is given.
_CHECKS: tuple[Callable[..., None], ...] = (
    _one_contact_or_several,
    _contact_of_a_programme,
    _sampled_apart_from_swept,
    _repeated_without_samples,
    check_mesh,
    _materials_of_a_body,
    _formulation_of_a_body,
    _depth_of_a_body,
    _no_receptors_of_a_body,
    _no_reference_nodes_of_a_body,
    _no_groups_of_a_body,
    _fixed_step_of_a_basis,
)


def _check_body(name: str, value: object, specimen: str | None, mesh: MeshSettings) -> None:
    """Require a value that only a specimen could provide instead."""
    if specimen is None and not mesh.needs_specimen and not value:
        raise InputError(name, "is missing", f"needs a value where there is no {_KINDS}")


def _check_no_sites(name: str, specimen: str | None, mesh: MeshSettings, record: RecordSettings) -> None:
    """Refuse sites that only a specimen has."""
    if specimen is None and not mesh.needs_specimen and getattr(record, name):
        found, repair = f"is given without a {_KINDS}", "name points in record.sites"
        raise InputError(f"record.{name}", found, f"needs a {_KINDS}", repair)
