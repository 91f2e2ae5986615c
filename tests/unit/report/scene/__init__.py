"""Tests of fingerslip.report.scene."""
