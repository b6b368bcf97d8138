"""Equations of a curve that makes something stationary."""
