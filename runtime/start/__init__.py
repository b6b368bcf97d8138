"""Consistent initial states, and why there is none."""
