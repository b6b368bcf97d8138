"""The same mechanics said otherwise: flat models that must move as a given one does."""
