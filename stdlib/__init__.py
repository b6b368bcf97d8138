"""The standard library of models, written in the language itself."""
