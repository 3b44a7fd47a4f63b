"""Discrepancy measures, tolerances, suites, the runner and the command line."""

from validation.discrepancy import Discrepancy, compare

__all__ = ["Discrepancy", "compare"]
