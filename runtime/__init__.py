"""Solving: a ``Problem`` in, a ``Solution`` out. Knows nothing of the language.

The subpackages, upper ones first; none imports one above it:

``studies/`` questions; ``curves/`` stationary curves; ``ensembles/`` many runs in one call; ``fitting/`` parameters from measured
motions; ``tangent/`` derivatives of motions; ``reference/`` solutions in higher precision; ``results/`` what a run gives; ``local/``
the neighbourhood of a state; ``integrate/`` methods and trajectories; ``case.py``; ``start/`` consistent initial states;
``native/`` compiled code and its cache; ``numerics/`` rank, roots, Newton's method, continuation.

A run: ``Problem`` → ``Functions`` (``functions.py``) → ``Case`` (``case.py``: parameters, inputs, times, start) → method and nominal
values (``integrate/choose_method.py``, ``integrate/nominal_run.py``) → ``Trajectory`` of the main run and of its companion at a tighter
tolerance (``integrate/kernel_run.py``) → ``Verdict`` (``studies/runs/simulate.py``) → ``Solution`` (``results/solution.py``).

A run may have more rows than fit into memory: ``rows.py`` says where they lie and takes them in slices, outputs are computed when
asked for (``results/evaluate.py``), and ``results/streamed.py`` writes a file during the run.
"""
