"""Actuators of MJCF: an input for each, and the force that follows from it by MuJoCo's gains, biases and activations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .mjcf_file import UNITS, MjcfFile, signed, within
from .writing import number, quantity, vector

FORCE = "FORCE"
"""Stands for the force of an actuator."""


class Actuators:
    """``lengths``: by tendon, its length; ``site``: gives the frame of a site. ``together``: by joint whose actuators have a largest
    force together, their forces."""

    def __init__(self, file: MjcfFile, lengths: Mapping[int, str], site: Callable[[int], str]) -> None:
        self.file, self.lengths, self.site = file, lengths, site
        self.m, self.mj, self.writer = file.m, file.mj, file.writer
        self.controls: dict[int, str] = {}
        """By actuator: its input."""
        self.activations: dict[int, str] = {}
        """By place among the activations: the state."""
        self.together = self._bounded_together()

    def write(self) -> None:
        """Write all of them."""
        for k in range(self.m.nu):
            self._actuator(k)
        self._sums()

    def _actuator(self, k: int) -> None:
        m, mj = self.m, self.mj
        name, given = self.file.named("actuator", k), self.file.given("actuator", k)
        line = next(
            (one.line for one in within(self.file.root) if given and one.attributes.get("name") == given), 0
        )
        target, why = self._target(k)
        if self.file.disabled("ACTUATION") or int(m.opt.disableactuator) >> int(m.actuator_group[k]) & 1:
            why = "it is disabled"
        dynamics, gain, bias = (
            int(m.actuator_dyntype[k]),
            int(m.actuator_gaintype[k]),
            int(m.actuator_biastype[k]),
        )
        fixed, affine = int(mj.mjtGain.mjGAIN_FIXED), int(mj.mjtGain.mjGAIN_AFFINE)
        plain = (int(mj.mjtDyn.mjDYN_NONE), int(mj.mjtDyn.mjDYN_INTEGRATOR), int(mj.mjtDyn.mjDYN_FILTER))
        exact = int(mj.mjtDyn.mjDYN_FILTEREXACT)
        if not why and (gain not in (fixed, affine) or bias > int(mj.mjtBias.mjBIAS_AFFINE)):
            why = f"it is a {mj.mjtGain(gain).name.removeprefix('mjGAIN_').lower()}"
        if not why and dynamics not in (*plain, exact):
            why = f"its dynamics are {mj.mjtDyn(dynamics).name.removeprefix('mjDYN_').lower()}"
        for what in ("damping", "armature", "dampingpoly", "delay"):
            value = getattr(m, f"actuator_{what}", None)
            if not why and value is not None and value[k].any():
                why = f"it has {what}"
        if why:
            self.writer.leave_out(f"the actuator '{given or name}': {why}", line)
            return
        self.writer.gap()
        drive = self.writer.name("input", f"{name}_control")
        self.writer.say(f"input Real {drive} = 0;")
        self.controls[k] = drive
        value = drive
        if m.actuator_ctrllimited[k]:
            value = f"clamp({drive}, {_bounds(m.actuator_ctrlrange[k])})"
        if dynamics != plain[0]:
            value = self._activation(k, name, value, integrates=dynamics == plain[1])
        factors, constants = m.actuator_gainprm[k].tolist(), m.actuator_biasprm[k].tolist()
        length, speed = target[1:]
        strength = number(factors[0]) if gain == fixed else f"({_affine(factors, length, speed)})"
        force = value if strength == "1" else f"{strength}*{value}"
        summed = bias == int(mj.mjtBias.mjBIAS_AFFINE) and any(constants[:3])
        if summed:
            force += f" + {_affine(constants, length, speed)}"
        force = force.replace("+ -", "- ")
        if m.actuator_forcelimited[k]:
            force = f"clamp({force}, {_bounds(m.actuator_forcerange[k])})"
        elif summed:
            force = f"({force})"
        if m.actuator_actearly[k]:
            self.writer.leave_out(
                f"that the activation of '{given or name}' acts a step early: there are no steps", line
            )
        if (joint := self._driven(k)) in self.together:
            gear = number(m.actuator_gear[k][0])
            self.together[joint].append(force if gear == "1" else f"{force}*{gear}")
            return
        for statement in target[0]:
            self.writer.say(statement.replace(FORCE, force))

    def _driven(self, k: int) -> int:
        """Return the joint that an actuator drives by itself, -1 where it drives something else."""
        by_joint = (int(self.mj.mjtTrn.mjTRN_JOINT), int(self.mj.mjtTrn.mjTRN_JOINTINPARENT))
        return int(self.m.actuator_trnid[k][0]) if int(self.m.actuator_trntype[k]) in by_joint else -1

    def _bounded_together(self) -> dict[int, list[str]]:
        """Return joints of one freedom that no actuator drives but by itself, where their forces have a bound together."""
        m = self.m
        wrapped: set[int] = set()
        for k in range(m.nu):
            if self._driven(k) >= 0:
                continue
            if int(m.actuator_trntype[k]) != int(self.mj.mjtTrn.mjTRN_TENDON):
                return {}
            start = int(m.tendon_adr[int(m.actuator_trnid[k][0])])
            if int(m.wrap_type[start]) != int(self.mj.mjtWrap.mjWRAP_JOINT):
                return {}
            count = int(m.tendon_num[int(m.actuator_trnid[k][0])])
            wrapped |= {int(joint) for joint in m.wrap_objid[start : start + count]}
        bound = [j for j in range(m.njnt) if m.jnt_actfrclimited[j] and int(m.jnt_type[j]) in UNITS]
        return {joint: [] for joint in bound if joint not in wrapped}

    def _sums(self) -> None:
        """Write the forces of actuators on joints where the sum of all has a bound."""
        m = self.m
        for joint, forces in self.together.items():
            if forces:
                bounds, unit = _bounds(m.jnt_actfrcrange[joint]), UNITS[int(m.jnt_type[joint])][2]
                force = " + ".join(forces).replace("+ -", "- ")
                self.writer.gap()
                self.writer.say(
                    f"force clamp({force}, {bounds})*{quantity(1, unit)} on {self.file.moved[joint]};"
                )

    def _target(self, k: int) -> tuple[tuple[tuple[str, ...], str, str], str]:
        """Return the statements that apply ``FORCE``, the length and its rate times the gear, and why there are none."""
        m, transmissions = self.m, self.mj.mjtTrn
        kind, target = int(m.actuator_trntype[k]), int(m.actuator_trnid[k][0])
        gear = [float(g) for g in m.actuator_gear[k]]
        if kind in (int(transmissions.mjTRN_JOINT), int(transmissions.mjTRN_JOINTINPARENT)):
            joint = int(m.jnt_type[target])
            if joint in UNITS:
                q, unit, force = self.file.moved[target], UNITS[joint][1], UNITS[joint][2]
                if reference := self.file.reference(target):
                    return (
                        (f"force {FORCE}*{quantity(gear[0], force)} on {q};",),
                        *_scaled(f"({q} + {signed(reference, unit)})", unit, gear[0], q),
                    ), ""
                return (
                    (f"force {FORCE}*{quantity(gear[0], force)} on {q};",),
                    *_scaled(q, unit, gear[0]),
                ), ""
            return ((), "", ""), "it drives a joint of several freedoms"
        if kind == int(transmissions.mjTRN_TENDON):
            if target in self.lengths:
                q = self.lengths[target]
                return ((f"force {FORCE}*{quantity(gear[0], 'N')} on {q};",), *_scaled(q, "m", gear[0])), ""
            return ((), "", ""), "its tendon is left out"
        if kind == int(transmissions.mjTRN_SITE) and int(m.actuator_trnid[k][1]) < 0:
            site = self.site(target)
            loads = []
            if any(gear[:3]):
                loads.append(f"force {FORCE}*{vector(gear[:3], 'N')} on {site} in {site};")
            if any(gear[3:]):
                loads.append(f"torque {FORCE}*{vector(gear[3:], 'N.m')} on {site} in {site};")
            return (tuple(loads), "0", "0"), ""
        return ((), "", ""), f"it acts through a {self.mj.mjtTrn(kind).name.removeprefix('mjTRN_').lower()}"

    def _activation(self, k: int, name: str, value: str, *, integrates: bool) -> str:
        """Write the activation of an actuator; returns it as it acts."""
        m = self.m
        state = self.writer.name("state", f"{name}_activation")
        self.writer.say(f"state Real {state} = 0;")
        self.activations[int(m.actuator_actadr[k])] = state
        tau = quantity(float(m.actuator_dynprm[k][0]), "s")
        self.writer.say(
            f"equation der({state}) = {f'{value}/(1 s)' if integrates else f'({value} - {state})/({tau})'};"
        )
        return f"clamp({state}, {_bounds(m.actuator_actrange[k])})" if m.actuator_actlimited[k] else state


def _bounds(pair: Any) -> str:
    return ", ".join(map(number, pair.tolist()))


def _scaled(length: str, unit: str, gear: float, q: str = "") -> tuple[str, str]:
    """Return a length, and the rate of its coordinate ``q``, times a gear, as numbers."""
    return f"{number(gear)}*{length}/(1 {unit})", f"{number(gear)}*der({q or length})/(1 {unit}/s)"


def _affine(factors: Sequence[float], length: str, speed: str) -> str:
    pieces = [number(factors[0])] if factors[0] else []
    pieces += [
        f"{number(factor)}*{what}"
        for factor, what in zip(factors[1:3], (length, speed), strict=True)
        if factor
    ]
    return " + ".join(pieces).replace("+ -", "- ") or "0"
