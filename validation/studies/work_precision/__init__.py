"""Run time against error: models by setting and scene, compiled batches, savings, orders of
convergence.
"""
