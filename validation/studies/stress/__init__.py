"""Stress: random scenes against invariants, where engines break, and the smallest scenes that show
a failure.
"""
