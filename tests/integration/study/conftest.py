"""The small study of the unit tests, here with its simulations."""

from unit.study.conftest import reports, write_study

__all__ = ["reports", "write_study"]
