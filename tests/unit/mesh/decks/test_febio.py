"""Files of FEBio: they come with their regions, boundaries and materials; a damaged file is one error with its line."""

import re

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.errors import MeshError
from fingerslip.fe.space import boundary_nodes, build_space
from fingerslip.mesh.decks.materials import file_materials, read_materials
from fingerslip.mesh.io import read_mesh
from fingerslip.mesh.source import MeshFile
from unit.mesh.decks.texts import BETWEEN, CUBE, FEBIO, PRISM, SQUARE, TETRAHEDRON, TRIANGLE, check_damage, write

# The same in the versions before.
OF_3 = FEBIO.replace('version="4.0"', 'version="3.0"').replace(
    '<NodeSet name="Free">9, 10</NodeSet>', '<NodeSet name="Free"><n id="9"/><n id="10"/></NodeSet>'
)
OF_25 = OF_3.replace('version="3.0"', 'version="2.5"').replace("Mesh>", "Geometry>")
for number, part in enumerate(("Tissue", "Skin"), start=1):
    OF_25 = OF_25.replace(f'name="{part}">', f'name="{part}" mat="{number}">')
OF_25 = OF_25[: OF_25.index("\t<MeshDomains>")] + OF_25[OF_25.index("\t<Boundary>") :]


@pytest.mark.parametrize("text", [FEBIO, OF_3, OF_25], ids=["4.0", "3.0", "2.5"])
def test_a_file_comes_with_its_regions_and_boundaries(tmp_path, text, caplog):
    path = write(tmp_path / "pad.feb", text)
    with caplog.at_level("INFO"):
        mesh = read_mesh(path, "mm")
    space = build_space(mesh)
    assert {name: len(cells) for name, cells in mesh.subdomains.items()} == {"Tissue": 2, "Skin": 1, "Inner": 2}
    assert {name: len(facets) for name, facets in mesh.boundaries.items()} == {"Top": 1, "Beside": 2, "Fixed": 2}
    np.testing.assert_allclose(space.positions[boundary_nodes(space, "Top"), 2], 2e-3)
    np.testing.assert_allclose(space.positions[boundary_nodes(space, "Fixed"), 2], 0.0)
    assert space.full.dx[mesh.subdomains["Tissue"]].sum() == pytest.approx(1.5e-9)
    listed = "<Control>; <Boundary>; sets and surfaces with no cell and no side: Stamp, Rigid, Free"
    assert [record.getMessage() for record in caplog.records] == [f"{path}: without {listed}"]
    assert set(read_materials(path, "mm")) == {"Tissue", "Skin"}


@pytest.mark.parametrize(
    ("kinds", "corners", "size"),
    [
        ({"tri3": 3, "tri6": 6}, TRIANGLE, 1 / 2),
        ({"quad4": 4, "quad8": 8, "quad9": 9}, SQUARE, 1.0),
        ({"tet4": 4, "tet10": 10}, TETRAHEDRON, 1 / 6),
        ({"penta6": 6, "penta15": 15}, PRISM, 1 / 2),
        ({"hex8": 8, "hex20": 20, "hex27": 27}, CUBE, 1.0),
    ],
)
def test_every_element_is_read_and_has_its_size(tmp_path, kinds, corners, size):
    for kind, count in kinds.items():
        # Others are taken by their corners, wherever their further nodes are.
        between = {"tri6": BETWEEN["CPE6"], "tet10": BETWEEN["C3D10"]}.get(kind, [(0, 1)] * (count - len(corners)))
        points = [*corners, *(np.mean([corners[a], corners[b]], axis=0) for a, b in between)]
        nodes = [
            f'<node id="{n}">{",".join(map(str, [*point, 0][:3]))}</node>' for n, point in enumerate(points, start=1)
        ]
        cell = f'<elem id="1">{",".join(map(str, range(1, count + 1)))}</elem>'
        content = f'<Nodes>{"".join(nodes)}</Nodes><Elements type="{kind}">{cell}</Elements>'
        mesh = read_mesh(write(tmp_path / "pad.feb", f'<febio_spec version="4.0"><Mesh>{content}</Mesh></febio_spec>'))
        assert build_space(mesh).full.dx.sum() == pytest.approx(size)
        assert list(mesh.subdomains) == ["Part1"]


@pytest.mark.parametrize(
    ("units", "unit", "modulus"),
    [
        *(("", "mm", 1e6), ("mm-N-s", "mm", 1e6), ("SI", "m", 1.0), ("um-nN-s", "um", 1e3), ("CGS", "cm", 0.1)),
        *(("mm-kg-s", "mm", 1e3), ("mm-g-s", "mm", 1.0), ("mm-mg-s", "mm", 1e-3)),
    ],
)
def test_materials_that_exist_here_come_in_pascals(tmp_path, units, unit, modulus):
    path = write(
        tmp_path / "pad.feb", FEBIO.replace("<units>mm-N-s</units>", f"<units>{units}</units>" if units else "")
    )
    materials = read_materials(path, unit)
    gel, skin = materials["Tissue"], materials["Skin"]
    assert (type(gel), gel.poisson_ratio, gel.density) == (fs.NeoHookean, 0.45, 1000.0)
    assert gel.youngs_modulus == pytest.approx(0.05 * modulus)
    # Half as much again is there at once, of the shape alone.
    assert (skin.c10, skin.c01) == pytest.approx((0.015 * modulus, 0.03 * modulus))
    assert skin.bulk_modulus == pytest.approx(2.0 * modulus)
    assert [(term.share, term.time) for term in skin.prony] == [(pytest.approx(0.5 / 1.5), 0.2)]
    if unit == "mm" and units in {"mm-N-s", ""}:
        assert skin.density == pytest.approx(1100.0)


