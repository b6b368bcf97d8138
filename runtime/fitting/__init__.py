"""Parameters found from measured motions."""
