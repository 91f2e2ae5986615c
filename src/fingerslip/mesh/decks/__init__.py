"""Decks of solvers as meshes: Abaqus and FEBio."""
