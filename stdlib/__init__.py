"""The standard library, written in the language itself: ``mech.planar``, ``mech.spatial`` and their company."""
