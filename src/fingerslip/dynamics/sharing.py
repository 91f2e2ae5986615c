"""Which models can share one factorised matrix."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fingerslip.dynamics.scheme import make_scheme
from fingerslip.errors import InputError
from fingerslip.model import Contact, Model

__all__ = ["can_share", "check_shared"]


def check_shared(models: Sequence[Model]) -> None:
    """Refuse models whose motions cannot be computed with one matrix.

    Raises
    ------
    InputError
        For no models, and for the first part of a model that differs from that of the first model.
    """
    if not models:
        raise InputError("models", "got none", "needs one or more")
    for number, model in enumerate(models):
        part = _difference(models[0], model)
        if part:
            found = "differs from that of the first model"
            allowed = "needs the same matrix to be simulated together"
            raise InputError(f"models.{number}.{part}", found, allowed, "simulate it by itself")


def can_share(one: Model, other: Model) -> bool:
    """Tell whether two models can be simulated together."""
    return not _difference(one, other)


def _difference(one: Model, other: Model) -> str:
    """Return what keeps two models from sharing a matrix; empty if nothing does."""
    for name in ("materials", "formulation", "depth", "supports", "damping", "integration"):
        if getattr(one, name) != getattr(other, name):
            return name
    if not _same_mesh(one.mesh, other.mesh):
        return "mesh"
    if make_scheme(one.time) != make_scheme(other.time):
        return "time"
    if len(one.contacts) != len(other.contacts):
        return "contacts"
    pairs = enumerate(zip(one.contacts, other.contacts, strict=True))
    return next((f"contacts.{number}" for number, (a, b) in pairs if _surface(a) != _surface(b)), "")


def _surface(contact: Contact) -> tuple[Any, ...]:
    mass = contact.drive.mass if contact.drive else None
    return contact.boundary, contact.counterface, contact.normal_penalty, contact.tangential_penalty, mass


def _same_mesh(one: Any, other: Any) -> bool:
    if one is other:
        return True
    tables: tuple[Callable[[Any], Any], ...] = (lambda mesh: mesh.boundaries, lambda mesh: mesh.subdomains)
    return (
        type(one) is type(other)
        and np.array_equal(one.doflocs, other.doflocs)
        and np.array_equal(one.t, other.t)
        and all(_same_table(table(one) or {}, table(other) or {}) for table in tables)
    )


def _same_table(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)
