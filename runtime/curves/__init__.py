"""Curves that make something stationary: elements, Newton's method, meshes, and what kind of extremum is found."""
