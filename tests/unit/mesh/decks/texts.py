"""Small decks in the manner of the programs that write them."""

import pytest

from fingerslip.errors import MeshError
from fingerslip.mesh.io import read_mesh

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
TRIANGLE = [(0, 0), (1, 0), (0, 1)]
CUBE = [(*point, z) for z in (0, 1) for point in SQUARE]
PRISM = [(*point, z) for z in (0, 1) for point in TRIANGLE]
TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
# The corners between which the further nodes of quadratic elements lie.
BETWEEN = {
    "CPE8": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "CPE6": [(0, 1), (1, 2), (2, 0)],
    "C3D10": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    "C3D15": [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    "C3D20": [(a, b) for i in range(4) for a, b in [(i, (i + 1) % 4)]]
    + [(4 + i, 4 + (i + 1) % 4) for i in range(4)]
    + [(i, 4 + i) for i in range(4)],
}

# A pad of 2 by 2 quadrilaterals of 1 mm, stood up and shifted by its instance, and a stamp beside it.
CAE = """\
*Heading
** Job name: Größe Model name: Model-1
*Preprint, echo=NO, model=NO, history=NO, contact=NO
**
** PARTS
**
*Part, name=Pad
*Node
      1,           0.,           0.
      2,           1.,           0.
      3,           2.,           0.
      4,           0.,           1.
      5,           1.,           1.
      6,           2.,           1.
      7,           0.,           2.
      8,           1.,           2.
      9,           2.,           2.
*Element, type=CPE4RH
1, 1, 2, 5, 4
2, 2, 3, 6, 5
3, 4, 5, 8, 7
4, 5, 6, 9, 8
*Nset, nset=_PickedSet2, internal, generate
 1,  6,  1
*Elset, elset=_PickedSet2, internal
 1, 2
*Nset, nset="Outer layer", generate
 4,  9,  1
*Elset, elset="Outer layer", generate
 3,  4,  1
*Elset, elset=Half
 1,
 Outer layer
** Section: Section-1
*Solid Section, elset=_PickedSet2, material=Gel
,
*Solid Section, elset="OUTER LAYER", controls=EC-1, material=Skin
1.,
*End Part
**
*Part, name=Stamp
*Node
      1,  0., 0.
      2,  1., 0.
*Element, type=R2D2
1, 1, 2
*Elset, elset=All
 1,
*End Part
**
** ASSEMBLY
**
*Assembly, name=Assembly
**
*Instance, name=Pad-1, part=Pad
         10.,           0.,           0.
         10.,           0.,           0.,          10.,           0.,           1.,          90.
*End Instance
**
*Instance, name=Stamp-1, part=STAMP
*End Instance
**
*Node
      1,           5.,           5.,           0.
*Nset, nset=Reference, internal
 1,
*Nset, nset=Fixed, instance=Pad-1
 1, 2, 3
*Elset, elset=Fixed, instance=Pad-1, generate
 1,  2,  1
*Nset, nset=Corner, instance=Pad-1
 9,
*Nset, nset=Line, instance=Pad-1
 1, 4
*Nset, nset=Line, instance=Pad-1
 7,
*Elset, elset=_Touch_S3, internal, instance=Pad-1, generate
 3,  4,  1
*Elset, elset=_Touch_S2, internal, instance=Pad-1
 4,
*Surface, type=ELEMENT, name=Touch
_Touch_S3, S3
_Touch_S2, S2
*Surface, type=ELEMENT, name=Round
Pad-1.Outer layer,
*Surface, type=NODE, name=Fixed_CNS_
Fixed, 1.
Pad-1.9, 1.
*Surface, type=NODE, name=Fixed_CNS_2, internal
Fixed, 1.
*End Assembly
**
** MATERIALS
**
*Material, name=Gel
*Hyperelastic, neo hooke
0.01, 2.
*Step, name=Step-1, nlgeom=YES
*Static
0.1, 1., 1e-05, 1.
*Boundary
Fixed, 1, 1
*End Step
"""


def write(path, text):
    path.write_text(text, encoding="latin-1")
    return path


def check_damage(path, text, before, after, message):
    """Check that a deck with something else in it is refused by one error, with the line of it."""
    assert before in text
    with pytest.raises(MeshError, match=rf"{path.name}.*{message}") as caught:
        read_mesh(write(path, text.replace(before, after, 1)))
    assert caught.value.line == text[: text.index(before)].count("\n") + 1


def flat(name, points, cells, more=""):
    """Return a deck without parts, of points (n, 2 or 3) and of cells by their nodes, counted from 1."""
    nodes = [f"{number}, {', '.join(map(str, point))}" for number, point in enumerate(points, start=1)]
    elements = [f"{number}, {', '.join(map(str, cell))}" for number, cell in enumerate(cells, start=1)]
    return "\n".join(["*NODE", *nodes, f"*ELEMENT, TYPE={name}, ELSET=body", *elements, more])


# The corners of a square at heights 0 to 3, and two beside it.
NODES = [*(f"{x},{y},{z}" for z in range(3) for x, y in SQUARE), "2,0,0", "2,0,1", *(f"{x},{y},3" for x, y in SQUARE)]
NUMBERS = [*range(1, 15), *range(21, 25)]
# Two layers of one hexahedron each, a shell as an indenter above them, and a prism beside, in mm and N.
FEBIO = """\
<?xml version="1.0" encoding="ISO-8859-1"?>
<!-- pad -->
<febio_spec version="4.0">
	<Module type="solid">
		<units>mm-N-s</units>
	</Module>
	<Control>
		<analysis>STATIC</analysis>
	</Control>
	<Globals>
		<Constants><T>0</T></Constants>
	</Globals>
	<Material>
		<material id="1" name="gel" type="neo-Hookean">
			<density>1</density>
			<E>0.05</E>
			<v>0.45</v>
		</material>
		<material id="2" name="skin" type="uncoupled viscoelastic">
			<density>1.1e-09</density>
			<g1>0.5</g1>
			<t1>0.2</t1>
			<k>2</k>
			<elastic type="Mooney-Rivlin">
				<c1>0.01</c1>
				<c2>0.02</c2>
			</elastic>
		</material>
		<material id="3" name="stamp" type="rigid body">
			<density>1</density>
		</material>
	</Material>
	<Mesh>
		<Nodes name="Object1">
NODES
		</Nodes>
		<Elements type="hex8" name="Tissue">
			<elem id="1">1,2,3,4,5,6,7,8</elem>
		</Elements>
		<Elements type="penta6" name="Tissue">
			<elem id="2">2,13,3,6,14,7</elem>
		</Elements>
		<Elements type="hex8" name="Skin">
			<elem id="3">5,6,7,8,9,10,11,12</elem>
		</Elements>
		<Elements type="quad4" name="Stamp">
			<elem id="4">21,22,23,24</elem>
		</Elements>
		<NodeSet name="Fixed">1,2,3,
			4,13</NodeSet>
		<NodeSet name="Free">9, 10</NodeSet>
		<Surface name="Top">
			<quad4 id="1">9,10,11,12</quad4>
		</Surface>
		<Surface name="Beside">
			<tri3 id="1">6,14,7</tri3>
			<quad4 id="2">2,13,14,6</quad4>
		</Surface>
		<Surface name="Rigid">
			<quad4 id="1">21,22,23,24</quad4>
		</Surface>
		<ElementSet name="Inner">1,3</ElementSet>
		<SurfacePair name="Pair">
			<primary>Top</primary>
			<secondary>Rigid</secondary>
		</SurfacePair>
	</Mesh>
	<MeshDomains>
		<SolidDomain name="Tissue" mat="gel"/>
		<SolidDomain name="Skin" mat="skin"/>
		<ShellDomain name="Stamp" mat="stamp"/>
	</MeshDomains>
	<Boundary>
		<bc name="Fix" node_set="Fixed" type="zero displacement"><x_dof>1</x_dof></bc>
	</Boundary>
	<Output><plotfile type="febio"/></Output>
</febio_spec>
""".replace("NODES", "\n".join(f'\t\t\t<node id="{n}">{node}</node>' for n, node in zip(NUMBERS, NODES, strict=True)))
