"""Long motions piece by piece, and how small changes of their start arrive."""
