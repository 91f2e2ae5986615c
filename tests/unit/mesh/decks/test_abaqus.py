"""Decks of Abaqus: what its preprocessor writes comes with its regions and boundaries; a damaged deck is one error."""

import meshio
import numpy as np
import pytest

from fingerslip.errors import MeshError
from fingerslip.fe.space import boundary_nodes, build_space
from fingerslip.mesh.io import read_mesh, write_mesh
from fingerslip.verification.meshes import box, dimension
from unit.mesh.decks.texts import BETWEEN, CAE, CUBE, PRISM, SQUARE, TETRAHEDRON, TRIANGLE, check_damage, flat, write


def middles(mesh, name):
    """Return the middles of the facets of a boundary, rounded and sorted."""
    return sorted(map(tuple, mesh.p[:, mesh.facets[:, mesh.boundaries[name]]].mean(axis=1).T.round(9).tolist()))


PAD = CAE[CAE.index("*Node") : CAE.index("*End Part")]
# Meshed in the assembly, not in the part.
INDEPENDENT = CAE.replace(PAD, "").replace("*End Instance", f"{PAD}*End Instance", 1)


@pytest.mark.parametrize("text", [CAE, INDEPENDENT], ids=["part", "instance"])
def test_a_deck_of_the_preprocessor_comes_with_its_regions_and_boundaries(tmp_path, text):
    mesh = read_mesh(write(tmp_path / "deck.inp", text))
    counts = {"Touch": 3, "Round": 4, "Fixed_CNS_": 2, "Fixed": 2, "Line": 2}
    # Shifted by 10, then turned by 90 degrees about (10, 0): what was up is left.
    assert mesh.p.T.min(axis=0) == pytest.approx([8.0, 0.0])
    assert {name: len(cells) for name, cells in mesh.subdomains.items()} == {"Gel": 2, "Outer layer": 2, "Half": 3}
    assert (mesh.p[0, mesh.t[:, mesh.subdomains["Gel"]]] >= 9.0 - 1e-9).all()
    assert {name: len(facets) for name, facets in mesh.boundaries.items()} == counts
    assert middles(mesh, "Touch") == [(8.0, 0.5), (8.0, 1.5), (8.5, 2.0)]
    assert middles(mesh, "Fixed") == middles(mesh, "Fixed_CNS_") == [(10.0, 0.5), (10.0, 1.5)]
    assert middles(mesh, "Line") == [(8.5, 0.0), (9.5, 0.0)]


# The sides S1, S2, ... of each kind of element, as the manual counts them, by what is constant on them: x + y on one
# that is slanted, in a tetrahedron x + y + z.
OF_SQUARE, OF_TRIANGLE = [("y", 0), ("x", 1), ("y", 1), ("x", 0)], [("y", 0), ("x + y", 1), ("x", 0)]
OF_PRISM, OF_CUBE = [("z", 0), ("z", 1), *OF_TRIANGLE], [("z", 0), ("z", 1), *OF_SQUARE]
OF_TETRAHEDRON = [("z", 0), ("y", 0), ("x + y + z", 1), ("x", 0)]
ELEMENTS = {
    **dict.fromkeys(("CPE4", "CPS4R", "CPE4RH", "CPEG4I"), (SQUARE, OF_SQUARE, 0)),
    **dict.fromkeys(("CPE8", "CPS8R", "CPE8RH"), (SQUARE, OF_SQUARE, 4)),
    **dict.fromkeys(("CPE3H", "CPS3"), (TRIANGLE, OF_TRIANGLE, 0)),
    **dict.fromkeys(("CPE6H", "CPS6M"), (TRIANGLE, OF_TRIANGLE, 3)),
    **dict.fromkeys(("C3D8H", "C3D8RH", "C3D8I"), (CUBE, OF_CUBE, 0)),
    **dict.fromkeys(("C3D20RH",), (CUBE, OF_CUBE, 12)),
    **dict.fromkeys(("C3D6H",), (PRISM, OF_PRISM, 0)),
    **dict.fromkeys(("C3D15H",), (PRISM, OF_PRISM, 9)),
    **dict.fromkeys(("C3D4H",), (TETRAHEDRON, OF_TETRAHEDRON, 0)),
    **dict.fromkeys(("C3D10H", "C3D10HS", "C3D10MH"), (TETRAHEDRON, OF_TETRAHEDRON, 6)),
}


