"""The torques of rigid bodies as linear functions of their inertial parameters, by Newton's and Euler's laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np


class FrameOfBody(Protocol):
    """What is read of the frame of a body: functions of y, in the axes of the world (``Functions.frame``)."""

    @property
    def rotation(self) -> Callable[..., Any] | None: ...
    @property
    def jacobian(self) -> Callable[..., Any]: ...
    @property
    def drift(self) -> Callable[..., Any]: ...
    @property
    def angular_velocity(self) -> Callable[..., Any] | None: ...


def _skew(a: Any) -> Any:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def _moment(a: Any) -> Any:
    """Return the matrix [3, 6] that gives I a of the moments xx yy zz xy xz yz."""
    x, y, z = a
    return np.array([[x, 0, 0, y, z, 0], [0, y, 0, x, 0, z], [0, 0, z, 0, x, y]])


def regressor_of(bodies: Sequence[FrameOfBody], gravity: Callable[..., Any]) -> Callable[[Any, Any], Any]:
    """Return (y, a) -> Y [nv, 10 bodies]; see ``Functions.regressor``."""

    def of_body(body: FrameOfBody, y: Any, a: Any, g: Any) -> Any:
        """Force and moment about the origin of the frame [6, 10], in its axes, then by the velocities of the model."""
        assert body.rotation is not None and body.angular_velocity is not None
        to_world, by_velocities = body.rotation(y), body.jacobian(y)
        rates = by_velocities @ a + body.drift(y)
        lift, turn, spin = (to_world.T @ x for x in (rates[:3] - g, rates[3:], body.angular_velocity(y)))
        wrench = np.zeros((6, 10))
        wrench[:3, 0] = lift
        wrench[:3, 1:4] = _skew(turn) + _skew(spin) @ _skew(spin)
        wrench[3:, 1:4] = -_skew(lift)
        wrench[3:, 4:] = _moment(turn) + _skew(spin) @ _moment(spin)
        return (by_velocities[:3].T @ to_world) @ wrench[:3] + (by_velocities[3:].T @ to_world) @ wrench[3:]

    def regressor(y: Any, a: Any) -> Any:
        y, a = np.asarray(y, dtype=float), np.asarray(a, dtype=float)
        g = gravity(y)
        return np.hstack([of_body(body, y, a, g) for body in bodies])

    return regressor
