"""What expressions of the flat model mean in nodes: symbols, values, functions."""
