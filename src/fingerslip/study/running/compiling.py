"""Compiling as a phase of its own: Numba makes machine code of fingerslip's loops once on a machine, then keeps it.

A block of a few cells, pressed and slid, compiles nearly all that a model of its kind needs.
"""

from __future__ import annotations

import contextlib
import logging
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import fingerslip
from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.model.model import Contact, Kinematics, Model
from fingerslip.model.programme import Press, Slide
from fingerslip.model.timing import QuasiStatic

if TYPE_CHECKING:
    from fingerslip.study.running.progress import StudyProgress

_NAME = "compiling, once on this machine"

# Functions and CPU seconds of each kind: those at small strain in 2D serve all. Measured on an empty cache.
_FUNCTIONS = {(2, "small"): 156, (2, "finite"): 15, (3, "finite"): 15}
_SECONDS = {(2, "small"): 32.0, (2, "finite"): 3.0, (3, "finite"): 3.0}

# A function that each kind needs: its file and its name.
_SAMPLES = {
    "small": ("dynamics/step/free_ends.py", "free_ends"),
    "finite": ("fe/finite/kernels.py", "stiffness_of_cells"),
}

Kind = tuple[int, Kinematics]


def kinds_to_compile(models: Iterable[Model]) -> tuple[Kind, ...]:
    """Return the kinds (dimension, kinematics) of functions that models need and this machine has not compiled yet."""
    needed: dict[Kind, None] = {}
    for model in models:
        needed |= dict.fromkeys(((2, "small"), (model.mesh.dim(), model.kinematics)))
    return tuple(kind for kind in needed if kind in _FUNCTIONS and not _has_cache(kind))


def compiling_seconds(models: Iterable[Model]) -> float:
    """Estimate how long compiling takes before models can be computed here [s]; 0 where that was done before."""
    return sum(_SECONDS[kind] for kind in kinds_to_compile(models))


def compile_ahead(models: Iterable[Model], progress: StudyProgress) -> None:
    """Compile what models need and this machine has not compiled yet, as a phase of the progress."""
    kinds = kinds_to_compile(models)
    if not kinds:
        return
    from numba.core import event

    from fingerslip.dynamics.simulation import simulate

    total = sum(_FUNCTIONS[kind] for kind in kinds)
    progress.say(f"{_NAME}: takes about {sum(_SECONDS[kind] for kind in kinds):.0f} s")
    progress.begin([_NAME])
    progress.advance(_NAME, 0.0)

    class _Counter(event.Listener):
        done = 0

        def on_start(self, _: Any) -> None:
            """Wait for the end."""

        def on_end(self, _: Any) -> None:
            self.done += 1
            progress.advance(_NAME, min(self.done / total, 1.0))

    with event.install_listener("numba:compile", _Counter()), _quiet():
        for kind in kinds:
            simulate(_block(*kind))
    progress.finish(_NAME, "done")


def _has_cache(kind: Kind) -> bool:
    """Tell whether Numba keeps a function of a kind, as its file is now; nothing that computes is loaded for that."""
    source, name = _SAMPLES[kind[1]]
    path = Path(fingerslip.__file__).parent / source
    home = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "numba")  # noqa: PTH111  no error
    elsewhere = os.environ.get("NUMBA_CACHE_DIR")
    folders = [Path(elsewhere)] if elsewhere else [path.parent / "__pycache__", home]
    pattern = f"{path.stem}.{name}-*.py{sys.version_info.major}{sys.version_info.minor}.nbi"
    indexes = (index for folder in folders for index in folder.rglob(pattern))
    return any(index.stat().st_mtime >= path.stat().st_mtime for index in indexes)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep what is said of the block from people who did not ask for one."""
    logger = logging.getLogger("fingerslip")
    was = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(was)


def _block(dim: int, kinematics: Kinematics) -> Model:
    """Return a block of a few cells that is pressed on a plate and slid."""
    import skfem

    sides = (np.linspace(0.0, 4e-3, 5),) * dim
    mesh = (skfem.MeshQuad if dim == 2 else skfem.MeshHex).init_tensor(*sides)
    mesh = mesh.with_boundaries({"top": lambda x: x[1] > 4e-3 - 1e-9, "bottom": lambda x: x[1] < 1e-9})
    law = NeoHookean if kinematics == "finite" else Elastic
    axes = np.eye(dim)
    return Model(
        mesh=mesh.with_subdomains({"bulk": lambda x: x[0] > -1.0}),
        materials={"bulk": law(34e3, 0.4, 1000.0)},
        formulation="plane_strain" if dim == 2 else "solid",
        supports={"top": ("x", "y") if dim == 2 else ("x", "y", "z")},
        contacts=(Contact("bottom", Plane(normal=tuple(axes[1])), Coulomb(0.4)),),
        programme=(Press(0.2e-3, 4e-3), Slide(0.4e-3, 8e-3, direction=tuple(axes[0]))),
        time=QuasiStatic(5e-3),
        kinematics=kinematics,
    )
