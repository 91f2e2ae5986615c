"""What fields of a study ask of each other, beside what is right of each on its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, get_args

from fingerslip.errors import InputError, Mistakes, unknown_name
from fingerslip.materials.material import Formulation
from fingerslip.mesh.source import MeshSource
from fingerslip.parameters.dotted import is_below
from fingerslip.react.settings import ReactionSettings
from fingerslip.sampling.curves import RUNS_PER_VALUE, FitSettings
from fingerslip.specimens.choice import SPECIMENS, check_mesh, given_specimen
from fingerslip.study.definition.settings import ContactSettings, DynamicsSettings, RecordSettings, TimeSettings
from fingerslip.study.definition.sweep import SampleSettings

_KINDS = " or ".join(SPECIMENS)


def mistakes_between(fields: Mapping[str, Any]) -> list[InputError]:
    """Return the mistakes in the relations between fields of a study, as far as the fields are right on their own."""
    mistakes, values = Mistakes(), dict(fields)
    if SPECIMENS.keys() <= fields.keys():
        with mistakes.collect():
            values["specimen"] = given_specimen(fields)
    for names, check in _CHECKS:
        if values.keys() >= set(names.split()):
            with mistakes.collect():
                check(*(values[name] for name in names.split()))
    return mistakes.found


def _held_by_friction(reaction: ReactionSettings | None, contact: ContactSettings | None, time: TimeSettings) -> None:
    if reaction is None:
        return
    if contact is None:
        repair = "write contact: {friction_coefficient: 0.6}"
        raise InputError("reaction", "is given without contact", "needs the friction of a contact", repair)
    reaction.held_object(contact.contact(2), time.stepping)


def _not_both(first: str, second: str, repair: str) -> Callable[..., None]:
    """Return a check of two fields of which one alone may be given; the error stands at the first."""

    def check(value: object, other: object) -> None:
        if value and other:
            raise InputError(first, f"is given with {second}", "needs one of the two", repair)

    return check


def _contact_of_a_programme(contact: object, contacts: object, programme: object) -> None:
    if programme and not contact and not contacts:
        fault, repair = "is missing, and the programme moves the plate", "write contact: {friction_coefficient: 0.6}"
        raise InputError("contact", fault, "needs a contact", f"{repair}, or time: {{end: ...}} for programme")


def _sampled_apart_from_swept(sweep: Mapping[str, tuple[Any, ...]], sample: SampleSettings | None) -> None:
    if sample is None:
        return
    for path in (*sample.paths, *sample.equal):
        if swept := next((other for other in sweep if is_below(path, other) or is_below(other, path)), None):
            where = f"sample.{'choices' if path in sample.choices else 'ranges'}.{path}"
            raise InputError(where, f"is swept too, by '{swept}'", "needs paths apart from the sweep")


def _fitted_by_samples(
    fit: FitSettings | None, sample: SampleSettings | None, sweep: Mapping[str, tuple[Any, ...]]
) -> None:
    if fit is None:
        return
    if sample is None or sample.choices or sweep:
        fault = "without sample" if sample is None else f"with {'sweep' if sweep else 'sample.choices'}"
        raise InputError("fit", f"is given {fault}", "needs sample.ranges alone", "give what is fitted its range there")
    if sample.total < (least := RUNS_PER_VALUE * len(sample.ranges)):
        fault, allowed = f"makes {sample.total} runs", f"needs {RUNS_PER_VALUE} for each of the ranges that are fitted"
        raise InputError("sample.count", fault, allowed, f"write count: {least} or more")
    if unknown := next((path for path in fit.bounds if path not in sample.ranges), None):
        raise unknown_name("fit.bounds", unknown, sample.ranges)


def _of_a_body(name: str) -> Callable[..., None]:
    """Return a check of a value that only a specimen could give instead; a solid needs no depth."""

    def check(specimen: str | None, mesh: MeshSource, value: object, formulation: Formulation | None = None) -> None:
        if specimen is None and not mesh.needs_specimen and not value and formulation != "solid":
            needs = f"one of {', '.join(get_args(Formulation))}" if name == "formulation" else "a value"
            raise InputError(name, "is missing", f"needs {needs} where there is no {_KINDS}")

    return check


def _no_sites_of_a_body(specimen: str | None, mesh: MeshSource, record: RecordSettings) -> None:
    """Refuse sites that only a specimen has."""
    if specimen is None and not mesh.needs_specimen:
        names = [name for name in ("receptors", "reference_nodes", "groups") if getattr(record, name)]
        said = f"is given without a {_KINDS}", f"needs a {_KINDS}", "name points in record.sites"
        Mistakes(InputError(f"record.{name}", *said) for name in names).raise_all()


def _sites_of_this_body(specimen: str | None, mesh: MeshSource, record: RecordSettings, *bodies: Any) -> None:
    """Refuse groups of sites that a specimen has not, where the dimension is known without building its mesh."""
    if specimen is not None and record.groups and mesh.dim is not None:
        body = dict(zip(SPECIMENS, bodies, strict=True))[specimen]
        SPECIMENS[specimen].changed(body).sites(record.groups, mesh.dim)


def _fixed_step_of_a_basis(dynamics: DynamicsSettings, time: TimeSettings) -> None:
    if dynamics.basis == "reduced" and time.step == "auto":
        repair = "write basis: full, or a fixed step"
        raise InputError("dynamics.basis", "is reduced where time.step is auto", "needs a fixed step", repair)


# The fields that a check needs, and the check; `specimen` is the key of the one that is given.
_CHECKS: tuple[tuple[str, Callable[..., None]], ...] = (
    ("contacts contact", _not_both("contacts", "contact", "move contact into contacts")),
    ("contact contacts programme", _contact_of_a_programme),
    ("sweep sample", _sampled_apart_from_swept),
    ("fit sample sweep", _fitted_by_samples),
    ("repeats sample", _not_both("repeats", "sample", "let what scatters be sampled")),
    ("specimen mesh", check_mesh),
    ("specimen mesh materials", _of_a_body("materials")),
    ("specimen mesh formulation", _of_a_body("formulation")),
    ("specimen mesh depth formulation", _of_a_body("depth")),
    ("specimen mesh record", _no_sites_of_a_body),
    (f"specimen mesh record {' '.join(SPECIMENS)}", _sites_of_this_body),
    ("dynamics time", _fixed_step_of_a_basis),
    ("contacts reaction", _not_both("contacts", "reaction", "write contact, which touches the object")),
    ("programme reaction", _not_both("programme", "reaction", "leave it out: grip and load move the object")),
    ("bodies reaction", _not_both("bodies", "reaction", "leave it out: the object is the one body")),
    ("reaction contact time", _held_by_friction),
)
