"""From the flat model to the Lagrangian record: coordinates, kinematics, energies, forces, constraints."""
