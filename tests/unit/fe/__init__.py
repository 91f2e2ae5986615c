"""Tests of fingerslip.fe, module by module."""
