"""What is measured of a model: errors against references, run times, what extremes do, what leaving out saves."""
