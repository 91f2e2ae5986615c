"""Tests of fingerslip.contact, module by module."""
