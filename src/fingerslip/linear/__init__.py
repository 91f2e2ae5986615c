"""Sparse direct solvers: factorise once, substitute many times; their memory and threads."""