@pytest.mark.parametrize("name", ELEMENTS)
def test_every_element_comes_with_its_sides_as_the_manual_counts_them(tmp_path, name):
    points, sides, further = ELEMENTS[name]
    pairs = next((pairs for start, pairs in BETWEEN.items() if name.replace("CPS", "CPE").startswith(start)), [])
    assert len(pairs) == further
    middle = [tuple((p + q) / 2 for p, q in zip(points[a], points[b], strict=True)) for a, b in pairs]
    surfaces = [f"*SURFACE, NAME=side{number}\nbody, S{number}" for number in range(1, len(sides) + 1)]
    every = [*points, *middle]
    mesh = read_mesh(write(tmp_path / "deck.inp", flat(name, every, [range(1, len(every) + 1)], "\n".join(surfaces))))
    assert list(mesh.subdomains) == ["body"]
    space = build_space(mesh)
    assert space.full.dx.sum() == pytest.approx(
        {3: 1 / 2, 4: 1 if mesh.dim() == 2 else 1 / 6, 6: 1 / 2, 8: 1}[len(points)]
    )
    for number, (axes, value) in enumerate(sides, start=1):
        at = space.positions[boundary_nodes(space, f"side{number}")]
        total = sum(at[:, "xyz".index(axis)] for axis in axes.split(" + "))
        np.testing.assert_allclose(total, value, atol=1e-12)
        assert len(at) >= mesh.dim()


@pytest.mark.parametrize(
    "name", ["S3R", "STRI3", "SFM3D3", "M3D6", "STRI65", "S4R5", "M3D4R", "SFM3D4R", "S8R5", "R3D4"]
)
def test_shells_and_membranes_are_boundaries_and_have_sides(tmp_path, name):
    of_triangles = name in {"S3R", "STRI3", "SFM3D3", "M3D6", "STRI65"}
    solid, points = ("C3D10", TETRAHEDRON) if of_triangles else ("C3D20", CUBE)
    every = [*points, *(np.mean([points[a], points[b]], axis=0) for a, b in BETWEEN[solid])]
    nodes = [1, 2, 3, 5, 6, 7] if of_triangles else [1, 2, 3, 4, 9, 10, 11, 12]
    count = {"M3D6": 6, "STRI65": 6, "S8R5": 8}.get(name, 3 if of_triangles else 4)
    shell = f"*ELEMENT, TYPE={name}, ELSET=skin\n9, {', '.join(map(str, nodes[:count]))}\n"
    more = f"{shell}*SURFACE, NAME=upper\nskin, SPOS\n"
    mesh = read_mesh(write(tmp_path / "deck.inp", flat(solid, every, [range(1, len(every) + 1)], more)))
    assert {side: len(facets) for side, facets in mesh.boundaries.items()} == {"skin": 1, "upper": 1}
    assert list(mesh.subdomains) == ["body"]


@pytest.mark.parametrize(
    ("sets", "regions"),
    [
        ("", ["Pad"]),
        (
            "*Elset, elset=First, instance=Pad-1\n1,\n*Elset, elset=Second, instance=Pad-1\nFirst,\n",
            ["First", "Second"],
        ),
    ],
)
def test_a_part_is_a_region_where_no_set_is_and_sets_have_sets(tmp_path, sets, regions):
    part = flat("CPE4", SQUARE, [(1, 2, 3, 4)]).replace(", ELSET=body", "")
    instance = "*Assembly, name=All\n*Instance, name=Pad-1, part=Pad\n*End Instance\n"
    mesh = read_mesh(write(tmp_path / "deck.inp", f"*Part, name=Pad\n{part}*End Part\n{instance}{sets}*End Assembly\n"))
    assert list(mesh.subdomains) == regions


