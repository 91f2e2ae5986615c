"""Sparse direct solvers behind one protocol: factorise once, substitute many times; their memory and threads."""
