"""Everything about a model that can be wrong without solving it."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import repeat

import numpy as np

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.contact.candidates import Candidates, automatic_penalty, find_candidates
from fingerslip.contact.counterfaces import Counterface, Cylinder
from fingerslip.dynamics.recording.schedule import record_bytes, require_record_memory
from fingerslip.dynamics.system.bodies import (
    Load,
    Motion,
    check_bodies,
    contact_motion,
    largest_approach,
    model_loads,
    phase_table,
    programme_place,
    require_components,
    unheld_bodies,
)
from fingerslip.dynamics.system.scheme import has_inertia
from fingerslip.errors import InputError, Mistakes
from fingerslip.fe.cell_materials import CellMaterials, cell_materials, finite_cell_materials, small_strain_law
from fingerslip.fe.space import Space, boundary_nodes, build_space, free_pieces, nodal_areas, region_nodes, vector_dofs
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.material import Material
from fingerslip.materials.prony import recurrence
from fingerslip.mesh.facets import are_degenerate, inner_facets, outward_normals, site_nodes
from fingerslip.model.model import Contact, Model
from fingerslip.model.programme import Slide
from fingerslip.model.timing import shortest_step
from fingerslip.units import coordinates, millimetres


def contact_penalties(model: Model, contact: Contact) -> tuple[float, float]:
    """Return normal and tangential penalty of a contact [Pa/m].

    Without given values, they follow from the stiffest material under the boundary and the size of its facets.
    """
    mesh = model.mesh
    facets = np.asarray(mesh.boundaries[contact.boundary])
    facets = facets[~are_degenerate(mesh)[facets]]
    cells = mesh.f2t[0, facets]
    # A mesh may name further groups of cells that have no material of their own.
    touched = [name for name in model.materials if np.isin(cells, mesh.subdomains[name]).any()]
    stiffness = max(model.materials[name].stiffness for name in touched)
    ends = mesh.p[:, mesh.facets[:2, facets]]
    size = float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0)))
    automatic = automatic_penalty(stiffness, size)
    return contact.normal_penalty or automatic, contact.tangential_penalty or automatic


# Candidates lie within this many times the approach of the counterface: the skin beside the contact bulges towards
# the counterface and rolls onto it while sliding.
_SEARCH = 1.5
# The mean of the unit normals of facets is shorter where they go round the body, and says no direction.
_ONE_SIDED = 0.1
#: Least cosine between the normals of a counterface and of a facet, inwards, that faces it.
FACED = 0.25
# Of the largest extent of a body: how far it is in a counterface at the start beyond rounding.
_INSIDE = 1e-6

# Of the soft thickness. A mean strain of a half is small in no sense (the published press is less than a third); one
# of 99 % leaves nothing that could be a body.
_LARGEST_SHARE = 0.5
_WHOLE_SHARE = 0.99

_logger = logging.getLogger("fingerslip.dynamics")


@dataclass(frozen=True)
class CheckedModel:
    """What the checks of a model have found out, before anything is assembled."""

    space: Space  # displacement space of the mesh
    materials: CellMaterials[Material]  # material of every cell at small strain
    finite_materials: CellMaterials[FiniteMaterial] | None  # those at large strain
    held: Mapping[str, Integers]  # (k,), degrees of freedom that each support holds
    free: Integers  # (n_free,), those that none holds
    # bodies with a rigid motion that inertia, supports and springs leave to the contact, as errors name them
    held_by_contact: tuple[str, ...]
    loads: tuple[Load, ...]  # tractions and gravity on all degrees of freedom of the mesh
    counterfaces: tuple[Counterface, ...]  # the counterfaces, placed at their start
    motions: tuple[Motion, ...]  # prescribed motion of each
    candidates: tuple[Candidates, ...]  # contact candidates of each
    site_nodes: Integers  # (n_sites,), mesh nodes of the recorded sites


def inspect_model(model: Model, space: Space | None = None) -> CheckedModel:
    """Find out whether a model can be computed, with the space of its mesh where that is known."""
    space = space or build_space(model.mesh)
    mistakes, numbers = Mistakes(), range(len(model.contacts))
    with mistakes.collect():
        materials = cell_materials(space, model.materials, model.formulation)
    held = _check_independently(model, space, mistakes)
    mistakes.raise_all()
    finite = finite_cell_materials(space, model.materials, model.formulation) if model.is_finite else None
    for name, material in model.materials.items():
        terms = getattr(small_strain_law(material), "prony", ())
        recurrence(terms, shortest_step(model.time), f"materials.{name}.prony")
    check_bodies(model)
    counterfaces = tuple(_at_start(model, space, number) for number in numbers)
    for number, counterface in enumerate(counterfaces):
        if counterface.gap(space.positions).min() < -_INSIDE * np.ptp(space.positions, axis=0).max():
            _require_facing(model, number, counterface, -FACED)
    motions = tuple(contact_motion(model, number) for number in numbers)
    candidates = tuple(map(_candidates, repeat(model), repeat(space), numbers, counterfaces, motions))
    _check_order(model, counterfaces, motions, candidates)
    require_record_memory(
        model, record_bytes(model, len(space.positions), sum(len(candidate.nodes) for candidate in candidates))
    )
    free = np.delete(np.arange(space.n_dofs), np.concatenate([np.empty(0, dtype=np.int64), *held.values()]))
    if not free.size:
        raise InputError("supports", "fix every degree of freedom", "something has to be free to move")
    held_by_contact = () if has_inertia(model) else _unheld(model, space, free, candidates)
    if model.is_finite and held_by_contact:
        # The tangent of a body that supports do not hold is singular.
        fault = f"leave it to contact alone to hold {', '.join(held_by_contact)}"
        repair = "support it, take TimeStepping, or kinematics 'small'"
        raise InputError("supports", fault, "at large strain a body without inertia needs supports", repair)
    if not model.support_motions:
        _check_depth(model, space, counterfaces, motions, free)
    # Sites are looked for once in a space.
    sites = model.record.sites
    if sites not in space.nodes_by_sites:
        space.nodes_by_sites[sites] = site_nodes(model.mesh, sites)
    return CheckedModel(
        space=space,
        materials=materials,
        finite_materials=finite,
        held=held,
        free=free,
        held_by_contact=held_by_contact,
        loads=model_loads(model, space, materials),
        counterfaces=counterfaces,
        motions=motions,
        candidates=candidates,
        site_nodes=space.nodes_by_sites[sites],
    )


def _require_outside(model: Model, space: Space, number: int) -> None:
    """Refuse a contact boundary with facets that no counterface can reach, such as a wrong face in a deck."""
    mesh, boundary = model.mesh, model.contacts[number].boundary
    boundary_nodes(space, boundary, f"contacts.{number}.boundary")
    inside = inner_facets(mesh, boundary)
    if not len(inside):
        return
    is_beside = (mesh.f2t[1] < 0) & np.isin(mesh.f2t[0], mesh.f2t[:, inside]) & ~are_degenerate(mesh)
    beside = np.flatnonzero(is_beside)
    of_them = [name for name, facets in mesh.boundaries.items() if np.isin(beside, facets).any()]
    named = f", such as those of {', '.join(of_them)}" if of_them else ""
    repair = "name outside facets: another face of the same cells (in Abaqus S2 in place of S4, say)"
    if not len(beside):
        repair, named = "name facets on the outside", ""
    count = len(mesh.boundaries[boundary])
    share = f"{len(inside)} of the {count}" if len(inside) < count else f"all {count}"
    fault = f"{share} facets of '{boundary}' lie inside the body"
    raise InputError(f"contacts.{number}.boundary", fault, "needs facets on the outside", f"{repair}{named}")


def _at_start(model: Model, space: Space, number: int) -> Counterface:
    """Return the counterface of a contact at its start: where none is given at the clearance from the boundary."""
    contact = model.contacts[number]
    skin = space.positions[boundary_nodes(space, contact.boundary)]
    placed = contact.counterface.at_start(skin - contact.clearance * contact.counterface.unit_normal)
    if contact.clearance > 0.0 and placed is contact.counterface:
        fault = f"got {millimetres(contact.clearance)} for a counterface whose start is given"
        repair = "leave out its offset or centre, or the clearance"
        raise InputError(f"contacts.{number}.clearance", fault, "needs a counterface without a given start", repair)
    return placed


def _check_contact(model: Model, space: Space, number: int) -> None:
    """Refuse a counterface and a friction law of another dimension than the mesh, and a drive without inertia."""
    contact, where, dim = model.contacts[number], f"contacts.{number}", space.dim
    counterface, law = contact.counterface, contact.friction
    if counterface.dim != dim:
        if not isinstance(counterface, Cylinder):
            raise InputError(f"{where}.counterface.normal", f"got {counterface.dim} components", f"needs {dim}")
        fault, allowed, repair = f"got {counterface.axis}", "needs a direction in 3D and none in 2D", ""
        if dim == 3:
            fault, allowed = "is missing", "needs a direction in 3D"
            repair = "write for example normal: [0, 1, 0] and axis: [0, 0, 1], perpendicular to it"
        raise InputError(f"{where}.counterface.axis", fault, allowed, repair)
    if dim not in law.dims:
        fault = f"got {type(law).__name__} in {dim} dimensions"
        raise InputError(f"{where}.friction", fault, f"needs {' or '.join(map(str, law.dims))}")
    if contact.drive and not has_inertia(model):
        fault = "got a force that drives a counterface in a model without inertia"
        raise InputError(f"{where}.drive", fault, "needs prescribed motion", "take TimeStepping")


def _check_initial_velocity(model: Model, dim: int) -> None:
    if model.initial_velocity is not None:
        require_components("initial_velocity", model.initial_velocity, dim)
        if any(model.initial_velocity) and not has_inertia(model):
            fault, repair = "is given for a model without inertia", "take TimeStepping, or leave it out"
            raise InputError("initial_velocity", fault, "needs steps with inertia", repair)


def _check_independently(model: Model, space: Space, mistakes: Mistakes) -> dict[str, Integers]:
    """Check what needs nothing that another one checks; return the degrees of freedom that each support holds, (k,).

    A support is a boundary, or a region where no boundary has the name.
    """
    for number in range(len(model.contacts)):
        for check_contact in (_require_outside, _check_contact):
            with mistakes.collect():
                check_contact(model, space, number)
    held, axes = {}, "xyz"[: space.dim]
    for name, components in model.supports.items():
        where, beyond = f"supports.{name}", [component for component in components if component not in axes]
        is_region = name not in (space.mesh.boundaries or {}) and name in (space.mesh.subdomains or {})
        with mistakes.collect():
            nodes = region_nodes(space, name) if is_region else boundary_nodes(space, name, where)
            held[name] = vector_dofs(nodes, space.dim)[:, [axes.find(component) for component in components]].ravel()
        with mistakes.collect():
            if beyond:
                allowed = f"needs {'x or y' if space.dim == 2 else 'x, y or z'}"
                raise InputError(where, f"got component '{beyond[0]}'", allowed)
    for name in model.tractions:
        with mistakes.collect():
            boundary_nodes(space, name, f"tractions.{name}")
    for check in (_check_initial_velocity, _check_support_motions):
        with mistakes.collect():
            check(model, space.dim)
    return held


def _check_support_motions(model: Model, dim: int) -> None:
    """Refuse motion of what is no support, and in components that a support leaves free."""
    for name, motion in model.support_motions.items():
        where = f"support_motions.{name}"
        if name not in model.supports:
            names = ", ".join(model.supports) or "none"
            raise InputError(where, "moves what is no support", f"the supports are: {names}")
        require_components(f"{where}.displacement", motion.displacement, dim)
        for component, moved in zip("xyz", motion.displacement, strict=False):
            if moved and component not in model.supports[name]:
                fault, allowed = f"moves along {component}", f"the support holds {', '.join(model.supports[name])}"
                repair = f"hold {component} as well, or write 0 there"
                raise InputError(f"{where}.displacement", fault, allowed, repair)


def _unheld(model: Model, space: Space, free: Integers, candidates: tuple[Candidates, ...]) -> tuple[str, ...]:
    """Return the bodies that only contact holds; refuse pieces of the mesh without contact."""
    pieces = free_pieces(space, free)
    touching = np.concatenate([np.zeros(0, dtype=np.int64), *(candidate.nodes for candidate in candidates)])
    for piece in pieces:
        if not np.isin(piece.nodes, touching).any():
            fault = f"leave {', '.join(piece.motions)} free"
            repair = "support it or let it touch a counterface"
            if len(pieces) > 1 or len(piece.nodes) < len(space.positions):
                fault = f"{fault}, of the piece around {coordinates(space.positions[piece.nodes].mean(axis=0))}"
            elif not model.contacts:
                repair = "support it, or take TimeStepping"
            raise InputError("supports", fault, "have to hold a body without inertia", repair)
    return (*(("body",) if pieces else ()), *unheld_bodies(model.bodies))


def _candidates(model: Model, space: Space, number: int, counterface: Counterface, motion: Motion) -> Candidates:
    contact = model.contacts[number]
    size = float(np.ptp(space.positions, axis=0).max())
    automatic = np.inf if model.is_loaded else _SEARCH * largest_approach(motion, counterface) + 1e-6 * size
    candidates = find_candidates(
        counterface,
        space.positions,
        boundary_nodes(space, contact.boundary),
        nodal_areas(space, contact.boundary, model.depth),
        counterface=number,
        search_distance=automatic if contact.search_distance is None else contact.search_distance,
        penalties=contact_penalties(model, contact),
        where=f"contacts.{number}",
    )
    offsets = candidates.positions - candidates.positions[0]
    if space.dim == 3 and counterface.is_flat and np.linalg.matrix_rank(offsets, 1e-9 * size) < 2:
        fault = f"meets {len(offsets)} nodes of '{contact.boundary}', all on a line"
        normal = direction_text(inward_normals(model, contact.boundary)[0].mean(axis=0))
        repair = f"this boundary takes a plate with the normal {normal}"
        raise InputError(f"contacts.{number}.counterface", fault, "needs to meet more than an edge", repair)
    return candidates


def inward_normals(model: Model, boundary: str) -> tuple[Floats, Floats]:
    """Return unit normals (k, dim) of the facets of a boundary, into the body, and their corners (dim, ., k) [m]."""
    facets = np.asarray(model.mesh.boundaries[boundary])
    facets = facets[~are_degenerate(model.mesh)[facets]]
    normals = outward_normals(model.mesh, facets, model.mesh.f2t[0, facets])
    return -normals.T, model.mesh.p[:, model.mesh.facets[:, facets]]


def direction_text(direction: Floats) -> str:
    """Return the unit vector along `direction` (dim,), a mean of unit normals, in words."""
    length = np.linalg.norm(direction)
    if length < _ONE_SIDED:
        return "of one of its sides"
    unit = np.round(direction / length, 3) + 0.0
    return f"({', '.join(f'{value:.3g}' for value in unit)})"


def _check_order(
    model: Model, counterfaces: tuple[Counterface, ...], motions: tuple[Motion, ...], candidates: tuple[Candidates, ...]
) -> None:
    """Refuse programmes that slide before any counterface can touch."""
    first = [
        next((number for number, phase in enumerate(programme) if isinstance(phase, Slide)), None)
        for programme in model.programmes
    ]
    if not model.contacts or model.is_loaded or all(number is None for number in first):
        return
    for number, programme, counterface, motion, candidate in zip(
        first, model.programmes, counterfaces, motions, candidates, strict=True
    ):
        before = motion.positions[: 1 + (len(programme) if number is None else number)]
        if float(np.max(before @ counterface.unit_normal)) > counterface.gap(candidate.positions).min():
            return
    kinds = ", ".join(phase_table(model.programme)[0])
    raise InputError(
        "programme",
        f"slides before the counterface touches (phases: {kinds})",
        "needs contact before the first slide",
        "put a press before it that is deeper than the gap",
    )


def _check_depth(
    model: Model,
    space: Space,
    counterfaces: tuple[Counterface, ...],
    motions: tuple[Motion, ...],
    free: Integers,
) -> None:
    """Refuse motion that brings a counterface through what is held, and warn where strains cannot be small."""
    held = ~np.isin(vector_dofs(np.arange(len(space.positions)), space.dim), free)
    for number, (contact, counterface, motion) in enumerate(zip(model.contacts, counterfaces, motions, strict=True)):
        skin = boundary_nodes(space, contact.boundary)
        stopped: Flags = np.all(held[:, np.abs(counterface.unit_normal) > 1e-9], axis=1)
        lowest = float(counterface.gap(space.positions[skin]).min())
        inner = stopped & ~np.isin(np.arange(len(stopped)), skin)
        behind = space.positions[inner & (counterface.gap(space.positions) > lowest)]
        # Where the contact is held itself, nothing gives way and the penalties take up the press.
        if stopped[skin].all() or not len(behind):
            continue
        thickness = float(counterface.gap(behind).min()) - lowest
        depth = thickness - min(float(counterface.gap(behind - position).min()) for position in motion.positions)
        where = programme_place(model, number)
        between = f"the {thickness * 1e3:.4g} mm between the contact and what the supports hold"
        if depth > _WHOLE_SHARE * thickness:
            _require_facing(model, number, counterface)
            fault = f"presses {depth * 1e3:.4g} mm deep"
            raise InputError(where, fault, f"needs less than {between}", "press less deep")
        if depth > _LARGEST_SHARE * thickness and not model.is_finite:
            _logger.warning(
                "%s: presses %.4g mm deep, %.0f %% of %s; strains are taken as small, so results are rough: "
                "take kinematics 'finite'",
                *(where, depth * 1e3, 100 * depth / thickness, between),
            )


def _require_facing(model: Model, number: int, counterface: Counterface, least: float = FACED) -> None:
    """Refuse a counterface that presses along its boundary or out of it, as where a mesh lies in another direction.

    `least` is the cosine between its normal and the mean one of the boundary, inwards.
    """
    boundary = model.contacts[number].boundary
    inwards = inward_normals(model, boundary)[0].mean(axis=0)
    length = float(np.linalg.norm(inwards))
    if length < _ONE_SIDED or inwards @ counterface.unit_normal >= least * length:
        return
    normal = direction_text(inwards)
    along = direction_text(counterface.unit_normal)
    fault = f"presses along {along} while '{boundary}' faces {direction_text(-inwards)}"
    place = f"contacts.{number}.counterface.normal"
    raise InputError(place, fault, f"needs a normal into the body, {normal}", f"write normal: [{normal[1:-1]}]")
