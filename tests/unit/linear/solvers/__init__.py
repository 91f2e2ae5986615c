"""Tests of fingerslip.linear.solvers, module by module."""
