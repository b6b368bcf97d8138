"""The meaning of the language by definition; see tests/oracle/README.md."""

from oracle.meaning import Meaning
from oracle.motion import Happening, Motion
from oracle.values import Ambiguous, NotCovered, Undetermined

__all__ = ["Ambiguous", "Happening", "Meaning", "Motion", "NotCovered", "Undetermined"]
