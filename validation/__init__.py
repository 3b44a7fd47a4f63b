"""Discrepancy measures, tolerances, suites, the runner and the command line."""

if __name__ == "validation":  # found in the folder of the sources: it would be a second copy
    raise ImportError("validation is a part of rockcheck: import rockcheck.validation")


from rockcheck.validation.discrepancy.compare import Discrepancy, compare

__all__ = ["Discrepancy", "compare"]
