"""What is asked of a problem: one run, several, a run in pieces."""
