"""Overturning spectra of all models: tiles, the claims of the paper, agreement."""
