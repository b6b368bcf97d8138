"""The syntax tree as text in the canonical layout."""
