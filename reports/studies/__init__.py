"""Pages and figures of the studies: benchmark, convergence, spectra."""
