"""Mesh sources, what their keys follow, and how element sizes grow."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.mesh.source import (
    GROWTH,
    MeshFile,
    MeshSource,
    check_sizes,
    choose_source,
    grade,
    inspect_mesh,
    mesh_size_note,
    other_files,
    size_at,
    subdivide,
)
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.verification.meshes import box
from places import ROOT
from unit.study.block import block_mesh

FILES = (MeshFile, fs.SurfaceMesh)
SOURCES = (*FILES, fs.MeshSizes, fs.SolidSizes)


@parameters
class Block(MeshSource):
    """The least that a source has to say."""

    dim: ClassVar[int] = 2
    element: ClassVar[str] = "Q4"

    size: PositiveLength = 1e-3

    def build(self, _specimen, /):
        return box("Q4", *([np.arange(0.0, 4.5e-3, self.size)] * 2))


@dataclass(frozen=True)
class Numbers:
    width: float

    @property
    def shape(self):
        return {"width": self.width}


@parameters
class FinerBlock(Block):
    """A block whose element size can be refined."""

    element_sizes: ClassVar[tuple[str, ...]] = ("size",)


def test_a_source_of_ones_own_has_answers_for_the_rest():
    source = Block()
    assert (source.needs_specimen, source.assumes_metres) == (False, False)
    assert source.estimated_cells(None) is None
    assert source.refined(0.5) is None
    assert FinerBlock(2e-3).refined(0.5) == FinerBlock(1e-3)
    assert source.beside(Path("anywhere")) is source
    inspected = source.inspect(None)
    assert inspected.mesh.nelements == 16
    assert inspected.tables[0].rows[0][:2] == ("bulk", 16)
    # Its key follows its own values and those of the specimen.
    assert Block().key(Numbers(1.0)) == Block().key(Numbers(1.0))
    assert len({Block(size).key(Numbers(width)) for size in (1e-3, 2e-3) for width in (1.0, 2.0)}) == 4


@pytest.mark.parametrize(
    ("values", "source"),
    [
        ({}, fs.MeshSizes),
        ({"contact_size": "0.1 mm"}, fs.MeshSizes),
        ({"element": "T6"}, fs.MeshSizes),
        ({"element": "T10", "bulk_size": "1 mm"}, fs.SolidSizes),
        ({"element": "H8"}, fs.MeshSizes),
        ({"file": "a.msh"}, MeshFile),
        ({"file": "a.msh", "element": "T4"}, MeshFile),
        ({"skin": "a.stl", "unit": "mm"}, fs.SurfaceMesh),
        ({"tip": [1, 0, 0]}, fs.SurfaceMesh),
    ],
)
def test_the_keys_of_a_file_choose_the_source(values, source):
    assert choose_source(SOURCES, values) is source


def test_tables_of_a_mesh_have_a_row_for_each_region():
    grid = np.linspace(0.0, 1.0, 5)
    mesh = box("T3", grid, grid, regions={"a": lambda c: c[1] < 0.5, "b": lambda c: c[1] > 0.5})
    found = inspect_mesh(mesh)
    (table,) = found.tables
    assert [row[:2] for row in table.rows] == [("a", 16), ("b", 16)]
    assert [row[3] for row in table.rows] == pytest.approx([45.0, 45.0])
    assert {len(row) for row in table.rows} == {len(table.columns)}
    assert mesh_size_note(mesh) == "25 nodes, 32 cells; boundaries: left, right, bottom, top"
    within = np.flatnonzero(mesh.f2t[1] >= 0)
    both = np.append(within[:3], mesh.boundaries["left"])
    marked = mesh.with_boundaries({"slit": within[:3], "both": both})
    assert "slit (inside the body), both (3 of 7 facets inside the body)" in mesh_size_note(marked)


def test_only_the_file_tells_its_kind_and_size_and_its_key_follows_content_and_unit(tmp_path):
    file = tmp_path / "block.msh"
    fs.write_mesh(block_mesh(), file)
    for unit, metres in ((None, 1.0), ("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6)):
        source = MeshFile(str(file), unit)
        assert np.ptp(source.build().p, axis=1) == pytest.approx([10e-3 * metres, 5e-3 * metres])
        assert source.assumes_metres == (unit is None)
    source = MeshFile(str(file))
    assert (source.dim, source.element, source.needs_specimen) == (None, None, False)
    assert source.estimated_cells(None) is None
    assert source.refined(0.5) is None
    inspected = source.inspect(None)
    # Squares of 1.25 mm.
    ((region, cells, jacobian, *_),) = inspected.tables[0].rows
    assert (inspected.suffix, region, cells, jacobian) == (".msh", "block", 32, pytest.approx(1.0))
    first = MeshFile(str(file)).key()
    assert MeshFile(str(file), "mm").key() != first
    copy = file.with_name("copy.msh")
    copy.write_bytes(file.read_bytes())
    assert MeshFile(str(copy)).key() == first
    copy.write_bytes(file.read_bytes() + b" ")
    assert MeshFile(str(copy)).key() != first
    assert MeshFile("block.msh", "mm").beside(file.parent) == MeshFile(str(file.resolve()), "mm")


@pytest.mark.parametrize(
    "include",
    ["*Include, input={}", '* INCLUDE,\n  Input = "{}"', "*INCLUDE, INPUT={}, PASSWORD=x", "*include,input={}"],
)
def test_the_key_of_a_deck_follows_the_files_that_it_includes_however_deep(tmp_path, include):
    files = [tmp_path / name for name in ("deck.inp", "a b.inp", "nodes/c.inp")]
    files[2].parent.mkdir()
    for file, other in zip(files, (files[1].name, "nodes/c.inp", "gone.inp"), strict=True):
        file.write_text(f"*Heading\n** *Include, input=comment.inp\n{include.format(other)}\n*Node\n1, 0., 0.\n")
    assert other_files(files[0]) == files[1:]
    source, keys = MeshFile(str(files[0])), set()
    for file in (*files, tmp_path / "comment.inp"):
        keys.add(source.key())
        file.write_text(f"{file.read_text() if file.exists() else ''}2, 1., 0.\n")
    assert len(keys | {source.key()}) == 4
    files[2].write_text(include.format("../deck.inp"))  # the reader refuses the circle
    assert source.key() not in keys


def test_the_key_of_xdmf_follows_the_file_of_its_arrays(tmp_path):
    file = tmp_path / "block.xdmf"
    fs.write_mesh(block_mesh(), file)
    assert other_files(file) == [file.with_suffix(".h5")]
    first = MeshFile(str(file)).key()
    with h5py.File(file.with_suffix(".h5"), "a") as arrays:
        arrays["data0"][0] += 1e-3
    assert MeshFile(str(file)).key() != first
    assert other_files(file.with_suffix(".h5")) == []


def test_sizes_grow_from_a_small_one_at_the_rate_of_growth_up_to_the_bulk():
    divided = grade(LINE, np.where(np.abs(LINE - 4.0) < 0.01, 0.1, 5.0))
    expected = 0.1 + GROWTH * np.abs(0.5 * (divided[1:] + divided[:-1]) - 4.0)
    assert np.diff(divided) == pytest.approx(expected, rel=0.12)
    points = np.array([[0.0, 0.0], [3.0, 4.0], [0.0, 1.0], [50.0, 0.0]])
    # At (0, 1) the finer source counts: 0.5 + 0.2 of the distance 1.
    found = size_at(points, np.array([[0.0, 0.0], [0.0, 2.0]]), np.array([1.0, 0.5]), 2.0)
    assert found == pytest.approx([0.5 + 0.2 * 2.0, min(1.0 + 0.2 * 5.0, 0.5 + 0.2 * np.hypot(3, 2)), 0.7, 2.0])


LINE = np.linspace(0.0, 10.0, 2001)


@pytest.mark.parametrize(("size", "parts"), [(1.0, 10), (0.5, 20), (0.9, 12), (3.0, 4), (100.0, 2)])
def test_equal_sizes_divide_a_length_into_an_even_number_of_equal_parts(size, parts):
    """The even number next to length over size, at least two."""
    divided = grade(LINE, np.full(LINE.size, size))
    assert divided == pytest.approx(np.linspace(0.0, 10.0, parts + 1), abs=1e-9)


@given(st.lists(st.floats(0.05, 3.0), min_size=2, max_size=6))
def test_graded_parts_are_near_the_wanted_sizes_and_grow_slowly(wanted):
    sizes = np.interp(LINE, np.linspace(0.0, 10.0, len(wanted)), wanted)
    divided = grade(LINE, sizes)
    parts = np.diff(divided)
    assert (divided[0], divided[-1]) == (0.0, 10.0)
    assert len(parts) % 2 == 0
    assert np.all(parts > 0.0)
    if len(parts) > 8:
        # Rounding to an even number of parts changes all of them alike.
        assert np.all(parts <= 1.2 * sizes.max() * (1 + 2 / len(parts)))
        assert np.all(np.abs(np.diff(parts)) <= 1.3 * GROWTH * np.maximum(parts[1:], parts[:-1]))


def circle(radius, count=4000):
    angle = np.linspace(0.0, 2 * np.pi, count)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("turn", [10.0, 18.0, 30.0])
def test_no_part_of_a_bend_turns_by_more_than_the_limit(turn):
    curve = circle(1.0)
    divided = subdivide(curve, np.full(len(curve), 5.0), np.radians(turn))
    chord = np.linalg.norm(np.diff(divided, axis=0), axis=1)
    angle = 2 * np.arcsin(chord / 2)
    assert np.degrees(angle).max() <= turn * 1.001
    assert len(chord) == np.ceil(360.0 / turn - 1e-6)


def test_corners_of_a_curve_become_nodes_and_parts_of_a_line_are_no_longer_than_wanted():
    side = np.linspace(0.0, 1.0, 101)
    path = np.vstack([np.column_stack([side, 0 * side])[:-1], np.column_stack([0 * side + 1.0, side])])
    divided = subdivide(path, np.full(len(path), 0.3), np.radians(18.0))
    assert any(np.allclose(node, [1.0, 0.0], atol=1e-12) for node in divided)
    assert divided[[0, -1]] == pytest.approx(np.array([[0.0, 0.0], [1.0, 1.0]]))
    # Each side alone: ceil(1 / 0.3) parts.
    assert len(divided) == 2 * 4 + 1
    parts = np.diff(subdivide(np.column_stack([LINE, 0 * LINE]), 0.2 + 0.1 * LINE, np.radians(18.0))[:, 0])
    wanted = 0.2 + 0.1 * (np.cumsum(parts) - parts / 2)
    assert np.all(parts <= wanted * 1.01)
    assert np.all(parts >= wanted * 0.9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fs.read_mesh(ROOT / "meshes" / "block.msh", "inch"), r"unit: got 'inch', needs one of m, cm, mm, um"),
        (lambda: MeshFile("none.msh").key(), r"mesh\.file: cannot read none\.msh \(No such file"),
        (lambda: check_sizes(0.2e-3, 0.1e-3), r"bulk_size: got 0\.1 mm, needs >= 0\.2 mm \(contact_size\)$"),
        (lambda: choose_source(FILES, {}), "mesh: does not say where the mesh comes from, needs file or skin, tip, "),
    ],
)
def test_what_does_not_fit_is_refused(call, message):
    with pytest.raises(fs.InputError, match=message):
        call()
