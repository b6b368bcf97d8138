"""Residual, accelerations, energies, outputs and events of one model, as nodes of one graph.

1. ``rows/``: the residual (bodies in central form, one reverse sweep; energies by Lagrange's operator; forces and constraints by
   virtual power), the constraints, and their rank at a few consistent states. Redundant rows are dropped and named.
2. ``solve/``: rows solved for accelerations and multipliers (``compiler/graph/elimination``), projections onto constraints, reactions.
   A joint whose reaction is asked for gets a virtual displacement that is always zero; the row of its rate is the force.
3. ``hybrid/``: relations as switches, their indicators, the actions of events, and the plan for the kernel.
4. ``reported/``: names, units, outputs and starts.
5. ``curves/``: curves that make an integral stationary.

With more than 64 rows of contacts and friction, the equations leave out their forces (``rows/crowd.py``); the kernel solves for those
of the contacts that touch. ``hybrid/crowd.py`` makes one function for each kind of contact, and bounds how
fast a gap may change, so that distant contacts are not evaluated.

An eliminated symbol may survive in a node although it cancels; ``solve/dead_symbols.py`` builds such functions again.
"""
