"""Finite-element toolkit for fingertip slip.

The public names below are loaded when they are first used, so that ``import fingerslip`` is quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fingerslip.anatomy import Fingertip, fingertip_from, preset, preset_names, preset_table
    from fingerslip.contact.bodies import Cylinder, Plane, Sphere
    from fingerslip.contact.friction import Anisotropic, Coulomb, PressureDependent, StaticKinetic
    from fingerslip.dynamics.simulate import simulate, simulate_together
    from fingerslip.errors import (
        ConvergenceError,
        FingerslipError,
        InputError,
        MeshError,
        ResultError,
        SlipOutsideContactError,
    )
    from fingerslip.history import read_history, write_history
    from fingerslip.materials import Elastic, RayleighDamping
    from fingerslip.mesh.io import read_mesh, write_mesh
    from fingerslip.mesh.quality import quality_table
    from fingerslip.mesh.section import build_section
    from fingerslip.mesh.sites import Site, receptor_sites
    from fingerslip.mesh.sizes import MeshSizes
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
    from fingerslip.slip import Events, SlipEvents, acceleration_peaks, find_events
    from fingerslip.study.runner import StudyFailedError, StudyResult, run_study
    from fingerslip.study.spec import Study, read_study, study_schema

    __version__: str

_HOMES = {
    "anatomy": ("Fingertip", "fingertip_from", "preset", "preset_names", "preset_table"),
    "contact.bodies": ("Cylinder", "Plane", "Sphere"),
    "contact.friction": ("Anisotropic", "Coulomb", "PressureDependent", "StaticKinetic"),
    "dynamics.simulate": ("simulate", "simulate_together"),
    "errors": (
        "ConvergenceError",
        "FingerslipError",
        "InputError",
        "MeshError",
        "ResultError",
        "SlipOutsideContactError",
    ),
    "history": ("read_history", "write_history"),
    "materials": ("Elastic", "RayleighDamping"),
    "mesh.io": ("read_mesh", "write_mesh"),
    "mesh.quality": ("quality_table",),
    "mesh.section": ("build_section",),
    "mesh.sites": ("Site", "receptor_sites"),
    "mesh.sizes": ("MeshSizes",),
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
    "study.runner": ("StudyFailedError", "StudyResult", "run_study"),
    "study.spec": ("Study", "read_study", "study_schema"),
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
    "Lift",
    "MeshError",
    "MeshSizes",
    "Model",
    "Plane",
    "Press",
    "PressureDependent",
    "QuasiStatic",
    "Ramp",
    "RayleighDamping",
    "Recording",
    "ResultError",
    "Site",
    "Slide",
    "SlipEvents",
    "SlipOutsideContactError",
    "Sphere",
    "StaticKinetic",
    "Study",
    "StudyFailedError",
    "StudyResult",
    "TimeStepping",
    "Traction",
    "__version__",
    "acceleration_peaks",
    "build_section",
    "find_events",
    "fingertip_from",
    "preset",
    "preset_names",
    "preset_table",
    "quality_table",
    "read_history",
    "read_mesh",
    "read_study",
    "receptor_sites",
    "run_study",
    "simulate",
    "simulate_together",
    "study_schema",
    "write_history",
    "write_mesh",
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
