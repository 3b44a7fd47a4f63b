"""Discrepancy measures, tolerances, suites, the runner and the command line."""

import lazy_loader

if __name__ == "validation":  # found in the folder of the sources: it would be a second copy
    raise ImportError("validation is a part of rockcheck: import rockcheck.validation")

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
