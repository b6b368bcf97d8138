"""Program to text: Python, C and FMU."""
