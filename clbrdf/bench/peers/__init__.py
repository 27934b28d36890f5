"""What else could do the work: NumPy, Numba and C, each a function that returns E of the workload."""
