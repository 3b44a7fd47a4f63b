"""Overturning spectra: tiles, refinement, histories, the other models."""
