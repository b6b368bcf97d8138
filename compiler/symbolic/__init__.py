"""The bridge to SymPy: the equations of a model for people's eyes."""
