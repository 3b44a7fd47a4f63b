"""Run time against error, and convergence."""
