"""Compiled code: the C compiler, the cache, and the kernel's functions and structs."""
