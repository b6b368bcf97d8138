"""The derivatives of a motion in its initial state, parameters and inputs."""
