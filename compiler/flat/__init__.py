"""The flat model: components, arrays, loops, inheritance and imports are gone; all is resolved and checked."""
