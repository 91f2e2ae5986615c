"""Inputs and results damaged at random, and runs ended at random moments."""
