"""What a run costs before it is computed: memory for its mesh, time, and compiling once for each kind of model.

Numba makes machine code of fingerslip's loops once, then keeps it. A block of a few cells, pressed and slid, compiles
nearly all that a model of its kind needs.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

import fingerslip
from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.dynamics.recording.schedule import record_bytes
from fingerslip.linear.resources import require_memory
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.mesh.source import MeshSource
from fingerslip.model.model import Contact, Kinematics, Model, ReducedBasis
from fingerslip.model.programme import Press, Slide
from fingerslip.model.timing import QuasiStatic

if TYPE_CHECKING:
    from fingerslip.study.running.progress import StudyProgress


# From the shipped studies alone, by the dimension of space. In 2D about 10,000 unknowns and 600 steps take 1.5
# to 3.4 s, two runs side by side; in 3D 19,000 unknowns and 300 steps 16 s, 73,000 unknowns 57 s, on two cores.
_SECONDS_AT_START = 1.0
_SECONDS_PER_UNKNOWN = {2: 0.0, 3: 2e-4}
_SECONDS_PER_UNKNOWN_AND_STEP = {2: 2.5e-7, 3: 2e-6}
# How many times as much large strain takes: measured with studies/finite_strain.yaml and finite_strain_3d.yaml. And
# without inertia, where steps are long and most of them renew factors: 19 to 36 s for the runs of
# studies/ridged_vs_smooth_large.yaml, 230 and 261 s for nine steps of a smooth and a ridged half of a sensor in 3D.
_TIMES_AT_LARGE_STRAIN = {2: 8.0, 3: 6.0}
_TIMES_WITHOUT_INERTIA = {2: 36.0, 3: 22.0}
# In a reduced basis in 2D, which is there: 64 runs of 600 steps take 0.41 s each, the 450 motions of 925 steps of
# studies/reaction_map.yaml 0.58 s.
_SECONDS_IN_BASIS, _SECONDS_IN_BASIS_PER_UNKNOWN_AND_STEP = 0.1, 5e-8

# CPU seconds of a reduced basis, measured with the shipped studies by tests/benchmarks/bench.py: for every
# unknown of the mesh and static response, for the cube of the constraint modes (eigenvectors), and for every unknown
# (normal modes). CPU seconds of a step by which mesh and basis differ, for every unknown and for the square of the
# responses. Only an estimate that is half as large again counts as a saving.
_SECONDS_PER_RESPONSE = {2: 5e-8, 3: 2.3e-7}
_SECONDS_PER_CUBE = 6e-10
_SECONDS_OF_MODES = {2: 1e-5, 3: 1e-3}
_SECONDS_OF_SUBSTITUTION = {2: 1.5e-7, 3: 1.5e-6}
_SECONDS_PER_SQUARE = 1.3e-9
_MARGIN = 1.5

# What a process that computes takes [bytes]: alone, for each unknown with its factors, for each byte of the records.
# Measured with the shipped studies: 0.51 and 0.60 GB in 2D, 4 x 0.04 GB of records 0.82 GB, 2.4 GB in 3D.
_BYTES_OF_PROCESS = 0.4e9
_BYTES_PER_UNKNOWN = {2: 1.0e4, 3: 3.0e4}
_BYTES_PER_RECORDED = 1.7

# What the records of runs may take that are computed together [bytes], and how many of these there are at most: 24 runs
# of the paper's section took three quarters of the time of three times eight, on a busy machine.
_BYTES_TOGETHER, _MOST_TOGETHER = 1e9, 32

# What assembly takes at its peak for every entry of a cell's stiffness matrix: measured 35 to 42 bytes in all kinds.
_BYTES_PER_ENTRY = 42
_NODES = {"Q4": 4, "T3": 3, "T6": 6, "H8": 8, "T4": 4, "T10": 10}
_DIMENSIONS = {"Q4": 2, "T3": 2, "T6": 2, "H8": 3, "T4": 3, "T10": 3}
_KINDS = {2: "cells", 3: "tetrahedra"}


def estimated_seconds(
    unknowns: int,
    steps: int,
    dim: int = 2,
    kinematics: Kinematics = "small",
    *,
    is_static: bool = False,
    in_basis: bool = False,
) -> float:
    """Estimate how long the simulation of a run takes [s]; rough away from the size of the shipped studies."""
    if in_basis and dim == 2 and kinematics == "small":
        return _SECONDS_IN_BASIS + _SECONDS_IN_BASIS_PER_UNKNOWN_AND_STEP * unknowns * steps
    per_unknown = _SECONDS_PER_UNKNOWN[dim] + _SECONDS_PER_UNKNOWN_AND_STEP[dim] * steps
    at_large_strain = _TIMES_WITHOUT_INERTIA if is_static else _TIMES_AT_LARGE_STRAIN
    times = at_large_strain[dim] if kinematics == "finite" else 1.0
    return _SECONDS_AT_START + times * per_unknown * unknowns


def process_bytes(unknowns: int, records: int, dim: int = 2) -> float:
    """Estimate the memory of a process that computes runs with so many `records` [bytes]; as rough as the time."""
    return _BYTES_OF_PROCESS + _BYTES_PER_UNKNOWN[dim] * unknowns + _BYTES_PER_RECORDED * records


def most_together(model: Model) -> int:
    """Return how many runs like one may be computed together, whose records are kept at once."""
    # All of a boundary that may touch stands for the candidates, which are not known yet.
    near = sum(model.mesh.boundaries[contact.boundary].size for contact in model.contacts)
    records = _BYTES_PER_RECORDED * record_bytes(model, model.mesh.p.shape[1], near)
    return min(_MOST_TOGETHER, int(_BYTES_TOGETHER / records))


def basis_saves(unknowns: int, interface: int, steps: int, dim: int = 2) -> bool:
    """Tell whether a reduced basis saves time, made once for so many steps of all runs that share it."""
    seconds = _SECONDS_PER_RESPONSE[dim] * unknowns * interface + _SECONDS_PER_CUBE * interface**3
    on_mesh = _SECONDS_OF_SUBSTITUTION[dim] * unknowns
    in_basis = _SECONDS_PER_SQUARE * interface**2
    return steps * (on_mesh - in_basis) > _MARGIN * (seconds + _SECONDS_OF_MODES[dim] * unknowns)


def estimated_bytes(cells: float, element: str) -> float:
    """Estimate what assembling the matrices of a mesh takes [bytes]."""
    return _BYTES_PER_ENTRY * cells * (_DIMENSIONS[element] * _NODES[element]) ** 2


def require_mesh_memory(source: MeshSource, specimen: Any) -> None:
    """Refuse elements that are too small for the memory, before they are made."""
    cells, element = source.estimated_cells(specimen), source.element
    if cells is not None and element is not None:
        name = f"assembly of about {cells:.2g} {_KINDS[_DIMENSIONS[element]]}"
        require_memory({name: int(estimated_bytes(cells, element))})


_NAME = "compiling, once for each kind of model"

#: Dimension, and how motions are computed: on the mesh at small strain, in a basis, or at large strain.
Kind = tuple[int, Literal["small", "reduced", "finite"]]

# Each kind in words, its functions and CPU seconds, those of which it makes use included. Measured on an empty cache.
_COMPILED: Mapping[Kind, tuple[str, int, float]] = {
    (2, "small"): ("small strain", 124, 21.0),
    (2, "reduced"): ("reduced basis in 2D", 70, 20.0),
    (2, "finite"): ("large strain in 2D", 24, 4.5),
    (3, "finite"): ("large strain in 3D", 18, 3.0),
}

# A function that each kind needs: its file and its name.
_SAMPLES = {
    "small": ("contact/solve/newton.py", "compiled_solve"),
    "reduced": ("dynamics/compact/kernel.py", "take_steps"),
    "finite": ("fe/finite/kernels.py", "stiffness_of_cells"),
}


def kinds_to_compile(models: Iterable[Model]) -> tuple[Kind, ...]:
    """Return the kinds of functions that models need and this machine has not compiled yet."""
    needed: dict[Kind, None] = {}
    for model in models:
        kind: Kind = (model.mesh.dim(), model.kinematics if model.basis is None else "reduced")
        # All but the steps of a reduced body in 2D make use of what a body on the mesh in 2D does.
        needed |= dict.fromkeys((kind,) if kind == (2, "reduced") else ((2, "small"), kind))
    return tuple(kind for kind in needed if kind in _COMPILED and not _has_cache(kind))


def compiling_words(kinds: Sequence[Kind]) -> str:
    """Say for what is compiled and how long that takes; nothing where all was compiled before."""
    words, _, seconds = zip(*(_COMPILED[kind] for kind in kinds), strict=True) if kinds else ((), (), ())
    return f"{_NAME} ({', '.join(words)}): takes about {sum(seconds):.0f} s" if kinds else ""


def compile_ahead(models: Iterable[Model], progress: StudyProgress) -> None:
    """Compile what models need and this machine has not compiled yet, as a phase of the progress."""
    kinds = kinds_to_compile(models)
    if not kinds:
        return
    from numba.core import event

    from fingerslip.dynamics.simulation import simulate

    total = sum(_COMPILED[kind][1] for kind in kinds)
    progress.say(compiling_words(kinds))
    progress.begin([_NAME])
    progress.advance(_NAME, 0.0)

    class _Counter(event.Listener):
        done = 0

        def on_start(self, _: Any) -> None:
            """Wait for the end."""

        def on_end(self, _: Any) -> None:
            self.done += 1
            progress.advance(_NAME, min(self.done / total, 1.0))

    # What is said of the blocks nobody asked for.
    logger = logging.getLogger("fingerslip")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with event.install_listener("numba:compile", _Counter()):
            for kind in kinds:
                simulate(_block(*kind))
    finally:
        logger.setLevel(level)
    progress.finish(_NAME, "done")


def _has_cache(kind: Kind) -> bool:
    """Tell whether Numba keeps a function of a kind, as its file is now; nothing that computes is loaded for that."""
    source, name = _SAMPLES[kind[1]]
    path = Path(fingerslip.__file__).parent / source
    changed = path.stat().st_mtime
    home = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "numba")  # noqa: PTH111  no error
    elsewhere = os.environ.get("NUMBA_CACHE_DIR")
    folders = [Path(elsewhere)] if elsewhere else [path.parent / "__pycache__", home]
    pattern = f"{path.stem}.{name}-*.py{sys.version_info.major}{sys.version_info.minor}.nbi"
    indexes = (index for folder in folders for index in folder.rglob(pattern))
    return any(index.stat().st_mtime >= changed for index in indexes)


def _block(dim: int, computed: str) -> Model:
    """Return a block of a few cells that is pressed on a plate and slid."""
    import skfem

    sides = (np.linspace(0.0, 4e-3, 5),) * dim
    mesh = (skfem.MeshQuad if dim == 2 else skfem.MeshHex).init_tensor(*sides)
    mesh = mesh.with_boundaries({"top": lambda x: x[1] > 4e-3 - 1e-9, "bottom": lambda x: x[1] < 1e-9})
    law = NeoHookean if computed == "finite" else Elastic
    axes = np.eye(dim)
    return Model(
        mesh=mesh.with_subdomains({"bulk": lambda x: x[0] > -1.0}),
        materials={"bulk": law(34e3, 0.4, 1000.0)},
        formulation="plane_strain" if dim == 2 else "solid",
        supports={"top": ("x", "y") if dim == 2 else ("x", "y", "z")},
        contacts=(Contact("bottom", Plane(normal=tuple(axes[1])), Coulomb(0.4)),),
        programme=(Press(0.2e-3, 4e-3), Slide(0.4e-3, 8e-3, direction=tuple(axes[0]))),
        time=QuasiStatic(5e-3),
        kinematics="finite" if computed == "finite" else "small",
        basis=ReducedBasis() if computed == "reduced" else None,
    )
