"""Rows solved: accelerations, multipliers, energies, and the answers to questions about named elements."""
