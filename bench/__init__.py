"""Measurements of the compiler and of what it makes; ``python -m bench`` runs them all."""