MIXED = flat("CPE4", [(0, 0), (1, 0), (1, 1), (0, 1), (2, 0)], [(1, 2, 3, 4)])


@pytest.mark.parametrize(
    ("more", "boundaries", "regions"),
    [
        ("*ELEMENT, TYPE=T2D2, ELSET=low\n7, 1, 2", {"low": 1}, {"body": 1}),
        (
            "*ELEMENT, TYPE=CPE3, ELSET=corner\n9, 2, 5, 3\n*NSET, NSET=low\n1, 2, 5",
            {"low": 2},
            {"body": 1, "corner": 1},
        ),
        ("*ELEMENT, TYPE=CPE3\n9, 2, 5,\n3\n*ELSET, ELSET=all\nbody, 9", {}, {"body": 1, "all": 2}),
        ("*SURFACE, NAME=low, TYPE=NODE\n1,\n2, 1.", {"low": 1}, {"body": 1}),
        ("*SURFACE, NAME=round\nbody,", {"round": 4}, {"body": 1}),
        ("*SURFACE, NAME=one,\n TYPE=ELEMENT\n1, s2", {"one": 1}, {"body": 1}),
        ("*INCLUDE, INPUT=more.inp", {"low": 1}, {"body": 1}),
        ("*ELEMENT, TYPE=CPE3, ELSET=corner\n1, 2, 5, 3", {}, {"body": 1, "corner": 1}),  # a label twice
        ("*ELEMENT, TYPE=R2D2, ELSET=stamp\n9, 2, 5", {}, {"body": 1}),
        ("*NSET, NSET=set 1, GENERATE\n1, 2", {"set 1": 1}, {"body": 1}),
    ],
)
def test_flat_decks(tmp_path, more, boundaries, regions):
    write(tmp_path / "more.inp", "*Nset, nset=low\n1, 2\n")
    mesh = read_mesh(write(tmp_path / "deck.inp", f"{MIXED}\n{more}\n"), "mm")
    assert {name: len(facets) for name, facets in mesh.boundaries.items()} == boundaries
    assert {name: len(cells) for name, cells in mesh.subdomains.items()} == regions
    assert mesh.p.max() in {1e-3, 2e-3}


@pytest.mark.parametrize("element", ["Q4", "T3", "H8", "T4", "T10"])
def test_decks_that_meshio_writes_are_read(tmp_path, element, caplog):
    mesh = box(element, *[np.linspace(0.0, 1.0, 3)] * dimension(element))
    write_mesh(mesh, tmp_path / "body.msh")
    data = meshio.read(tmp_path / "body.msh")
    sets = {"body": [np.arange(mesh.nelements)]}
    meshio.write(tmp_path / "deck.inp", meshio.Mesh(data.points, data.cells[:1], cell_sets=sets))
    with caplog.at_level("INFO"):
        space = build_space(read_mesh(tmp_path / "deck.inp"))
    assert space.element == element
    assert space.full.dx.sum() == pytest.approx(1.0)
    # Its quadrilaterals are axisymmetric.
    assert ("the axial symmetry of CAX4P" in caplog.text) == (element == "Q4")


def test_two_instances_of_a_part_are_told_apart(tmp_path):
    second = "*Instance, name=Pad-2, part=Pad\n 0., 5., 0.\n*End Instance\n**\n*Instance, name=Stamp-1"
    around = "*Surface, name=Around\nOuter layer,\n** Section:"
    text = CAE.replace("*Instance, name=Stamp-1", second).replace("** Section:", around)
    mesh = read_mesh(write(tmp_path / "deck.inp", text))
    # Sets of the preprocessor's own are called by their material in both.
    counts = {"Gel": 4, "Pad-1.Outer layer": 2, "Pad-2.Outer layer": 2, "Pad-1.Half": 3, "Pad-2.Half": 3}
    assert {name: len(cells) for name, cells in mesh.subdomains.items()} == counts
    assert mesh.p.T.max(axis=0) == pytest.approx([10.0, 7.0])
    # A surface without sides of its own takes those that are free, in every instance.
    assert [len(mesh.boundaries[f"Pad-{number}.Around"]) for number in (1, 2)] == [4, 4]


