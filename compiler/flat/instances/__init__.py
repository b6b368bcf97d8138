"""Making instances: components, modifications and the members that they end up with."""
