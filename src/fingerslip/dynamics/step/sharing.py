"""What may be shared: a matrix by models, a compliance by systems, a motion by systems that still move alike."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from fingerslip.dynamics.system.scheme import make_scheme
from fingerslip.errors import InputError
from fingerslip.model.model import Model
from fingerslip.model.timing import Adaptive

if TYPE_CHECKING:
    from fingerslip.dynamics.system.system import System

T = TypeVar("T")

# Degrees of freedom from which sharing is worth it, by the dimension of space; the fewest models of a full group.
# Eight frictions and depths together take 1/1.7 of the CPU time in 2D at 15,000 and 1/1.35 at 5,000.
_WORTH_SHARING = {2: 5_000, 3: 15_000}
_FULL = 8

# What of a model decides stiffness and mass, beside its mesh.
_OF_BODY = ("kinematics", "materials", "formulation", "depth", "supports", "support_motions", "integration")
# What of a contact and of a rigid body does.
_OF_CONTACT = ("boundary", "counterface", "normal_penalty", "tangential_penalty", "rigid_body")
_OF_RIGID = ("mass", "free", "centre", "inertia", "springs", "dampers")


def same_matrix(first: Model, other: Model) -> bool:
    """Tell whether two models have the same effective matrix, so that they can be simulated together."""
    return not any(_differences(first, other))


def same_body(first: Model, other: Model) -> bool:
    """Tell whether a reduced basis may serve two models: the same matrices, boundaries that may touch, and sites."""
    return (
        all(getattr(first, name) == getattr(other, name) for name in _OF_BODY)
        and [contact.boundary for contact in first.contacts] == [contact.boundary for contact in other.contacts]
        and _rigid_parts(first) == _rigid_parts(other)
        and first.record.sites == other.record.sites
        and _same_mesh(first.mesh, other.mesh)
    )


def same_compliance(first: System, other: System) -> bool:
    """Tell whether two systems of one matrix have the same compliance at their candidates, in the same frames."""
    frames, others = first.constant_frames(), other.constant_frames()
    return (
        np.array_equal(first.candidates.nodes, other.candidates.nodes)
        and np.array_equal(first.candidates.counterface, other.candidates.counterface)
        and (frames is None) == (others is None)
        and (frames is None or others is None or np.array_equal(frames, others))
    )


def same_motion(first: System, other: System) -> bool:
    """Tell whether two systems of one matrix move alike as long as their counterfaces do."""
    return (
        first.counterfaces == other.counterfaces
        and np.array_equal(first.candidates.nodes, other.candidates.nodes)
        and np.array_equal(first.initial_velocity, other.initial_velocity)
        and len(first.loads) == len(other.loads)
        and all(
            a.ramp == b.ramp and np.array_equal(a.forces, b.forces)
            for a, b in zip(first.loads, other.loads, strict=True)
        )
    )


def first_alike(items: Sequence[T], same: Callable[[T, T], bool], key: Callable[[T], str] = lambda _: "") -> list[int]:
    """Return for each item the index of the first one that is the same.

    Items with different keys are never the same: a key keeps thousands of items from being compared with each other.

    Examples
    --------
    >>> first_alike(["to", "be", "To", "BE", "or"], lambda one, other: one.lower() == other.lower())
    [0, 1, 0, 1, 4]
    """
    firsts: list[int] = []
    kinds: dict[str, list[int]] = {}
    for item in items:
        alike = kinds.setdefault(key(item), [])
        first = next((number for number in alike if same(items[number], item)), None)
        if first is None:
            alike.append(first := len(firsts))
        firsts.append(first)
    return firsts


def material_key(model: Model) -> str:
    """Return a text that is the same for models with the same materials."""
    return repr(sorted(model.materials.items(), key=lambda item: item[0]))


def groups_to_share(
    models: Sequence[Model], at_once: int = 1, most: Callable[[Model], int] = lambda _: _FULL
) -> list[list[int]]:
    """Return the indices of models that are best simulated together, group by group.

    Small models stay apart. A large group is split evenly, into a multiple of the parts that run at once, so that all
    of these end together and not too many histories are kept.
    """

    def gains(model: Model) -> bool:
        """Tell whether a model gains by sharing: not at large strain nor with steps of its own."""
        is_large = model.mesh.p.size >= _WORTH_SHARING[model.mesh.dim()]
        return is_large and not (model.is_finite or isinstance(model.time, Adaptive))

    first = first_alike(models, lambda one, other: gains(other) and same_matrix(one, other), material_key)
    alike = [[number for number, leader in enumerate(first) if leader == kind] for kind in dict.fromkeys(first)]
    groups = []
    for group in alike:
        model = models[group[0]]
        beside = math.ceil(at_once / max(1, len(alike))) if model.mesh.dim() == 2 else 1
        few = len(group) <= _FULL * beside
        rounds = 1 if few else math.ceil(len(group) / (max(_FULL, most(model)) * beside))
        size = math.ceil(len(group) / (rounds * beside))
        groups += [group[start : start + size] for start in range(0, len(group), size)]
    return groups


def check_same_matrix(models: Sequence[Model]) -> None:
    """Refuse models that cannot be simulated together."""
    if not models:
        raise InputError("models", "got none", "needs one or more")
    for number, model in enumerate(models):
        part = next(_differences(models[0], model), None)
        if part:
            fault = "differs from that of the first model"
            allowed = "needs the same matrix to be simulated together"
            raise InputError(f"models.{number}.{part}", fault, allowed, "simulate it by itself")


def _differences(first: Model, other: Model) -> Iterator[str]:
    """Yield what keeps two models from having the same matrix."""
    yield from (name for name in (*_OF_BODY, "damping", "basis") if getattr(first, name) != getattr(other, name))
    if not _same_mesh(first.mesh, other.mesh):
        yield "mesh"
    are_adaptive = isinstance(first.time, Adaptive), isinstance(other.time, Adaptive)
    if are_adaptive[0] != are_adaptive[1] or make_scheme(first.time) != make_scheme(other.time):
        yield "time"
    if len(first.contacts) != len(other.contacts):
        yield "contacts"
    if _rigid_parts(first) != _rigid_parts(other):
        yield "bodies"
    for number, pair in enumerate(zip(first.contacts, other.contacts, strict=False)):
        a, b = ([each.drive and each.drive.mass, *(getattr(each, name) for name in _OF_CONTACT)] for each in pair)
        if a != b:
            yield f"contacts.{number}"


def _rigid_parts(model: Model) -> list[tuple[Any, ...]]:
    """Return what of the rigid bodies decides the matrix and the compliance."""
    return [(name, *(getattr(body, part) for part in _OF_RIGID)) for name, body in model.bodies.items()]


def _same_mesh(first: Any, other: Any) -> bool:
    if first is other:
        return True
    if type(first) is not type(other) or not np.array_equal(first.doflocs, other.doflocs):
        return False
    pairs = ((getattr(first, name) or {}, getattr(other, name) or {}) for name in ("boundaries", "subdomains"))
    return np.array_equal(first.t, other.t) and all(
        a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a) for a, b in pairs
    )
