"""Arrays of numbers: NumPy's, or plain ones that a short run does with where NumPy is not worth its import."""
