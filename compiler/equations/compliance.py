"""What multipliers of a small compliance and weights of constraints are called where they are chosen or asked for."""

SINGULAR = "singular positions"
"""The topic of the choice that gives multipliers a compliance (singular.py)."""

SINGULAR_MASS = "singular mass matrix"
"""The topic of the choice that gives constraints weights (weights.py)."""

COMPLIANCE = "compliance"
"""The part that does both although nothing of the kind was found beforehand: where a run has met it."""
