"""Tests of fingerslip.specimens, module by module."""
