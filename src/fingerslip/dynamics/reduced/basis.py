"""Motions in a reduced basis, as large as the tolerance needs, or none where the mesh is the better choice."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Protocol, TypeVar

import numpy as np
from scipy import linalg

from fingerslip.arrays import Floats, Integers
from fingerslip.dynamics.motions import Motions, Outcome, compute
from fingerslip.dynamics.reduced.reduction import (
    further_shapes,
    interface_unknowns,
    observed_unknowns,
    reduced_system,
    site_responses,
    site_unknowns,
)
from fingerslip.dynamics.reduced.residual import ResidualCheck
from fingerslip.dynamics.system.scheme import has_inertia, make_scheme
from fingerslip.dynamics.system.system import System
from fingerslip.errors import FingerslipError
from fingerslip.fe.space import free_pieces
from fingerslip.linear.craig_bampton import (
    ConstraintModes,
    CraigBampton,
    constraint_modes,
    craig_bampton,
    normal_modes,
    slow_motions,
)
from fingerslip.linear.resources import available_memory
from fingerslip.model.model import ReducedBasis
from fingerslip.storage.files import digest

T = TypeVar("T")

# Normal modes of the first basis and of the largest one, and how many times as many the next one has at most. There are
# as many responses at sites.
_FEWEST, _MOST, _MOST_TIMES = 40, 320, 8
# Numerical damping below which the first basis is twice as large: what begins to ring rings on. Where accelerations may
# be off by more than the second number, neither this nor responses at sites are worth their time.
_LITTLE, _COARSE = 0.2, 0.05
# Share of the tolerances that the first of several motions may use up: others may leave twice its errors (measured).
_SHARE_OF_FIRST = 0.5
# Slow motions that excite them: more normal modes for each bring more than more motions do (measured).
_MOTIONS = 20
# Square matrices of the interface's size that exist at once: constraint modes, eigenvectors, compliances.
_SQUARES = 10
# Copies of the responses at sites that do: forces, and both halves of their substitution.
_COPIES = 3
_VERSION = 5
# Normal modes of a basis that is stepped from outside, where none is kept: no run has tried how many suffice.
_STEPWISE = 80

_logger = logging.getLogger("fingerslip.dynamics")


class BasisStore(Protocol):
    """Where bases are kept."""

    def load(self, key: str) -> Mapping[str, Floats] | None:
        """Return the arrays that were kept under a key, or None."""

    def save(self, key: str, arrays: Mapping[str, Floats]) -> None:
        """Keep arrays under a key."""

    def alone(self, key: str) -> AbstractContextManager[None]:
        """Keep others from making the arrays of a key while a block looks for them, and makes them where none are."""


class _UnsuitableError(Exception):
    """A reduced basis is not the way to compute the motions; says why."""


@dataclass(frozen=True)
class _Maker:
    """Makes the bases of motions, or takes those that are kept."""

    motions: Motions
    body: ConstraintModes
    rows: Integers
    store: BasisStore | None

    def alone(self) -> AbstractContextManager[None]:
        """Keep other processes from making the same basis in a block."""
        return nullcontext() if self.store is None else self.store.alone(self._key)

    def kept(self) -> CraigBampton | None:
        """Return the basis that is kept, if any."""
        arrays: Any = None if self.store is None else self.store.load(self._key)
        return CraigBampton(**arrays) if arrays else None

    def keep(self, basis: CraigBampton) -> None:
        """Keep a basis for other runs."""
        if self.store is not None:
            with self.motions.watch.part("basis"):
                self.store.save(self._key, {field.name: getattr(basis, field.name) for field in fields(basis)})

    def fewest(self, share: float) -> int:
        """Return how many normal modes the first basis has, which may use up a share of the tolerances."""
        scheme = make_scheme(self.motions.models[0].time)
        rings = scheme.inertia_factor and scheme.start_weight > -_LITTLE and not _is_coarse(self.motions)
        return round(2 * _FEWEST / share) if rings else _FEWEST

    def make(self, count: int) -> CraigBampton:
        """Make a basis with some normal modes and as many responses at sites."""
        further = further_shapes(self.body, self.motions.systems)
        slow = slow_motions(self.body, self._responses[0], 2 * _MOTIONS)
        moving = self.body.follow(
            np.eye(self.body.interface.size)[:, self.body.interface.size - self.body.prescribed :]
        )
        start, faster = np.column_stack([slow[:, :_MOTIONS], moving, *further]), slow[:, _MOTIONS:]
        modes = normal_modes(self.body, start, count, following=max(start.shape[1], count // 2))
        at_sites, next_at_sites = np.split(self._site_responses[:, : 2 * count], [count], axis=1)
        # What shows the error of a basis: the next modes, the next motions, and the next responses at sites.
        following = [modes.following, self.body.give_way(self.body.mass @ faster), next_at_sites]
        modes = replace(modes, following=np.hstack(following))
        return craig_bampton(self.body, self._responses, modes, self.rows, [*further, *at_sites.T])

    @cached_property
    def _responses(self) -> tuple[Floats, Floats]:
        return constraint_modes(self.body, self.rows)

    @cached_property
    def _site_responses(self) -> Floats:
        """Responses at sites (n, k) [m], in the order of their inertia."""
        if _is_coarse(self.motions):
            return np.zeros((self.body.stiffness.shape[0], 0))
        fields = site_responses(self.body, self.motions.systems)
        _, vectors = linalg.eigh(fields.T @ (self.body.mass @ fields))
        ordered: Floats = fields @ vectors[:, ::-1]
        return ordered

    @cached_property
    def _key(self) -> str:
        """What decides the basis, hashed: matrices, and with them mesh and materials, interface, loads."""
        inputs: list[Any] = [_VERSION, self.body.interface, self.body.prescribed, self.rows]
        for matrix in (self.body.stiffness, self.body.mass):
            inputs += [matrix.indptr, matrix.indices, matrix.data]
        for system in self.motions.systems:
            inputs += [system.initial_velocity, *(load.forces for load in system.loads)]
        return digest(*inputs)


def compute_in_basis(motions: Motions, store: BasisStore | None = None) -> Outcome | None:
    """Compute motions in a reduced basis; None where the mesh is better."""
    return _where_suitable(motions, store, _compute)


def in_basis(motions: Motions, store: BasisStore | None = None) -> tuple[System, ResidualCheck] | None:
    """Return the system of one motion in a basis, with the check of its errors; None where the mesh is better."""
    return _where_suitable(motions, store, _stepped)


def _where_suitable(motions: Motions, store: BasisStore | None, compute_with: Callable[[_Maker], T]) -> T | None:
    """Return what is made with a reduced basis; None, with a word in the log, where the mesh is better."""
    system = motions.systems[0]
    try:
        interface, rows = _suitable_unknowns(motions)
        moving = len(system.moving_supports)
        body = ConstraintModes(system.stiffness, system.mass, interface, motions.solver, moving)
        return compute_with(_Maker(motions, body, rows, store))
    except (_UnsuitableError, FingerslipError) as reason:
        _logger.warning("no reduced basis: %s; the motion is computed on the mesh", reason)
        return None


def _suitable_unknowns(motions: Motions) -> tuple[Integers, Integers]:
    """Return the unknowns of the interface and those that are read beside it; refuse motions that are better without.

    Arrays: returns (p,), (r,).
    """
    system = motions.systems[0]
    loose = not all(freedom.stiffness for freedom in system.unknowns.freedoms)
    reasons = {
        "supports leave rigid motions free": free_pieces(system.space, system.free),
        f"contact alone holds the {', '.join(system.held_by_contact)}": system.held_by_contact,
        "materials relax": system.viscoelastic,
        "dampers alone hold a rigid body": loose and not has_inertia(motions.models[0]),
    }
    for reason, holds in reasons.items():
        if holds:
            raise _UnsuitableError(reason)
    interface, unknowns = interface_unknowns(motions.systems), system.mass.shape[0]
    if not interface.size or interface.size >= unknowns - 1:
        raise _UnsuitableError(f"{interface.size} of {unknowns} unknowns are those of contact")
    rows = observed_unknowns(motions.models, motions.systems)
    responses = 0 if _is_coarse(motions) else _COPIES * site_unknowns(motions.systems).size
    needed = 8 * (interface.size * (_SQUARES * interface.size + 2 * rows.size) + unknowns * responses)
    available = available_memory()
    if available is not None and needed > available:
        raise _UnsuitableError(f"it needs about {needed / 1e9:.2g} GB, and {available / 1e9:.2g} GB are available")
    return interface, rows


def _is_coarse(motions: Motions) -> bool:
    """Tell whether accelerations may be far off."""
    return (motions.models[0].basis or ReducedBasis()).acceleration_tolerance > _COARSE


def _compute(maker: _Maker) -> Outcome:
    """Compute with ever more normal modes, until the estimated errors are within the tolerances.

    Where there is no basis yet, the first of several motions tries it out for all.
    """
    motions, outcome = maker.motions, None
    share = 1.0 if len(motions.models) == 1 else _SHARE_OF_FIRST
    with maker.alone():
        with motions.watch.part("basis"):
            stored = maker.kept()
            basis = stored or maker.make(maker.fewest(share))
        if stored is None:
            outcome, basis = _suitable(motions.part(slice(1)), maker, basis, share)
            maker.keep(basis)
    if outcome is not None and len(motions.models) == 1:
        return outcome
    outcome, suitable = _suitable(motions, maker, basis)
    if suitable is not basis:
        maker.keep(suitable)
    return outcome


def _suitable(motions: Motions, maker: _Maker, basis: CraigBampton, share: float = 1.0) -> tuple[Outcome, CraigBampton]:
    """Compute some motions in a basis, and in larger ones up to one that suffices for them; return it, too.

    It suffices where errors are within a share of their tolerances, the largest where they are within these.
    """
    wanted, tried = motions.models[0].basis or ReducedBasis(), list[tuple[int, float]]()
    while True:
        systems, check = _reduced(motions, maker, basis)
        outcome = compute(motions, systems, check.motions)
        count, excess = basis.frequencies.size, check.excess(wanted)
        if excess <= (share if count < _MOST else 1.0):
            return replace(outcome, attributes=check.attributes), basis
        tried.append((count, excess))
        fault = f"{count} normal modes leave errors of {check.error:.2g} and {check.acceleration_error:.2g}"
        _logger.info("%s", fault)
        if not _is_promising(tried):
            allowed = f"{wanted.tolerance:g} and {wanted.acceleration_tolerance:g}"
            raise _UnsuitableError(f"{fault}, and the tolerances are {allowed}")
        # The error falls like 1/count.
        times = min(2.0 ** np.ceil(np.log2(max(excess, 2.0))), _MOST_TIMES)
        with motions.watch.part("basis"):
            basis = maker.make(int(min(count * times, max(_MOST, count))))


def _is_promising(tried: Sequence[tuple[int, float]]) -> bool:
    """Tell whether the most normal modes may bring an error to one, from the numbers tried and the errors they left."""
    count, error = tried[-1]
    if len(tried) < 2 or count >= _MOST:
        return count < _MOST
    before, larger = tried[-2]
    order = np.log(larger / error) / np.log(count / before) if count > before else 0.0
    return bool(error <= (_MOST / count) ** order)


def _reduced(motions: Motions, maker: _Maker, basis: CraigBampton) -> tuple[list[System], ResidualCheck]:
    """Return the systems of motions in a basis, and what looks at their residual."""
    with motions.watch.part("basis"):
        first = reduced_system(motions.systems[0], maker.body, basis)
        systems = [first, *(reduced_system(system, maker.body, basis, first) for system in motions.systems[1:])]
        coordinates: Sequence[Any] = [system.coordinates for system in systems]
        return systems, ResidualCheck(motions.models, motions.systems, coordinates, basis)


def _stepped(maker: _Maker) -> tuple[System, ResidualCheck]:
    """Return what :func:`in_basis` does."""
    with maker.motions.watch.part("basis"), maker.alone():
        stored = maker.kept()
        basis = stored or maker.make(_STEPWISE)
        if stored is None:
            maker.keep(basis)
    systems, check = _reduced(maker.motions, maker, basis)
    return systems[0], check
