"""Functional Mock-up Units, versions 2.0 and 3.0: see https://fmi-standard.org."""
