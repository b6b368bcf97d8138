"""What a run gives: quantities over time, accuracy, energy accounts, files."""
