"""A flat plate opposite what holds an object: a stiff slab that a grip force presses, and that does not slide itself.

Two rigid faces that stick would not say which of them bears how much, so the plate's face is a slab of 1 GPa. It lies
on a rigid body that only moves along the grip, and sticks to that whatever the load is.
"""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.materials.elastic import Elastic
from fingerslip.model.model import Contact, Model
from fingerslip.model.rigid_bodies import BodyLoad, RigidBody

if TYPE_CHECKING:
    import skfem

#: Name of the rigid body that presses.
PLATE = "plate"

_BODY = "body_"
_SLAB = Elastic(1e9, 0.3, 1000.0)
_HALF_WIDTH, _THICKNESS, _CELLS = 5e-3, 1e-3, 4  # [m] of the slab; cells along it
# Penetrations far below a micrometre under newtons [Pa/m], friction that no load exceeds, and a light body [kg].
_PENALTY, _STICKS, _MASS = 1e11, 100.0, 1e-3


def with_plate(model: Model, friction: Coulomb, held: str, grip: BodyLoad) -> Model:
    """Return a model whose contact touches the rigid body `held`, with a plate behind that, which a grip presses."""
    normal = (0.0, 1.0, 0.0)[: model.mesh.dim()]
    face = Contact(
        f"{PLATE}_face",
        Plane(tuple(-part for part in normal)),
        friction,
        normal_penalty=_PENALTY,
        tangential_penalty=_PENALTY,
        rigid_body=held,
    )
    back = replace(
        face, boundary=f"{PLATE}_back", counterface=Plane(normal), friction=Coulomb(_STICKS), rigid_body=PLATE
    )
    return replace(
        model,
        mesh=model.mesh if f"{PLATE}_slab" in model.mesh.subdomains else join_slab(model.mesh),
        materials={**model.materials, f"{PLATE}_slab": _SLAB},
        contacts=(*model.contacts, face, back),
        bodies={**model.bodies, PLATE: RigidBody(mass=_MASS, free=("y",), loads=(grip,))},
        # Supports do not hold the slab.
        basis=None,
    )


def join_slab(mesh: Any) -> Any:
    """Return a mesh with a slab under its lowest point: region `plate_slab`, boundaries `plate_face`, `plate_back`.

    The names of the mesh stay.
    """
    # Slow to load.
    from fingerslip.mesh.joining import STRAIGHT, join_meshes

    kind, lowest = type(mesh), mesh.p[:, np.argmin(mesh.p[1])]
    along = np.linspace(-_HALF_WIDTH, _HALF_WIDTH, _CELLS + 1)
    # A half that is cut at z = 0 has a half of the slab.
    across = along if mesh.dim() == 3 and mesh.p[2].min() < -1e-9 else along[_CELLS // 2 :]
    axes = (along, np.array([-_THICKNESS, 0.0]), across)[: mesh.dim()]
    slab = STRAIGHT.get(kind, kind).init_tensor(*axes)
    if _turn(slab) != _turn(mesh):
        # Its mirror image has the same shape.
        slab = dataclasses.replace(slab, doflocs=slab.doflocs * np.array([-1.0, 1.0, 1.0])[: mesh.dim(), None])
    shift = np.array([lowest[0], lowest[1], 0.0][: mesh.dim()])
    slab = slab.translated(tuple(shift.tolist()))
    if kind is not type(slab):
        slab = kind.from_mesh(slab)
    top = float(slab.p[1].max())
    faces = {
        "face": slab.facets_satisfying(lambda at: at[1] > top - 0.1 * _THICKNESS, boundaries_only=True),
        "back": slab.facets_satisfying(lambda at: at[1] < top - 0.9 * _THICKNESS, boundaries_only=True),
    }
    slab = slab.with_subdomains({"slab": np.arange(slab.nelements)}).with_boundaries(faces)
    joined = join_meshes({_BODY[:-1]: mesh, PLATE: slab})
    regions, boundaries = (
        {name.removeprefix(_BODY): members for name, members in table.items()}
        for table in (joined.subdomains, joined.boundaries)
    )
    return dataclasses.replace(joined, _subdomains=regions, _boundaries=boundaries)


def _turn(mesh: skfem.Mesh) -> bool:
    """Tell whether the corners of the first cell turn as the axes do."""
    middle = np.full((mesh.dim(), 1), 0.25)
    return bool(mesh.mapping().detDF(middle, tind=np.array([0]))[0, 0] > 0.0)
