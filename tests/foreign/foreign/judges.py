"""Judges from SymPy's two methods: Kane's, and Lagrange's with multipliers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy
from sympy.physics.mechanics import KanesMethod, LagrangesMethod, dynamicsymbols

from foreign.case import Judge, plain


def kane(method: KanesMethod, forces: Sequence[Any] = (), **reactions: Any) -> Judge:
    """The judge of a formed KanesMethod. The equations of its auxiliary speeds are solved for ``forces``."""
    kinematics, t = method.kindiffdict(), dynamicsymbols._t
    none = {s.diff(t): 0 for s in method._uaux} | dict.fromkeys(method._uaux, 0)
    found = {}
    if forces:
        balance = [e.xreplace(none) for e in method.auxiliary_eqs]
        found = {plain(k): v for k, v in sympy.solve(balance, list(forces)).items()}
    held = list(method._k_nh * method.u + method._f_nh) if len(method._k_nh) else []
    return Judge(
        q=list(method.q),
        u=list(method.u),
        kinematics=[kinematics[s.diff(t)] for s in method.q],
        mass=method.mass_matrix,
        forcing=method.forcing.xreplace(none),
        config=list(method._f_h),
        velocity=[e.xreplace(none) for e in held],
        reactions=found | reactions,
    )


def kanes(
    frame: Any, q: Sequence[Any], u: Sequence[Any], kde: Sequence[Any], bodies: Any, loads: Any, **more: Any
) -> KanesMethod:
    """Kane's equations formed."""
    method = KanesMethod(frame, q, u, kd_eqs=list(kde), **more)
    method.kanes_equations(bodies, loads)
    return method


def lagrange(
    lagrangian: Any,
    q: Sequence[Any],
    config: Sequence[Any] = (),
    velocity: Sequence[Any] = (),
    reactions: Mapping[str, Any] | None = None,
    **more: Any,
) -> Judge:
    """The judge of Lagrange's equations; ``reactions`` are formulas of lam1, lam2, ... and the coordinates."""
    method = LagrangesMethod(lagrangian, q, hol_coneqs=config or None, nonhol_coneqs=velocity or None, **more)
    method.form_lagranges_equations()
    t = dynamicsymbols._t
    u = dynamicsymbols(f"u_:{len(q)}")
    speeds = dict(zip([s.diff(t) for s in q], u, strict=True))
    n = len(q)
    full, forcing = method.mass_matrix_full[n:, n:], method.forcing_full[n:, :]
    held = [e.diff(t).subs(speeds) for e in config] + [e.subs(speeds) for e in velocity]
    return Judge(
        q=list(q),
        u=list(u),
        kinematics=list(u),
        mass=full.subs(speeds),
        forcing=forcing.subs(speeds),
        config=list(config),
        velocity=held,
        multipliers=list(method.lam_vec) if config or velocity else (),
        reactions={k: v.subs(speeds) for k, v in (reactions or {}).items()},
    )
