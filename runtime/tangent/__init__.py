"""The derivatives of a motion in its initial state, parameters and inputs.

``tangent_flow`` gives states, outputs and their derivatives over time with estimated errors; ``Tangents`` takes any state and any matrix
of directions further (``start``, ``flow``). The tangent of a model is a model with the state (y, W)
(``compiler/equations/tangents.py``), made only when a motion is differentiated. At an event the kernel's record is repeated
with derivatives (``instant.py``, ``impacts.py``), at a time that changes with each direction (``saltation.py``), and checked
against the kernel's result; any mismatch is refused.
"""