def test_a_file_that_names_its_units_needs_no_other_and_takes_none(tmp_path):
    path, bare = write(tmp_path / "pad.feb", FEBIO), FEBIO.replace("<units>mm-N-s</units>", "")
    silent = write(tmp_path / "silent.feb", bare)
    np.testing.assert_array_equal(read_mesh(path).p, read_mesh(silent, "mm").p)
    assert read_materials(path) == read_materials(path, "mm") == read_materials(silent, "mm")
    for read in (read_mesh, read_materials):
        with pytest.raises(MeshError, match=r"pad\.feb: unit: got 'm', the file's own units have mm; leave it out, or"):
            read(path, "m")
    assert (MeshFile(str(path)).assumes_metres, MeshFile(str(silent)).assumes_metres) == (False, True)
    weightless = "1000 kg/m^3 for Tissue, whose density is none of a tissue"
    assert file_materials(path, None).assumed == (weightless,)
    moduli = "the file names no units, so moduli are taken in N/mm^2"
    assert file_materials(silent, "mm").assumed == (moduli, weightless)


@pytest.mark.parametrize("tag", ["NodeSet", "ElementSet", "Surface"])
def test_sets_without_a_name_are_left_out(tmp_path, tag, caplog):
    with caplog.at_level("INFO"):
        mesh = read_mesh(write(tmp_path / "pad.feb", FEBIO.replace("</Mesh>", f"<{tag}/></Mesh>")))
    assert "" not in {**mesh.boundaries, **mesh.subdomains}
    assert f"<{tag}>; sets" in caplog.text


def test_units_that_febio_does_not_have_are_refused(tmp_path):
    with pytest.raises(MeshError, match=r"pad\.feb: <units>: got 'mm-N-m', needs one of SI, mm-N-s, .*\(line 5\)"):
        read_materials(write(tmp_path / "pad.feb", FEBIO.replace("mm-N-s", "mm-N-m")))


GEL = FEBIO[FEBIO.index('<material id="1"') : FEBIO.index('\t\t<material id="2"')]


def material(kind, constants):
    return f'<material id="1" name="gel" type="{kind}">{constants}</material>\n'


OGDEN = material("Ogden", "<c1>0.6</c1><m1>6</m1><c2>0.1</c2><m2>-2</m2><k>40</k>")
LINEAR = material("isotropic elastic", "<E>0.05</E><v>0.3</v>")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (LINEAR, fs.Elastic(0.05e6, 0.3, 1000.0)),
        (
            OGDEN,
            fs.Ogden((fs.OgdenTerm(0.1e6, 6.0), fs.OgdenTerm(-0.05e6, -2.0)), bulk_modulus=40e6, density=1000.0),
        ),
        (
            material("Mooney-Rivlin", "<density>1e-9</density><c1>0.1</c1><k>40</k>"),
            fs.MooneyRivlin(0.1e6, 1000.0, bulk_modulus=40e6),
        ),
        (
            material("incomp neo-Hookean", "<G>0.2</G><k>40</k><pressure_model>default</pressure_model>"),
            fs.MooneyRivlin(0.1e6, 1000.0, bulk_modulus=40e6),
        ),
        (
            material("viscoelastic", '<g1>1</g1><t1>1</t1><elastic type="neo-Hookean"/>'),
            "viscoelastic: relaxes in volume, too, as no law here does)",
        ),
        (
            material("viscoelastic", '<g1>1</g1><elastic type="neo-Hookean"><E>0.05</E><v>0.3</v></elastic>'),
            "viscoelastic: relaxes in volume, too, as no law here does; at rest youngs_modulus 50000.0 Pa,",
        ),
        (
            material(
                "uncoupled viscoelastic",
                '<g1>1</g1><t1>1</t1><k>1</k><elastic type="neo-Hookean"><E>1</E><v>0.3</v></elastic>',
            ),
            "uncoupled viscoelastic: has no law here",
        ),
        (material("rigid body", ""), "rigid body: has no law here"),
        (material("neo-Hookean", "<v>0.3</v>"), "neo-Hookean: without a number E"),
        (material("neo-Hookean", "<E>soft</E><v>0.3</v>"), "neo-Hookean: with E 'soft'"),
        (material("neo-Hookean", '<E type="map">stiffness</E><v>0.3</v>'), "neo-Hookean: with E 'stiffness'"),
        (material("neo-Hookean", '<E lc="1">1</E><v>0.3</v>'), "neo-Hookean: with E '1'"),
        (material("neo-Hookean", "<E>1</E><v>0.5</v>"), "neo-Hookean: got 0.5"),
        (material("Ogden", "<c1>1</c1><m1>0</m1><k>40</k>"), "Ogden: got 0"),
        (material("Mooney-Rivlin", "<c1>1</c1><k>40</k><pressure_model>1</pressure_model>"), "Mooney-Rivlin: has no"),
        (material("uncoupled viscoelastic", "<g1>-1</g1><t1>1</t1>"), "uncoupled viscoelastic: with shares that add"),
        (material("neo-Hookean", "<E>1</E><v>0.3</v>").replace(' id="1" name="gel"', ""), "none: has no law here"),
        ("", "none: has no law here"),
    ],
)
def test_every_material_is_a_law_or_is_listed(tmp_path, text, expected):
    materials = file_materials(write(tmp_path / "pad.feb", FEBIO.replace(GEL, text)), "mm")
    laws, rest = materials.laws, materials.refused
    if isinstance(expected, str):
        assert list(laws) == ["Skin"]
        assert rest[0].startswith(f"the material of Tissue ({expected}")
    else:
        assert rest == ("the material of Stamp (rigid body: has no law here)",)
        assert laws["Tissue"] == expected


