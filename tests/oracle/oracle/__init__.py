"""The meaning of the language by definition; see tests/oracle/README.md."""

from oracle.meaning import Meaning
from oracle.motion import Happening, Motion
from oracle.values import NotCovered, Undetermined

__all__ = ["Happening", "Meaning", "Motion", "NotCovered", "Undetermined"]
