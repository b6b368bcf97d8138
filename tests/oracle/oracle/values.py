"""What the oracle cannot answer."""

from __future__ import annotations


class NotCovered(Exception):
    """Say that the oracle has no meaning for a construct."""


class Undetermined(Exception):
    """Say that no law, or more than one, determines what is asked for."""


class Several(Undetermined):
    """Several motions satisfy the laws."""


class Ambiguous(Undetermined):
    """Several combinations of touching, sticking and sliding fit, none of them barely."""


class Uneven(Exception):
    """Say that places of an integral differ in what is decided at them, so that each has to be looked at by itself."""


class Bent(Exception):
    """Say that laws that were affine so far, so that one step of Newton's method was enough, are it no more."""
