"""Random models of curves, and a reference for them that shares no code with the compiler."""
