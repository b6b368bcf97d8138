"""What people ask, in names, units and texts, read into studies: questions as the runtime knows them, in SI."""
