"""Solutions in higher precision, kept in the cache, and errors measured against them."""
