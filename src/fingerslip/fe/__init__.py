"""Finite elements: displacement spaces, assembly, integration that does not lock, strain and stress of a solution."""
