"""Discrepancy measures, tolerances, suites, the runner and the command line."""

from rockcheck.validation.discrepancy.compare import Discrepancy, compare

__all__ = ["Discrepancy", "compare"]
