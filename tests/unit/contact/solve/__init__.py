"""Tests of fingerslip.contact.solve, module by module."""
