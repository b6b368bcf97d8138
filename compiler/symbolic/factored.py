"""The shorter of an expression and its factors, where these are found soon."""

from __future__ import annotations

import sympy as sp

HIGHEST = 12
"""Numerators and denominators of exponents: factors are sought among polynomials that have a coefficient for each power below."""


def factored(expression: sp.Expr) -> sp.Expr:
    """Return it with its factors taken out if that is shorter; 0.67^(0.55*t) is a power of 549 999 for those who look for them."""
    if not all(_is_low(exponent) for exponent in _exponents(expression)):
        return expression
    return min(expression, sp.factor(expression), key=sp.count_ops)


def _exponents(expression: sp.Expr) -> list[sp.Expr]:
    powers = [power.exp for power in expression.atoms(sp.Pow)]
    return powers + [power.args[0] for power in expression.atoms(sp.exp)]


def _is_low(exponent: sp.Expr) -> bool:
    shares = [term.as_coeff_Mul()[0] for term in sp.Add.make_args(exponent)]
    return all(s.is_Rational and abs(s.p) <= HIGHEST and s.q <= HIGHEST for s in shares)
