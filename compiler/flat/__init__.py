"""The flat model: components, arrays, loops, inheritance and imports are gone; everything is resolved and checked.

The subpackages, in the order in which a model passes them:

1. ``names/``: files and imports, the meaning of a name (``namespace.py``), inheritance expanded once for each class
   (``classes.py``), scopes.
2. ``values/``: values known while compiling, folded by ``evaluate.py``.
3. ``instances/``: members and modifications of each component (``modifications.py`` decides which one wins). Loops and structural
   conditions are unrolled when first needed. Members get types and values when first asked for, so that the order of the text
   does not matter.
4. ``expressions/``: types and units of expressions. Each built-in function has a rule in a table of ``functions.py``,
   ``kinematics.py`` or ``queries.py``.
5. ``statements/``: each kind of statement is checked and written into a ``Record``.
6. ``checks/``: checks of the whole model. ``flatten.py`` runs all of it and makes the ``FlatModel``.

Each error is reported once and raises ``Poisoned``; anything that depends on a poisoned value is skipped.
"""
