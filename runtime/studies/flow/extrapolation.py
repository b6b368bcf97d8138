"""Limits of values that are known at ever larger distances."""

from __future__ import annotations


def extrapolated(values: list[float]) -> float:
    """Give the limit of values at 1/R, 1/(2R), 1/(4R), ... by their polynomial at zero (Neville)."""
    row = list(values)
    for order in range(1, len(row)):
        row = [(2.0**order * row[k + 1] - row[k]) / (2.0**order - 1) for k in range(len(row) - 1)]
    return row[0]
