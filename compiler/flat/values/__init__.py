"""Values that are known while compiling: numbers, indices, angles, and what must be fixed before a run."""
