"""Long functions as loops: periodic runs of statements found again, and where their values lie meanwhile.

``rolled.py`` says what the result is, ``roll.py`` makes it of a function: statements in the order in which their nodes
were made (``stream.py``), runs of equal shape (``runs.py``), nests of loops (``nest.py``), what iterations read of the one
before them (``carried.py``), places in the workspace (``places.py``); then iterations are moved to where they are read, and
numbers become indices. ``replay.py`` follows the result and holds it against the function.
"""
