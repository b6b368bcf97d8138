"""What switches: relations as switches, indicators, actions of events, jumps of energies, the plan for the kernel."""
