"""Solving: a ``Problem`` in, a ``Solution`` out. Knows nothing of the language."""
