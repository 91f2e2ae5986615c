"""The mesh of a section: a swept skin, joined to a core that Gmsh meshes."""
