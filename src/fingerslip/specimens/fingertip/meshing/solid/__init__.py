"""The mesh of a fingertip in space: a swept skin, joined to a core that Gmsh meshes."""
