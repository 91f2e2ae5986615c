"""The mesh of a fingertip in 3D: a swept skin, joined to a core that Gmsh meshes."""