def test_files_of_data_alone_go_on_with_the_keyword_before_and_are_named_in_errors(tmp_path):
    """As Abaqus reads ``*Include`` behind ``*Node`` and ``*Element``; the deck may go on with data, too."""
    deck = flat("CPE4", SQUARE, [(1, 2, 3, 4)])
    nodes, cells = "2, 1, 0\n3, 1, 1\n", "1, 1, 2, 3, 4"
    parted = deck.replace(nodes, "*Include, input=nodes.txt\n").replace(cells, "*Include, input=cells.txt")
    write(tmp_path / "nodes.txt", f"** some nodes\n{nodes}")
    write(tmp_path / "cells.txt", cells)
    path = write(tmp_path / "deck.inp", parted)
    assert read_mesh(path, "mm").p.tolist() == read_mesh(write(tmp_path / "whole.inp", deck), "mm").p.tolist()
    write(tmp_path / "nodes.txt", nodes.replace("3, 1, 1", "3, 1, up"))
    with pytest.raises(MeshError, match=r"nodes\.txt: \*Node: got '1, up', needs numbers between commas \(line 2\)"):
        read_mesh(path)


ANALYTICAL = "*Surface, type=SEGMENTS, name=Plate\nSTART, 0., 0.\nLINE, 5., 0.\n"
COMBINED = "*Surface, name=Both, combine=union\nTouch, Round\n"


