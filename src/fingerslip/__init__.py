"""Finite-element toolkit for fingertip slip.

The public names below are loaded when they are first used, so that ``import fingerslip`` is quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fingerslip.contact.counterfaces import Cylinder, Plane, Sphere
    from fingerslip.contact.friction import Anisotropic, Coulomb, PressureDependent, StaticKinetic
    from fingerslip.dynamics.simulation import simulate, simulate_together
    from fingerslip.errors import (
        ConvergenceError,
        FingerslipError,
        InputError,
        MeshError,
        ResultError,
        SlipOutsideContactError,
    )
    from fingerslip.history import read_history, write_history
    from fingerslip.materials.damping import RayleighDamping
    from fingerslip.materials.elastic import Elastic
    from fingerslip.mesh.io import read_mesh, write_mesh
    from fingerslip.mesh.quality import quality_table
    from fingerslip.mesh.scan.build import ScanMesh, SurfaceMesh, mesh_scan
    from fingerslip.mesh.scan.layered import LayerSizes, build_from_surfaces
    from fingerslip.mesh.scan.offset import decimate_surface, offset_inwards
    from fingerslip.mesh.scan.placement import (
        Placement,
        place_surface,
        placement_from_directions,
        placement_from_landmarks,
    )
    from fingerslip.mesh.scan.repair import repair_surface
    from fingerslip.mesh.scan.surfaces import Surface, read_surface, write_surface
    from fingerslip.model import (
        Contact,
        Drive,
        Hold,
        Lift,
        Model,
        Press,
        QuasiStatic,
        Ramp,
        Recording,
        Slide,
        TimeStepping,
        Traction,
    )
    from fingerslip.sites import Site
    from fingerslip.slip import Events, SlipEvents, acceleration_peaks, find_events
    from fingerslip.specimens.fingertip import Fingertip, fingertip_from, preset, preset_names, preset_table
    from fingerslip.specimens.fingertip.meshing.section.source import MeshSizes, build_section
    from fingerslip.specimens.fingertip.meshing.solid.source import SolidSizes, build_solid
    from fingerslip.specimens.fingertip.receptors import receptor_sites
    from fingerslip.specimens.fingertip.solid_sites import reference_sites, solid_receptor_sites
    from fingerslip.study.definition.spec import Study, read_study, study_schema
    from fingerslip.study.running.runner import StudyFailedError, StudyResult, run_study

    __version__: str

_HOMES = {
    "specimens.fingertip": ("Fingertip", "fingertip_from", "preset", "preset_names", "preset_table"),
    "contact.counterfaces": ("Cylinder", "Plane", "Sphere"),
    "contact.friction": ("Anisotropic", "Coulomb", "PressureDependent", "StaticKinetic"),
    "dynamics.simulation": ("simulate", "simulate_together"),
    "errors": (
        "ConvergenceError",
        "FingerslipError",
        "InputError",
        "MeshError",
        "ResultError",
        "SlipOutsideContactError",
    ),
    "history": ("read_history", "write_history"),
    "materials.damping": ("RayleighDamping",),
    "materials.elastic": ("Elastic",),
    "mesh.io": ("read_mesh", "write_mesh"),
    "mesh.scan.layered": ("LayerSizes", "build_from_surfaces"),
    "mesh.scan.offset": ("decimate_surface", "offset_inwards"),
    "mesh.scan.placement": ("Placement", "place_surface", "placement_from_directions", "placement_from_landmarks"),
    "mesh.quality": ("quality_table",),
    "mesh.scan.repair": ("repair_surface",),
    "mesh.scan.build": ("ScanMesh", "SurfaceMesh", "mesh_scan"),
    "specimens.fingertip.meshing.section.source": ("MeshSizes", "build_section"),
    "sites": ("Site",),
    "specimens.fingertip.receptors": ("receptor_sites",),
    "specimens.fingertip.meshing.solid.source": ("SolidSizes", "build_solid"),
    "specimens.fingertip.solid_sites": ("reference_sites", "solid_receptor_sites"),
    "mesh.scan.surfaces": ("Surface", "read_surface", "write_surface"),
    "model": (
        "Contact",
        "Drive",
        "Hold",
        "Lift",
        "Model",
        "Press",
        "QuasiStatic",
        "Ramp",
        "Recording",
        "Slide",
        "TimeStepping",
        "Traction",
    ),
    "slip": ("Events", "SlipEvents", "acceleration_peaks", "find_events"),
    "study.running.runner": ("StudyFailedError", "StudyResult", "run_study"),
    "study.definition.spec": ("Study", "read_study", "study_schema"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "Anisotropic",
    "Contact",
    "ConvergenceError",
    "Coulomb",
    "Cylinder",
    "Drive",
    "Elastic",
    "Events",
    "FingerslipError",
    "Fingertip",
    "Hold",
    "InputError",
    "LayerSizes",
    "Lift",
    "MeshError",
    "MeshSizes",
    "Model",
    "Placement",
    "Plane",
    "Press",
    "PressureDependent",
    "QuasiStatic",
    "Ramp",
    "RayleighDamping",
    "Recording",
    "ResultError",
    "ScanMesh",
    "Site",
    "Slide",
    "SlipEvents",
    "SlipOutsideContactError",
    "SolidSizes",
    "Sphere",
    "StaticKinetic",
    "Study",
    "StudyFailedError",
    "StudyResult",
    "Surface",
    "SurfaceMesh",
    "TimeStepping",
    "Traction",
    "__version__",
    "acceleration_peaks",
    "build_from_surfaces",
    "build_section",
    "build_solid",
    "decimate_surface",
    "find_events",
    "fingertip_from",
    "mesh_scan",
    "offset_inwards",
    "place_surface",
    "placement_from_directions",
    "placement_from_landmarks",
    "preset",
    "preset_names",
    "preset_table",
    "quality_table",
    "read_history",
    "read_mesh",
    "read_study",
    "read_surface",
    "receptor_sites",
    "reference_sites",
    "repair_surface",
    "run_study",
    "simulate",
    "simulate_together",
    "solid_receptor_sites",
    "study_schema",
    "write_history",
    "write_mesh",
    "write_surface",
]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used."""
    if name == "__version__":
        from importlib import metadata

        value: Any = metadata.version("fingerslip")
    elif name in _HOME_OF:
        value = getattr(importlib.import_module(f"fingerslip.{_HOME_OF[name]}"), name)
    else:
        raise AttributeError(f"module 'fingerslip' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
