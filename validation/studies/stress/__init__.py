"""Stress: random scenes against invariants, where engines break, and minimal failing scenes."""
