"""Numerical and input uncertainty, scatter of tests, and the verdict on a difference."""
