"""Programs as text: C, Python, FMUs, CasADi and JAX print the same statements in the same order.

JIT-compiled C computes the sines and cosines of a function four at a time (``sincos_batch.py``, ``kernel/sincos_batch.h``; ``c_sincos_batch.py`` in
loops), which changes the last bits; ``--reproducible``, C programs, FMUs and pages call the C library for each. Taylor
series of up to 64 slots are one loop over orders (``c_series.py``, ``kernel/series.h``); references use sums of two doubles
(``c_double_double.py``). ``lanes.py`` prints a program for vectors: smooth ensembles run several members at once, on devices too.
Loops whose iterations share nothing but sums are printed in blocks that compilers vectorise (``c_blocks.py``); the sums keep their
order unless ``MECH_UNORDERED`` is defined, as it is for runs without ``--reproducible``.
"""
