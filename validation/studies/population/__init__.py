"""Populations: a scene under many motions at many intensities; quantiles, fragility, fits."""
