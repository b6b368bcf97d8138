"""Affine residuals solved for their unknowns by straight-line code."""
