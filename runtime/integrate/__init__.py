"""A case integrated: the methods, the kernel and SciPy, trajectories, events, and how a run fails."""
