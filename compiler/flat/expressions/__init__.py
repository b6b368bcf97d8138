"""Elaboration of expressions: operators, functions, references and questions, with types and units."""
