"""What may be asked about a model: one file for each kind of study, with what it alone needs."""
