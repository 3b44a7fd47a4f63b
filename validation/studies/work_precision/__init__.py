"""Run time against error: models, compiled batches, savings, orders of convergence."""