@pytest.mark.parametrize(
    ("names", "name"), [('id="4" name="Plate"', "Plate"), ('id="4"', "4"), ("", "of no name")], ids=str
)
def test_a_material_that_no_cells_have_is_listed(tmp_path, names, name):
    text = FEBIO.replace("</Material>", f'<material {names} type="rigid body"></material></Material>')
    refused = file_materials(write(tmp_path / "pad.feb", text), "mm").refused
    assert refused[-1] == f"the material {name} (rigid body), which no cells have"
    if names:
        # Cells of a kind that is not read have it.
        text = text.replace("</Mesh>", '<Elements type="line2" mat="4" name="Wire"></Elements></Mesh>')
        assert len(file_materials(write(tmp_path / "wire.feb", text), "mm").refused) == len(refused) - 1


def test_a_file_in_millimetres_that_is_read_in_metres_is_warned_of(tmp_path):
    text = re.sub(r' units="[^"]*"|<units>.*?</units>', "", FEBIO)
    path = write(tmp_path / "pad.feb", text.replace(GEL, material("neo-Hookean", "<E>0.05</E><v>0.3</v>")))
    with pytest.warns(UserWarning, match=r"names no units, .*Tissue.* none of a tissue: give the unit .*unit='mm'"):
        read_materials(path)
    assert read_materials(path, "mm")["Tissue"].youngs_modulus == pytest.approx(0.05e6)


def test_a_file_of_another_program_has_no_materials(tmp_path):
    (tmp_path / "a.inp").write_text("*Node\n")
    for name, message in (("a.inp", "is no file of FEBio"), ("b.feb", "no such file")):
        with pytest.raises(MeshError, match=rf"{name}: {message}, needs a file that ends in .feb"):
            read_materials(tmp_path / name)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('<node id="9">0,0,2</node>', '<node id="9">0,0</node>', "<node>: got 2 numbers, needs 3 coordinates"),
        ('<node id="9">0,0,2</node>', '<node id="9">0,0,up</node>', "<node>: got '0,0,up', needs numbers between"),
        ('<node id="9">0,0,2</node>', "<node>0,0,2</node>", "<node>: got id='', needs the id of one thing"),
        ("2,13,3,6,14,7", "2,13,3,6,14", "<elem>: element 2 has 5 nodes, penta6 needs 6"),
        ("2,13,3,6,14,7", "2,13,3,6,14,77", "<elem>: has 77, which is not there"),
        ("9,10,11,12</quad4>", "9,10,11</quad4>", "<quad4>: has 3 nodes, needs 4"),
        ("9, 10</NodeSet>", "9, 99</NodeSet>", "<NodeSet>: has 99, which is not there"),
        ('<febio_spec version="4.0">', '<febio_spec version="1.2">', "has version 1.2, needs <febio_spec> of 2.5, 3.0"),
        ("</Nodes>", "</Node>", r"is no XML \(mismatched tag.*needs a whole file of FEBio; export it again"),
    ],
)
def test_a_damaged_file_is_one_error_with_its_line(tmp_path, before, after, message):
    check_damage(tmp_path / "pad.feb", FEBIO, before, after, message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (FEBIO[: FEBIO.index("<NodeSet")], r"is no XML \(no element found"),
        (FEBIO.replace("hex8", "hex9").replace("penta6", "pyra5").replace("quad4", "x"), "has no elements that can be"),
        ('<febio_spec version="4.0"></febio_spec>', "has no <Mesh>, needs one, with nodes and elements"),
        (
            FEBIO.replace('id="2">2,13,3,6,14,7', 'id="12">2,3,13,6,14,7'),
            "pad.feb: element 12 at .* is inverted or flat",
        ),
    ],
)
def test_files_without_a_mesh_are_refused(tmp_path, text, message):
    with pytest.raises(MeshError, match=message):
        read_mesh(write(tmp_path / "pad.feb", text))
