"""Many runs of one model in one call of compiled code.

``members.py`` lists the values of the members, ``posed.py`` fills the arguments of the kernel (``runtime/kernel/ensemble``), ``batches.py``
calls it in a thread while the main thread handles Ctrl-C (``watch.py``), ``kept.py`` reduces members while they run, and ``run.py``
collects the results (``result_buffer.py``). A member that needs another build of the model, such as an implicit method, goes to it alone.
On a cluster, ``cluster.py`` hands batches to workers (``worker.py``) and takes the results back.
Smooth models with many members run in vector lanes or on an OpenCL device: ``lanes.py`` and ``device.py`` say when.
"""
