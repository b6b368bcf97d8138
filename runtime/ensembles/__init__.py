"""Many runs of one model: which members there are, what is kept of each, and all of them run in compiled code."""
