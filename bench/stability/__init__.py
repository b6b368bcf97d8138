"""Stiff and extreme cases, each with an expectation that can fail; ``python -m bench.stability --quick``."""
