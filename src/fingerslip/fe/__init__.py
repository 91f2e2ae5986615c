"""Small-strain finite elements: spaces, materials by cell, assembled matrices, and strains and stresses at the sites."""
