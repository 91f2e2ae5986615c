"""Tests of fingerslip.materials, module by module."""
