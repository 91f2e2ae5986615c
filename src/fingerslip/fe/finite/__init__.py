"""Finite elements at large strain: total Lagrangian, with laws in principal logarithmic strains."""
