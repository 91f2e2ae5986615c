"""Small decks in the manner of the programs that write them."""

# A pad of 2 by 2 quadrilaterals of 1 mm, stood up and shifted by its instance, and a stamp beside it.
CAE = """\
*Heading
** Job name: pad Model name: Model-1
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


def flat(name, points, cells, more=""):
    """Return a deck without parts, of points (n, 2 or 3) and of cells by their nodes, counted from 1."""
    nodes = [f"{number}, {', '.join(map(str, point))}" for number, point in enumerate(points, start=1)]
    elements = [f"{number}, {', '.join(map(str, cell))}" for number, cell in enumerate(cells, start=1)]
    return "\n".join(["*NODE", *nodes, f"*ELEMENT, TYPE={name}, ELSET=body", *elements, more])
