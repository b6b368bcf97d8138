"""The bridge to SymPy: formulas for people."""
