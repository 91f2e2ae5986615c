"""Tests of fingerslip.parameters, module by module."""
