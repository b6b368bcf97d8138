"""Straight-line functions over arrays, ready to be printed in any target language."""
