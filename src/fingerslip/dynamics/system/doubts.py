"""Doubts about a model: what can be computed, but is hardly meant or too coarse to be right."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import chain
from typing import NamedTuple

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.counterfaces import Counterface, sliding_direction
from fingerslip.contact.friction import StaticKinetic
from fingerslip.contact.rows import nodes_along
from fingerslip.dynamics.system.bodies import Motion
from fingerslip.dynamics.system.checks import FACED, CheckedModel, direction_text, inward_normals
from fingerslip.dynamics.system.scheme import has_inertia
from fingerslip.fe.integration import LINEAR_SIMPLICES
from fingerslip.fe.space import boundary_nodes
from fingerslip.model.model import Model
from fingerslip.model.programme import Press, Slide, phase_duration
from fingerslip.model.timing import LEAST_ACROSS, LEAST_STEPS, Adaptive
from fingerslip.units import millimetres

# The softest tissues and gels in use are above; what is below is a number without a unit, as in closed forms [Pa].
_SOFTEST, _PURE = 1e3, 10.0
# Largest angle between neighbouring facets of a tip that touches [degrees], and the gaps that count as one [m].
_LARGEST_TURN, _SAME_GAP = 10, 1e-9
# Dilatational over Young's modulus from which linear triangles and tetrahedra lock: that of a Poisson's ratio of 0.45.
_LOCKS = 3.1
_DEEPEST = 0.9  # press, as a share of the body's height along the normal


class Doubt(NamedTuple):
    """Something that is doubtful in a model: where, what it is, and how to mend it."""

    text: str
    is_measured: bool = False  # whether the measures of a run tell it, as few steps and nodes of its slide


def doubts(model: Model, checked_model: CheckedModel) -> tuple[Doubt, ...]:
    """Return what is doubtful in a model that can be computed."""
    each = chain(_steps(model), _contacts(model, checked_model), _friction(model), _supports_and_materials(model))
    each = chain(each, _locking(model, checked_model))
    return tuple(dict.fromkeys(each))


def _steps(model: Model) -> Iterator[Doubt]:
    """Yield the phases with few steps; steps that control their error are as short as it asks for."""
    if isinstance(model.time, Adaptive):
        return
    # Without inertia a press is a row of equilibria: ten steps in place of forty move slip by less than 0.3 %.
    judged = (Press, Slide) if has_inertia(model) else (Slide,)
    named: set[tuple[type, float]] = set()  # of phases that are alike the first stands for all
    lasting = Counter(round(phase_duration(phase), 6) for programme in model.programmes for phase in programme)
    for number, phase in ((number, phase) for programme in model.programmes for number, phase in enumerate(programme)):
        duration = phase_duration(phase)
        kind = type(phase), round(duration / model.time.step, 6)
        # Many phases of one duration are the samples of a motion.
        is_sample = lasting[round(duration, 6)] >= LEAST_STEPS
        is_short = duration < (LEAST_STEPS - 1e-6) * model.time.step
        if isinstance(phase, judged) and is_short and not is_sample and kind not in named:
            named.add(kind)
            yield Doubt(
                f"programme.{number}: the {type(phase).__name__.lower()} takes {duration / model.time.step:.3g} steps, "
                f"and fewer than {LEAST_STEPS} are too coarse for the times of slip: write a step of "
                f"{1e3 * duration / LEAST_STEPS:.2g} ms or less",
                is_measured=isinstance(phase, Slide),
            )


def _contacts(model: Model, checked_model: CheckedModel) -> Iterator[Doubt]:
    """Yield the contacts along their boundary, those that never touch and those of few elements."""
    for number, (contact, counterface, motion) in enumerate(
        zip(model.contacts, checked_model.counterfaces, checked_model.motions, strict=True)
    ):
        where = f"contacts.{number}"
        inwards, corners = inward_normals(model, contact.boundary)
        faced = np.sum(inwards * counterface.normals(corners.mean(axis=1).T), axis=1)
        if model.is_loaded:
            continue
        points = checked_model.space.positions[boundary_nodes(checked_model.space, contact.boundary)]
        gaps = counterface.gap(points)
        heights = checked_model.space.positions @ counterface.unit_normal
        approach = float(np.max(motion.positions @ counterface.unit_normal))
        reached = int((gaps < approach).sum())
        near = np.any([counterface.gap(corner.T) < approach for corner in corners.swapaxes(0, 1)], axis=0)
        across = reached if points.shape[1] == 2 else nodes_along(points[gaps < approach], _along(motion, counterface))
        if not reached:
            yield Doubt(
                f"{where}: never touches '{contact.boundary}', which is {millimetres(float(gaps.min()))} away while "
                f"the counterface comes {millimetres(max(approach, 0.0))} nearer: press deeper, or start nearer"
            )
        elif (depth := approach - float(gaps.min())) > _DEEPEST * (height := float(np.ptp(heights))):
            fault = f"is pressed {millimetres(depth)} deep into a body of {millimetres(height)}"
            yield Doubt(f"{where}: {fault} along its normal: press less deep, and check the units of depth and mesh")
        elif faced[near].max(initial=-1.0) < FACED:
            fault = f"its normal {direction_text(counterface.unit_normal)} runs along '{contact.boundary}'"
            normal = direction_text(inwards[near].mean(axis=0))
            yield Doubt(f"{where}.counterface: {fault} and meets only an edge: take the normal {normal}")
        elif across < LEAST_ACROSS:
            rows = f"{across} along the slide, " if points.shape[1] == 3 else ""
            yield Doubt(
                f"{where}: {reached} nodes of '{contact.boundary}' are in reach of the counterface, {rows}"
                f"and fewer than {LEAST_ACROSS} across the contact are too coarse for the times of slip: "
                "take smaller elements there",
                is_measured=True,
            )
        else:
            turn, size = _turn_where_nearest(counterface, inwards, corners)
            if turn > _LARGEST_TURN:
                yield Doubt(
                    f"{where}: where '{contact.boundary}' touches first it turns by {turn:.0f} degrees from one "
                    f"element to the next, and more than {_LARGEST_TURN} are too coarse for the times of slip: take "
                    f"elements of about {millimetres(size * _LARGEST_TURN / turn, 2)} there"
                )


def _turn_where_nearest(counterface: Counterface, inwards: Floats, corners: Floats) -> tuple[float, float]:
    """Return the largest angle [degrees] between facets at the corner nearest to a counterface, and their length [m].

    Few nodes of a ridge touch, however many lie above the level to which the counterface comes.
    """
    gaps = np.array([counterface.gap(points.T) for points in corners.swapaxes(0, 1)])
    # All facets of a flat boundary are nearest; those of its sides that share a corner face elsewhere.
    nearest = np.any(gaps < gaps.min() + _SAME_GAP, axis=0) & (inwards @ counterface.unit_normal > FACED)
    normals = np.unique(inwards[nearest].round(6), axis=0)
    turn = np.degrees(np.arccos(np.clip((normals @ normals.T).min(initial=1.0), -1.0, 1.0)))
    lengths = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=0)
    return float(turn), float(lengths[nearest].max(initial=0.0))


def _along(motion: Motion, counterface: Counterface) -> Floats:
    """Return the unit direction (dim,) in which a counterface travels furthest along its surface."""
    normal = counterface.unit_normal
    travel = motion.positions - np.outer(motion.positions @ normal, normal)
    furthest = travel[np.linalg.norm(travel, axis=1).argmax()]
    length = np.linalg.norm(furthest)
    return np.asarray(furthest / length) if length > 0.0 else sliding_direction(normal)


def _friction(model: Model) -> Iterator[Doubt]:
    """Yield the contacts whose stick-slip would ring: where slip ends, a free mass hangs on the tangential penalty."""
    if model.damping.stiffness or not has_inertia(model):
        return
    for number, contact in enumerate(model.contacts):
        body = contact.rigid_body
        if isinstance(contact.friction, StaticKinetic) and body is not None and model.bodies[body].free:
            yield Doubt(
                f"contacts.{number}.friction: falls from static to kinetic on '{body}', which is free and rings on the "
                "tangential penalty: its slips move with the step: write a damping with a stiffness, such as 1 ms"
            )


def _supports_and_materials(model: Model) -> Iterator[Doubt]:
    if model.contacts and not (model.supports or model.gravity or model.initial_velocity):
        text = "there are none, so the counterface pushes the whole body away: support a boundary or a region"
        yield Doubt(f"supports: {text}")
    for name, material in model.materials.items():
        if _PURE <= material.stiffness < _SOFTEST:
            value = material.stiffness
            yield Doubt(
                f"materials.{name}: a modulus of {value:.4g} Pa is softer than any tissue or elastomer: "
                f"if {value:.4g} kPa are meant, write {value:.4g}e3"
            )


def _locking(model: Model, checked_model: CheckedModel) -> Iterator[Doubt]:
    """Yield that cells which bend only by changing their volume are of a material that hardly can."""
    if checked_model.space.element not in LINEAR_SIMPLICES or model.integration == "nodal":
        return
    layers = [
        len(cells)
        for material, cells in checked_model.materials
        if material.dilatational_modulus(model.formulation) > _LOCKS * material.stiffness
    ]
    if layers:
        cells = "triangles" if checked_model.space.dim == 2 else "tetrahedra"
        share = f"{100.0 * sum(layers) / model.mesh.nelements:.0f} % of the cells are linear {cells}"
        repair = "write integration: nodal, or take a mesh of quadratic ones"
        yield Doubt(f"integration: {share} of a nearly incompressible material, which lock, too stiff: {repair}")
