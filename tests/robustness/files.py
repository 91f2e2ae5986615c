"""Cases of mesh files and scanned surfaces: whole ones damaged, and junk made on purpose."""

import contextlib
import io
import random
import re
import warnings
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

import fingerslip as fs
from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.errors import FingerslipError
from fingerslip.mesh.io import read_mesh, write_mesh
from fingerslip.mesh.scan.build import SurfaceMesh
from fingerslip.mesh.scan.placement import place_surface, placement_from_directions
from fingerslip.mesh.scan.repair import repair_surface
from fingerslip.mesh.scan.surfaces import check_enclosure, decimate_surface, read_surface, write_surface
from places import MESHES
from robustness.mutants import FOREIGN, changed_bytes
from unit.ellipsoids import ellipsoid
from unit.mesh.decks.texts import CAE, FEBIO

_SURFACES, _GRIDS = ("stl", "ply", "obj", "off", "vtk"), ("vtu", "xdmf", "vtk")
_FOREIGN_GRIDS = ("bdf", "inp", "mesh", "ply")
_WORDS = (b"nan", b"inf", b"-1", b"0", b"1e300", b"99999999999999999999", b"x", b"", b"1e-300", b"3", b"0.5", b"\xff")


def mesh_cases(folder: Path) -> Callable[[random.Random], None]:
    """Return what runs a case: a damaged mesh file is read, and a model of it is checked."""
    for name in _GRIDS:
        write_mesh(read_mesh(MESHES / "block.msh"), folder / f"whole.{name}")
    for name in _FOREIGN_GRIDS:
        with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings(action="ignore"):
            meshio.write(folder / f"whole.{name}", _nameless(meshio.read(MESHES / "block.msh")))
    sources = [MESHES / "block.msh", MESHES / "block.msh", MESHES / "finger_coarse.msh"]
    sources += [folder / f"whole.{name}" for name in (*_GRIDS, *_FOREIGN_GRIDS)]
    for name, text in (("deck.inp", CAE), ("deck.feb", FEBIO)):
        sources.append(folder / name)
        sources[-1].write_text(text, encoding="latin-1")

    def case(chance: random.Random) -> None:
        source = chance.choice(sources)
        path = folder / f"mutant{source.suffix}"
        path.write_bytes(_damaged(source.read_bytes(), chance))
        mesh = read_mesh(path)
        names = list(mesh.boundaries or {"none": None})
        tissue = fs.Elastic(1e5, 0.3, 1000.0)
        model = fs.Model(
            mesh=mesh,
            materials=dict.fromkeys(mesh.subdomains or {"all": None}, tissue),
            formulation="solid" if mesh.dim() == 3 else "plane_strain",
            depth=1.0 if mesh.dim() == 3 else 1e-3,
            supports={names[0]: ("x", "y")},
            contacts=(fs.Contact(names[-1], friction=fs.Coulomb(0.5)),),
            programme=(fs.Press(1e-4, 5e-3),),
            time=fs.TimeStepping(2e-3),
        )
        inspect_model(model)

    return case


def surface_cases(folder: Path) -> Callable[[random.Random], None]:
    """Return what runs a case: a damaged surface is read, repaired, placed and measured."""
    whole = ellipsoid()
    for name in _SURFACES:
        write_surface(whole, folder / f"whole.{name}")

    def case(chance: random.Random) -> None:
        path = folder / f"mutant.{chance.choice(_SURFACES)}"
        if chance.random() < 0.5:
            path.write_bytes(_damaged((folder / f"whole{path.suffix}").read_bytes(), chance))
        else:
            points, triangles = _junk(whole.points * 1e3, whole.triangles, chance)
            with warnings.catch_warnings(action="ignore"), contextlib.redirect_stdout(io.StringIO()):
                meshio.write(path, meshio.Mesh(points, [("triangle", triangles)]))
        _use(path, chance)

    return case


def _nameless(mesh: meshio.Mesh) -> meshio.Mesh:
    """Return points [mm], of few digits, and cells of a mesh alone, which every format holds."""
    points = np.column_stack([np.round(1e3 * mesh.points[:, :2], 3), np.zeros(len(mesh.points))])
    return meshio.Mesh(points, [(block.type, block.data) for block in mesh.cells if block.type in ("triangle", "quad")])


def _damaged(content: bytes, chance: random.Random) -> bytes:
    """Return a file with its header cut, names of groups, bytes or, where it is text, words changed."""
    kind = chance.random()
    if kind < 0.15:
        return content[: chance.randrange(min(len(content), 400))]
    if kind < 0.3:
        other = chance.choice(FOREIGN).encode("utf-8", "surrogatepass")
        return re.sub(rb"(?<=\")[A-Za-z_]+(?=\")", lambda word: other if chance.random() < 0.3 else word[0], content)
    if kind < 0.6:
        return changed_bytes(content, chance)
    words = list(re.finditer(rb"[^\s<>=\"]+", content))
    for place in sorted(chance.sample(words, min(len(words), chance.choice((1, 1, 3)))), key=lambda one: -one.start()):
        other = chance.choice((*_WORDS, *(one[0] for one in chance.sample(words, 3))))
        content = content[: place.start()] + other + content[place.end() :]
    return content


def _junk(
    points: NDArray[np.float64], triangles: NDArray[np.int64], chance: random.Random
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return points [mm] and triangles that no scanner would give."""
    numbers = np.random.default_rng(chance.randrange(2**32))
    some = numbers.integers(0, len(points), chance.choice((1, 3, len(points))))
    points = points.copy()
    match chance.randrange(10):
        case 0:
            points[some] = chance.choice((np.nan, np.inf, -np.inf))
        case 1:
            points[some] = chance.choice((0.0, 5.0, 1e-30))
        case 2:
            points[:, 1:] = chance.choice((0.0, 1e-12, 1.0))
        case 3:
            points[some] *= chance.choice((1e10, 1e30, 1e38, 1e-30, 1e3))
        case 4:
            points = numbers.uniform(-10, 10, points.shape)
        case 5:
            triangles = numbers.integers(0, len(points), (chance.choice((1, 2, 5, 500)), 3))
        case 6:
            triangles = triangles[: chance.choice((1, 1, 2, 3))]
        case 7:
            triangles = np.vstack([triangles, triangles[:, :: chance.choice((1, -1))]])
        case 8:
            turned = numbers.random(len(triangles)) < 0.5
            triangles = np.where(turned[:, None], triangles[:, ::-1], triangles)
        case _:
            points *= [chance.choice((1.0, 1e-9)), chance.choice((1.0, 1e-3)), chance.choice((1.0, 1e-9, 1e-20))]
    return points, triangles.astype(np.int32)


def _use(path: Path, chance: random.Random) -> None:
    unit = chance.choice(("mm", "mm", "mm", "cm", "um", "m"))
    settings = SurfaceMesh(skin=str(path), tip=(1.0, 0.0, 0.0), pad=(0.0, -1.0, 0.0), unit=unit)
    with contextlib.suppress(FingerslipError):
        settings.estimated_cells()
    surface, _ = repair_surface(read_surface(path, unit), chance.choice((5e-3, 1e-9, 1.0)))
    placed = place_surface(surface, placement_from_directions(surface, settings.tip, settings.pad))
    decimate_surface(placed, 2e-3)
    check_enclosure(placed)
