"""How far two histories differ: measures, `compare`, closed forms, measured histories."""

from rockcheck.validation.discrepancy.compare import Discrepancy, compare

__all__ = ["Discrepancy", "compare"]
