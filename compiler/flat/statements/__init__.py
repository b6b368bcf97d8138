"""Elaboration of statements: each kind checked and written into the record of the flat model."""
