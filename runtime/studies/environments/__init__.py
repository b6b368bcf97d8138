"""Models that a program takes on by control steps: one environment, a batch of them, and a run piece by piece.

``environments.py`` holds what all of them are made of, over ``kernel/ensemble/environments.h``; ``environment.py`` one of them, which
raises where it fails; ``stepper.py`` goes on to any time and reads and writes by name.
"""
