"""What the parser does where a token does not fit: what could have stood there, habits of other languages, going on."""
