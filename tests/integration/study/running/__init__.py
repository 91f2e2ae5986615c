"""Runs that are simulated: together, side by side, and from a script."""
