"""The WebAssembly target: a program, without any other compiler, as functions beside a kernel that was built before.

``operations.py`` has a row for each operation; ``straight.py`` and ``rolled.py`` write bodies and loops;
``place.py`` says where data and functions lie, ``structs.py`` lays out the constant structs for 32 bits; ``link.py`` adds all of it
to a kernel. The order of operations is that of the C text, and so are all bits, on the same C library.
"""
