"""What a run is told and tells: names and units of every number, outputs, momenta, starts, experiments."""
