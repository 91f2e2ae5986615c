"""Motions in a reduced basis, and how far they are from those on the mesh."""
