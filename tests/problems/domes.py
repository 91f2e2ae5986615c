"""A small half dome in 3D that is pressed and slid along its plane of symmetry."""

import dataclasses

import numpy as np
import skfem

import fingerslip as fs
from fingerslip.contact.friction import StaticKinetic

_SPAN, _HEIGHT, _CURVATURE = 5e-3, 4e-3, 30.0


def dome_mesh():
    """Return a block whose lower side is a paraboloid; boundaries ``skin``, ``top`` and ``symmetry``."""
    axes = np.linspace(-_SPAN, _SPAN, 9), np.linspace(0.0, _HEIGHT, 4), np.linspace(0.0, _SPAN, 5)
    block = skfem.MeshTet.init_tensor(*axes)
    points = block.p.copy()
    bulge = _CURVATURE * (points[0] ** 2 + points[2] ** 2)
    lower = block.facets_satisfying(lambda at: at[1] < 1e-9, boundaries_only=True)
    points[1] += bulge * (1.0 - points[1] / _HEIGHT)
    mesh = skfem.MeshTet(points, block.t)
    faces = {
        "skin": lower,
        "top": mesh.facets_satisfying(lambda at: at[1] > _HEIGHT - 1e-9, boundaries_only=True),
        "symmetry": mesh.facets_satisfying(lambda at: at[2] < 1e-9, boundaries_only=True),
    }
    return mesh.with_boundaries(faces).with_subdomains({"bulk": np.arange(mesh.t.shape[1])})


def pressed_dome(normal=(0.0, 1.0, 0.0), **changes):
    """Return the model of the dome, pressed by 0.4 mm and slid by 1.5 mm, with static and kinetic friction."""
    friction = StaticKinetic(static=0.8, kinetic=0.5, decay_speed=1e-3)
    contact = fs.Contact("skin", fs.Plane(normal), friction, normal_penalty=1e9, tangential_penalty=1e9)
    model = fs.Model(
        mesh=dome_mesh(),
        materials={"bulk": fs.Elastic(1e5, 0.45, 1000.0)},
        formulation="solid",
        depth=1.0,
        supports={"top": ("x", "y", "z"), "symmetry": ("z",)},
        contacts=(contact,),
        programme=(fs.Press(0.4e-3, 1e-3), fs.Slide(1.5e-3, 0.3e-3)),
        time=fs.QuasiStatic(0.1),
        record=fs.Recording(sites=(fs.Site("crown", "marker", (0.0, 0.0, 0.0)),)),
    )
    return dataclasses.replace(model, **changes)
