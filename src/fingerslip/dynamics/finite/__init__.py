"""Motions at large strain: Newton's method in every step, on factors that serve many steps."""
