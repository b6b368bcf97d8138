"""Numerical methods that more than one question needs: rank, roots, Newton's method, continuation.

No other room calls ``svd``, ``lstsq``, ``brentq`` and the like (``tests/repository/test_numerics.py``).
"""
