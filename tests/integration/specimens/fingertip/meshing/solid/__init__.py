"""Tests that mesh or simulate for long, module by module."""
