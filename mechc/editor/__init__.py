"""What an editor asks while a model is written: messages, meanings, completions, edits. ``server.py`` speaks its protocol."""
