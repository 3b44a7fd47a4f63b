"""How far a scene and a figure can be trusted: numbers that are not known exactly, and what the
suites found about the models."""
