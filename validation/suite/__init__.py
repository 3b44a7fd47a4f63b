"""Suites of cells: read, run, judged against tolerances, accepted."""
