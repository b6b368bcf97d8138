"""Residual, accelerations, energies, outputs and events of one model, as nodes of one graph."""
