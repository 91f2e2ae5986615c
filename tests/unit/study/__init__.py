"""Tests of fingerslip.study, module by module."""
