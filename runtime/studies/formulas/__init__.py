"""Formulas that are found from numbers: constants of the motion, and their names."""
