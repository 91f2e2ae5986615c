"""What a run costs before it is computed: memory for its mesh, and time."""

from __future__ import annotations

from typing import Any

from fingerslip.dynamics.recording.steps import record_bytes
from fingerslip.linear.memory import require_memory
from fingerslip.mesh.source import MeshSource
from fingerslip.model.model import Kinematics, Model

# From the shipped studies alone, by the dimension of space. In 2D about 10,000 unknowns and 600 steps take 1.5
# to 3.4 s, two runs side by side; in 3D 19,000 unknowns and 300 steps 16 s, 73,000 unknowns 57 s, on two cores.
_SECONDS_AT_START = 1.0
_SECONDS_PER_UNKNOWN = {2: 0.0, 3: 2e-4}
_SECONDS_PER_UNKNOWN_AND_STEP = {2: 2.5e-7, 3: 2e-6}
# How many times as much large strain takes: measured with studies/finite_strain.yaml and finite_strain_3d.yaml.
_TIMES_AT_LARGE_STRAIN = {2: 8.0, 3: 6.0}

# CPU seconds of a reduced basis, measured with the shipped studies by tests/benchmarks/bench_basis.py: for every
# unknown of the mesh and static response, for the cube of the static responses (eigenvectors), and for every unknown
# (vibrations). CPU seconds of a step by which mesh and basis differ, for every unknown and for the square of the
# responses. Only an estimate that is half as large again counts as a saving.
_SECONDS_PER_RESPONSE = {2: 5e-8, 3: 2.3e-7}
_SECONDS_PER_CUBE = 6e-10
_SECONDS_OF_VIBRATIONS = {2: 1e-5, 3: 1e-3}
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


def estimated_seconds(unknowns: int, steps: int, dim: int = 2, kinematics: Kinematics = "small") -> float:
    """Estimate how long the simulation of a run takes [s]; rough away from the size of the shipped studies."""
    per_unknown = _SECONDS_PER_UNKNOWN[dim] + _SECONDS_PER_UNKNOWN_AND_STEP[dim] * steps
    times = _TIMES_AT_LARGE_STRAIN[dim] if kinematics == "finite" else 1.0
    return _SECONDS_AT_START + times * per_unknown * unknowns


def process_bytes(unknowns: int, records: int, dim: int = 2) -> float:
    """Estimate the memory of a process that computes runs together [bytes]; rough as :func:`estimated_seconds`.

    Units: records [bytes].
    """
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
    return steps * (on_mesh - in_basis) > _MARGIN * (seconds + _SECONDS_OF_VIBRATIONS[dim] * unknowns)


def estimated_bytes(cells: float, element: str) -> float:
    """Estimate what assembling the matrices of a mesh takes [bytes]."""
    return _BYTES_PER_ENTRY * cells * (_DIMENSIONS[element] * _NODES[element]) ** 2


def require_mesh_memory(source: MeshSource, specimen: Any) -> None:
    """Refuse elements that are too small for the memory, before they are made."""
    cells, element = source.estimated_cells(specimen), source.element
    if cells is not None and element is not None:
        name = f"assembly of about {cells:.2g} {_KINDS[_DIMENSIONS[element]]}"
        require_memory({name: int(estimated_bytes(cells, element))})
