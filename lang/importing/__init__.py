"""Files of robots in other formats, as models of this language.

``imported`` reads a file and returns the text of a model in the canonical layout, with a head of comments that lists what the
model does not hold, each with its lines in the file. A reader of a format is one module here and one row of ``READERS``; it writes
statements through a ``Writer`` (``writing.py``), which makes names, numbers and poses. The text goes through the parser, so
that what is written is a model by construction.
"""

from .importing import READERS, Imported, imported
from .writing import Wishes

__all__ = ["READERS", "Imported", "Wishes", "imported"]
