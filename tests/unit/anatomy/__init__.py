"""Tests of fingerslip.anatomy, module by module."""
