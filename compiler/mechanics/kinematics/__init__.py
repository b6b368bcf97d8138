"""Frames as a tree of poses, their motion in the plane and in space, and the joints that place them."""
