"""Tests of fingerslip.mesh, module by module."""
