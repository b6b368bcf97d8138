"""Random models over the whole language, their own meaning, and what compares them."""
