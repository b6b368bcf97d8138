"""The rows of the equations: residual, constraints and contacts, and what is checked of them beforehand."""
