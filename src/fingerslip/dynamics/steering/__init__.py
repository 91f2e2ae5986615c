"""Simulations that are taken step by step, commanded on the way, saved and restored."""
