"""What multipliers of a small compliance are called where they are chosen, and where they are asked for."""

SINGULAR = "singular positions"
"""The topic of the choice that gives multipliers a compliance (singular.py)."""

COMPLIANCE = "compliance"
"""The part that does so although no singular position was found beforehand: where a run has met one."""
