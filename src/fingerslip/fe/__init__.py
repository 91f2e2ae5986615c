"""Small-strain finite elements: spaces, materials by cell, matrices, and strains and stresses from displacements."""
