"""What the oracle cannot answer."""

from __future__ import annotations


class NotCovered(Exception):
    """Say that the oracle has no meaning for a construct."""


class Undetermined(Exception):
    """Say that no law, or more than one, determines what is asked for."""


class Several(Undetermined):
    """Several motions satisfy the laws."""
