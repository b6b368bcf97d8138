"""Text to syntax: source files, grammar, syntax tree, printer, units and diagnostics."""
