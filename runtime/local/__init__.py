"""What happens near a state: displacements, derivatives, independent coordinates, equilibria."""