def test_what_is_not_taken_is_listed_once(tmp_path, caplog):
    text = CAE.replace("name=Stamp-1, part=STAMP\n", f"name=Stamp-1, part=STAMP\n{ANALYTICAL}")
    path = write(tmp_path / "deck.inp", text.replace("*End Assembly", f"{COMBINED}*End Assembly"))
    with caplog.at_level("INFO"):
        assert "Plate" not in read_mesh(path).boundaries
    listed = "*Step (its nlgeom=YES is large strain: write kinematics: finite); *Material; *Hyperelastic; "
    listed += "the surface Plate, segments; the surface Both, of others; "
    listed += "sets and surfaces with no cell and no side: All, Corner"
    with caplog.at_level("INFO"):
        read_mesh(write(tmp_path / "small.inp", CAE.replace(", nlgeom=YES", ", nlgeom=no")))
    assert caplog.records[0].getMessage() == f"{path}: without {listed}"
    assert "without *Step; " in caplog.records[1].getMessage()


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("1, 1, 2, 5, 4", "1, 1, 2, 5", r"\*Element: element 1 has 3 nodes, CPE4RH needs 4"),
        ("4, 5, 6, 9, 8", "4, 5, 6, 9", r"\*Element: element 4 has 3 nodes, CPE4RH needs 4"),
        ("4, 5, 6, 9, 8", "4, 5, 6, 9,", "element 4 has 3 nodes"),
        ("4, 5, 6, 9, 8", "4, 5, 6, 99, 8", "element 4 has node 99, which is not there, .*; write them"),
        ("4, 5, 6, 9, 8", "4, 5, x, 9, 8", r"got '4, 5, x, 9, 8', needs whole numbers"),
        ("4, 5, 6, 9, 8", f"{'9' * 5000}, 5, 6, 9, 8", r"got '9+\.\.\.', needs whole numbers"),
        ("      9,           2.,           2.", "9, 2., up", r"\*Node: got '2., up', needs numbers"),
        ("      9,           2.,           2.", "9", r"\*Node: node 9 has no coordinates"),
        ("*Node\n", "*Node, system=C\n", r"\*Node: has a system of its own, needs the x, y and z of the part; write"),
        ("*Node\n", "*System\n1., 0., 0.\n*Node\n", r"\*System: has a system of its own"),
        (" 1,  6,  1", " 1,  6,  0", r"\*Nset: got '1, 6, 0', needs first, last and a step >= 1"),
        (" Outer layer", " Outer rim", r"\*Elset: has 'Outer rim', which is no element and no set"),
        ("_Touch_S2, S2", "_Touch_S2, S7", r"\*Surface: has the side 'S7' of a quad, needs S1, S2, S3, S4"),
        ("_Touch_S2, S2", "Nowhere, S2", "has 'Nowhere', which is no element"),
        ("part=Pad", "part=Pod", r"\*Instance: 'Pod' is not known, needs one of Pad, Stamp; did you mean 'Pad'"),
        (
            "nset=Corner, instance=Pad-1",
            "nset=Corner, instance=Pad-2",
            "there is no instance 'pad-2', needs one of Pad-1, Stamp-1",
        ),
        (
            "type=CPE4RH",
            "type=CPE4HX",
            "has elements of the type CPE4HX, which is not known, needs CPE4 with",
        ),
        ("name=Touch", "nam=Touch", r"\*Surface: has no name=, needs name= and a name"),
        ("*Solid Section, elset=_PickedSet2", "*Solid Section, elset=x", r"\*Solid section: has no set 'x'"),
        ("         10.,           0.,           0.\n", "10., 0.\n", "got '10., 0.', needs 3 numbers"),
        ("10.,           0.,           1.,          90.", "10., 0., 0., 90.", "needs 7 numbers, two points of an axis"),
        ("*Heading", "*Include, input=deck.inp", "'.*deck.inp' includes itself"),
        ("*Heading", "*Include, input=other.inp", "there is no file '.*other.inp', needs a file beside"),
        ("*Heading", "Heading", "begins with 'Heading', needs a keyword such as"),
    ],
)
def test_a_damaged_deck_is_one_error_with_its_line(tmp_path, before, after, message):
    check_damage(tmp_path / "deck.inp", CAE, before, after, message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (CAE[: CAE.index("*End Part")], r"\*Part: does not end, needs \*End Part; export the deck again \(line 7\)"),
        (CAE[: CAE.index("*Assembly")], "has no elements that can be taken .*; put its parts into an assembly"),
        (
            flat("CIN3D8", CUBE, [range(1, 9)]),
            r"no elements that can be taken \(elements CIN3D8\), needs elements such as",
        ),
        (
            "*Node\n1, nan, 0.\n2, 1., 0.\n3, 0., 1.\n*Element, type=CPE3, elset=a\n1, 1, 2, 3",
            r"\*Node: got 'nan, 0.', needs numbers between commas \(line 2\)",
        ),
        ("**", "has no elements that can be taken"),
        (CAE.replace("2, 2, 3, 6, 5", "2, 2, 6, 3, 5"), "deck.inp: element Pad-1.2 at .* is inverted or flat"),
        (
            flat("CPE4", SQUARE, [(1, 3, 2, 4)]),
            "deck.inp: element 1 at .* is inverted or flat, .* area; list its nodes in the order",
        ),
        (
            flat("CPE4", [*SQUARE, (0.5, 2), (2, 2)], [(1, 2, 3, 4), (4, 3, 5), (4, 3, 6)]).replace(
                "2, 4, 3, 5\n3, 4, 3, 6", "*ELEMENT, TYPE=CPE3, ELSET=body\n12, 4, 3, 5\n15, 4, 3, 6"
            ),
            "has cells that fold over each other: 12 and 15 at",
        ),
        (
            flat("CPE4", [*SQUARE, (0.5, 2), (2, 2)], [(1, 2, 3, 4), (4, 3, 5), (4, 3, 6)]).replace(
                "2, 4, 3, 5\n3, 4, 3, 6", "*ELEMENT, TYPE=CPE3, ELSET=body\n12, 4, 3, 5\n12, 4, 3, 6"
            ),
            r"fold over each other: 1 \(counted from 0\) and 12 at",
        ),
    ],
)
def test_decks_without_a_mesh_are_refused(tmp_path, text, message):
    with pytest.raises(MeshError, match=message):
        read_mesh(write(tmp_path / "deck.inp", text))
