"""Twins that begin elsewhere are told from those that must begin alike, and get the state of the model."""

from __future__ import annotations

import pytest
from random_models.carried import begins_alike, carried, hides_its_start
from random_models.compiled import Compiled, compiled, differences
from random_models.tree import Model
from random_models.twins import Twin

FREE = (
    "Free free(world -> b.a, x ~ 0.2 m, y ~ -0.3 m, angle ~ 0.4, der(x) ~ 0.9 m/s, der(angle) ~ -0.5 rad/s);"
)
SLOT = "PinSlot slot(world * trans({0.1, 0.3} m) -> b.a, axis = {0.6, 0.8});"
RACK = "Rack rack(angle = free.angle, position = free.x, r = 0.4 m);"
TWIN = Twin("another", Model(()))


def _rod(*statements: str) -> Compiled:
    lines = "\n".join(statements)
    return compiled(
        f"""import mech.planar.*;
        import mech.couplings.*;
        model M
        gravity {{0, -5}} m/s^2;
        Rod b(m = 0.9 kg, l = 0.95 m);
        {lines}
        output o = pos(b.b);
        output w = angvel(b.a);
        output a = der(vel(b.b)[2]);
        experiment(stop = 1 s);
        end M;
        """
    )


def test_a_state_is_carried_to_where_another_joint_closes_the_loop() -> None:
    base, other = _rod(FREE, SLOT), _rod(SLOT, FREE)
    assert not begins_alike(TWIN, base, other)
    there = carried(TWIN, base, other, base.start())
    assert there is not None
    assert there["slot.angle"] == pytest.approx(0.4, abs=1e-12)
    assert there["der(slot.angle)"] == pytest.approx(-0.5, abs=1e-12)
    assert not differences(base.outputs(base.start()), other.outputs(there))
    assert differences(base.outputs(base.start()), other.outputs(other.start()))


def test_a_twin_with_other_names_gets_the_state_too() -> None:
    base, other = _rod(FREE, SLOT), _rod(SLOT.replace("slot", "limb"), FREE)
    there = carried(Twin("another", Model(()), names={"slot": "limb"}), base, other, base.start())
    assert there is not None
    assert there["der(limb.angle)"] == pytest.approx(-0.5, abs=1e-12)


@pytest.mark.parametrize(("spin", "hidden"), [("", False), (", der(orientation) ~ {0.3, 0, 0} rad/s", True)])
def test_what_turns_freely_between_two_joints_begins_by_the_guesses_of_one(spin: str, hidden: bool) -> None:
    """The joint that closes the loop cannot tell how the rod turns about itself."""
    held = f"Spherical near(world -> b.a{spin});"
    far = "Spherical far(world * trans({0.8, 0, 0} m) -> far_end);"
    base, other = (_spun(*joints) for joints in ((held, far), (far, held)))
    assert carried(TWIN, base, other, base.start()) is None
    assert hides_its_start(TWIN, base, other, other.start()) is hidden
    assert bool(differences(base.outputs(base.start()), other.outputs(other.start()))) is hidden


def _spun(*joints: str) -> Compiled:
    body = "Body b(m = 1 kg, J = diag({0.1, 0.2, 0.2} kg.m^2), com = {0.4, 0, 0} m); frame far_end = b.a * trans({0.8, 0, 0} m);"
    return compiled(
        f"import mech.spatial.*; model M {body} {' '.join(joints)} output e = kinetic_energy(); experiment(stop = 1 s); end M;"
    )


def test_a_further_length_moves_what_is_assembled() -> None:
    base, other = _rod(FREE, RACK), _rod(FREE, RACK, "parameter Length far = 40 m; output beyond = far;")
    assert begins_alike(
        TWIN, base, _rod(FREE, RACK, "parameter Mass m = 40 kg; parameter Length idle = 40 m;")
    )
    assert not begins_alike(TWIN, base, other)
    there = carried(TWIN, base, other, base.start())
    assert there is not None
    assert not differences(base.outputs(base.start()), other.outputs(there))


def test_another_guess_is_no_other_weight() -> None:
    base, other = _rod(FREE, RACK), _rod(FREE.replace("0.2 m", "0.3 m"), RACK)
    assert differences(base.start(), other.start())
    assert begins_alike(TWIN, base, other)  # so that the starts are compared, and found to differ


def test_integrals_over_time_are_told_by_what_they_add_up() -> None:
    """Their numbers are those of the text: in a twin in another order each has the state of another."""
    text = """let {first};
    let {second};
    coordinate Length x = 1 m;
    kinetic 1 kg*der(x)^2;
    output o = slow + 3*fast;
    experiment(stop = 1 s);
    """
    slow, fast = "slow = integral(1 m/s)", "fast = integral(2 m/s)"
    lets = ({"first": slow, "second": fast}, {"first": fast, "second": slow})
    base, other = (compiled(text.format(**both)) for both in lets)
    state = base.start() | {"integral[1]": 0.5, "integral[2]": -0.7}
    there = carried(TWIN, base, other, state)
    assert there is not None
    assert not differences(base.outputs(state), other.outputs(there))
    assert differences(base.outputs(state), other.outputs(state))
